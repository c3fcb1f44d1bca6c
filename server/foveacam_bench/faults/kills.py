"""SIGKILL of the process that drives the mirrors: time until they are at rest with the rail off.

Most hosts are the small `killed_host`, some the real server. The controller's far end is a process on a pty
that survives them, like a real controller.
"""

import random
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from foveacam_bench.faults.tally import FaultTally, LimitCables, p95
from foveacam_bench.servers import ServerProcess, free_port
from foveacam_hardware.contract import DeviceFault, MirrorLimits
from foveacam_hardware.sim.far_ends.controller_process import ControllerProcess

SMALL_HOSTS, QUICK_SMALL_HOSTS = 45, 1
SERVERS, QUICK_SERVERS = 5, 1
SEED = 9
LONGEST_LIFE_S = 0.4
"""Longest time between a host's start and its kill."""
DUE_S = 1.0
PATIENCE_S = 10.0
HOST = "foveacam_bench.faults.killed_host"
RIG = """format = "foveacam-rig"
version = 1
kind = "serial"
rig_id = "to-be-killed"

[mirrors]
port = "{port}"
"""


class RailCables(LimitCables):
    """Cables that record when the rail goes off."""

    def __init__(self) -> None:
        super().__init__(MirrorLimits())
        self.off = threading.Event()

    def set_rail(self, t_ns: int, *, on: bool) -> None:
        """Record the state of the rail."""
        super().set_rail(t_ns, on=on)
        if on:
            self.off.clear()
        else:
            self.off.set()


def measure(tally: FaultTally, quick: bool) -> dict[str, float | int | bool]:
    """Kill hosts; return their number, how many mirrors were parked in time, and how long that took."""
    rng = random.Random(SEED)  # noqa: S311 - not a secret
    small, servers = (QUICK_SMALL_HOSTS, QUICK_SERVERS) if quick else (SMALL_HOSTS, SERVERS)
    cables = RailCables()
    times_s: list[float] = []
    with ControllerProcess(cables, strict=True) as controller:
        for number in range(small):
            with _small_host(controller.port, seed=number) as process:
                times_s += _kill_host(process, cables, tally, rng)
        for _ in range(servers):
            with _server(controller.port) as process:
                times_s += _kill_host(process, cables, tally, rng)
    tally.add_violations(cables.violations)
    return {
        "kills": small + servers,
        "parked": sum(time_s <= DUE_S for time_s in times_s),
        "parked_p95_s": p95(times_s),
        "parked_max_s": max(times_s, default=0.0),
    }


def _kill_host(
    process: subprocess.Popen[bytes], cables: RailCables, tally: FaultTally, rng: random.Random
) -> list[float]:
    """Kill a host; return the time until its mirrors were at rest with the rail off, if they ever were."""
    time.sleep(rng.uniform(0.0, LONGEST_LIFE_S))
    if cables.off.is_set():
        raise DeviceFault("the bench's host has no rail on, so its kill proves nothing; see its messages")
    killed_ns = time.monotonic_ns()
    process.kill()
    if not cables.off.wait(PATIENCE_S):
        tally.add_hang()
        return []
    off_ns = cables.rails[-1][0]
    at_rest = [codes for t_ns, codes in cables.drives if t_ns <= off_ns][-1] == cables.rest
    return [(off_ns - killed_ns) / 1e9] if at_rest else []


@contextmanager
def _small_host(port: str, *, seed: int) -> Iterator[subprocess.Popen[bytes]]:
    command = [sys.executable, "-m", HOST, "--port", port, "--seed", str(seed)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as process:  # noqa: S603 - our own program
        try:
            if process.stdout is None or process.stdout.readline() != b"ready\n":
                raise DeviceFault("the bench's host did not start; see its message above")
            yield process
        finally:
            process.kill()


@contextmanager
def _server(port: str) -> Iterator[subprocess.Popen[bytes]]:
    with tempfile.TemporaryDirectory(prefix="foveacam-bench-") as name:
        folder = Path(name)
        rig = folder / "rig.toml"
        rig.write_text(RIG.format(port=port), encoding="utf-8")
        with ServerProcess(folder, port=free_port(), options=("--rig", str(rig))) as server:
            yield server.process
