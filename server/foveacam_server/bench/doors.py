"""`foveacam bench doors`: what strangers on the network can do to the server, above all to its stop.

The stop is pressed several hundred times while bodies of 63 MB, estimates, viewers (one of which never
reads), bursts of requests and fixations run; once without the bodies, for the memory. Then 64 viewers that
never read, whoever should not be let in at any port, and generated requests to every operation.
"""

import http.client
import json
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.parse import urlsplit

from foveacam_server.bench.doors_foreign import foreign_figures
from foveacam_server.bench.doors_generated import check_generator, generated_figures
from foveacam_server.bench.doors_viewers import dead_viewers
from foveacam_server.bench.server_process import ServerProcess, free_port

STOPS, QUICK_STOPS = 320, 40
PAUSE_S = 0.15
"""Between two stops; the second half of each pause the rig may move."""
WARM_UP_S = 3.0
STOP = "/api/v1/stop"


@dataclass(frozen=True, slots=True, kw_only=True)
class TimedStop:
    """One stop as the one who asked for it saw it."""

    took_ms: float
    confirmed: bool
    controller_ms: float | None


def run(*, quick: bool = False) -> dict[str, object]:
    """Measure and return the figures; about fifteen minutes, quick about five."""
    check_generator()
    count = QUICK_STOPS if quick else STOPS
    with TemporaryDirectory() as folder:
        quiet_mb, _, _ = _stopped(Path(folder) / "quiet", count=count, bodies=False)
        peak_mb, stops, counts = _stopped(Path(folder) / "loaded", count=count, bodies=True)
        figures = {**_stop_figures(stops), "rss_peak_mb": peak_mb, "rss_peak_ratio": peak_mb / quiet_mb}
        with _server(Path(folder) / "open") as server:
            figures["dead_viewers_after_30_s"] = dead_viewers(server.url)
            figures |= foreign_figures(server.url, pid=server.process.pid)
        with _server(Path(folder) / "generated") as server:
            figures |= generated_figures(server.url, Path(folder), quick=quick)
    return {**figures, "load": counts}


def _stopped(folder: Path, *, count: int, bodies: bool) -> tuple[float, list[TimedStop], dict[str, int]]:
    """Return the server's peak memory, MB, the stops, and what was asked meanwhile."""
    with _server(folder) as server, _load(server.url, bodies=bodies) as load:
        time.sleep(WARM_UP_S)
        stops = [_stop(server.url, kept=None) for _ in range(count)]
        peak_mb = _peak_mb(server.process.pid)
        printed, _ = load.communicate()
    return peak_mb, stops, json.loads(printed)


@contextmanager
def _server(folder: Path) -> Iterator[ServerProcess]:
    folder.mkdir()
    with ServerProcess(folder, port=free_port()) as server:
        yield server


@contextmanager
def _load(url: str, *, bodies: bool) -> Iterator[subprocess.Popen[str]]:
    asked = [sys.executable, "-m", "foveacam_server.bench.doors_load", url, *["bodies"] * bodies]
    load = subprocess.Popen(asked, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)  # noqa: S603  # our own module
    try:
        yield load
    finally:
        load.kill()
        load.communicate()


def _stop(url: str, *, kept: http.client.HTTPConnection | None) -> TimedStop:
    """Press the stop as a program does that asks for the first time; release it after half a pause."""
    address = urlsplit(url)
    connection = kept or http.client.HTTPConnection(address.hostname or "", address.port, timeout=60.0)
    began_s = time.perf_counter()
    connection.request("POST", STOP)
    answer = json.loads(connection.getresponse().read())
    took_ms = 1e3 * (time.perf_counter() - began_s)
    time.sleep(PAUSE_S / 2)
    connection.request("DELETE", STOP)
    connection.getresponse().read()
    connection.close()
    time.sleep(PAUSE_S / 2)
    return TimedStop(
        took_ms=took_ms,
        confirmed=answer.get("parked") is True,
        controller_ms=answer.get("parked_in_ms"),
    )


def _stop_figures(stops: list[TimedStop]) -> dict[str, object]:
    took_ms = sorted(stop.took_ms for stop in stops)
    controller_ms = [stop.controller_ms for stop in stops if stop.controller_ms is not None]
    return {
        "stops": len(stops),
        "stop_median_ms": statistics.median(took_ms),
        "stop_p99_ms": took_ms[min(len(took_ms) - 1, round(0.99 * len(took_ms)))],
        "stop_max_ms": took_ms[-1],
        "stops_unconfirmed": sum(not stop.confirmed for stop in stops),
        "controller_median_ms": statistics.median(controller_ms) if controller_ms else None,
        "controller_max_ms": max(controller_ms, default=None),
    }


def _peak_mb(pid: int) -> float:
    """Return the largest resident memory that a process ever had, MB."""
    status = Path(f"/proc/{pid}/status").read_text()
    line = next(line for line in status.splitlines() if line.startswith("VmHWM:"))
    return int(line.split()[1]) / 1e3
