"""Steering by hand in `bench live`: updates a second at the simulated controller, and their age there.

A client in a process of its own sends targets as often as a pointer moves, beside a viewer of the three live
views. The age of a target is the time from its sending to the first update of the DACs that moves towards it.
"""

import asyncio
import json
import subprocess
import sys
import threading
import time
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from foveacam_hardware.contract import DeviceFault
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.cables import DacCodes
from foveacam_hardware.sim.render import warm_up
from foveacam_hardware.wire.controller_payloads import DAC_FULL_SCALE, DAC_FULL_SCALE_V
from foveacam_server.app import create_app
from foveacam_server.doors.listening_socket import listen
from foveacam_server.doors.process_limits import keep_start_objects
from foveacam_server.doors.server import WatchedServer, server_config
from foveacam_server.foundation.settings import Settings

OPEN_S = 120.0
POLL_S = 0.02
MOVED_V = 1.0
"""Least change of an axis that rounding cannot cause."""

Drive = tuple[int, DacCodes]
"""An update of the DACs: its time at the far end, ns, and the codes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SentTarget:
    """A target as the client sent it: one of the four axes goes to `value_v`, from `-value_v`."""

    t_ns: int
    axis: int
    value_v: float


def steering_figures(*, seconds: float) -> dict[str, float]:
    """Steer for a while and return the figures."""
    drives: list[Drive] = []
    warm_up()
    with TemporaryDirectory() as folder, _server(Path(folder)) as (port, rig):
        if rig.truth is None:
            raise DeviceFault("the bench steers the simulated rig alone")
        rig.truth.world.on_codes = lambda t_ns, codes: drives.append((t_ns, codes))
        sent = _steer(port, seconds=seconds)
    return judge(sent, drives)


def judge(sent: Sequence[SentTarget], drives: Sequence[Drive]) -> dict[str, float]:
    """Return updates a second and the ages of the targets, ms, from what was sent and what arrived."""
    times_ns = [t_ns for t_ns, _ in drives]
    begin, end = (bisect_left(times_ns, one.t_ns) for one in (sent[0], sent[-1]))
    ages_ms = [_age_ms(one, drives[bisect_left(times_ns, one.t_ns) :]) for one in sent]
    arrived_ms = [age_ms for age_ms in ages_ms if age_ms is not None]
    return {
        "steer_updates_per_s": round((end - begin) / ((sent[-1].t_ns - sent[0].t_ns) / 1e9), 1),
        "steer_age_p50_ms": round(float(np.percentile(arrived_ms, 50)), 2),
        "steer_age_p99_ms": round(float(np.percentile(arrived_ms, 99)), 2),
        "steer_targets": len(sent),
        "steer_targets_lost": len(sent) - len(arrived_ms),
    }


def _age_ms(target: SentTarget, later: Sequence[Drive]) -> float | None:
    sign = np.sign(target.value_v)
    for t_ns, codes in later:
        axis_v = (codes[2 * target.axis] - codes[2 * target.axis + 1]) * DAC_FULL_SCALE_V / DAC_FULL_SCALE
        if sign * axis_v > MOVED_V - abs(target.value_v):
            return (t_ns - target.t_ns) / 1e6
    return None


def _steer(port: int, *, seconds: float) -> list[SentTarget]:
    command = [sys.executable, "-m", "foveacam_bench.stream.steering_client", str(port), str(seconds)]
    output = subprocess.run(command, check=True, capture_output=True, text=True).stdout  # noqa: S603  # our own program
    return [SentTarget(**one) for one in json.loads(output)]


@contextmanager
def _server(folder: Path) -> Iterator[tuple[int, Rig]]:
    """Serve the simulated rig in this process, with far ends that report times; yield port and rig."""
    app = create_app(Settings(data=folder, viewer=False))
    listener = listen("127.0.0.1", 0)
    server = WatchedServer(server_config(app))
    thread = threading.Thread(
        target=lambda: asyncio.run(server.serve(sockets=[listener])), name="bench server"
    )
    thread.start()
    try:
        end_s = time.monotonic() + OPEN_S
        while not server.started and thread.is_alive() and time.monotonic() < end_s:
            time.sleep(POLL_S)
        hardware = app.state.services.hardware
        if not hardware.wait_open(OPEN_S):
            raise DeviceFault("the bench's rig did not open")
        keep_start_objects()  # as `foveacam serve` does
        yield int(listener.getsockname()[1]), hardware.submit(lambda rig: rig).result(OPEN_S)
    finally:
        server.should_exit = True
        thread.join()
        listener.close()
