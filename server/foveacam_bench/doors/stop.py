"""Measure how fast the server stops the mirrors under load from other clients (`foveacam bench doors`).

The stop is requested several hundred times while bodies of 63 MB, estimates, viewers (one of which never
reads), bursts of requests and fixations run; once without the bodies, to compare memory. Then follow 64
viewers that never read, requests that every port must refuse, shutdown of servers at work, first requests,
generated requests to every operation, and a person who takes all of a resource while another asks for it.
"""

import http.client
import json
import socket
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.parse import urlsplit

from foveacam_bench.doors.ends import end_figures
from foveacam_bench.doors.fairness import fairness_figures
from foveacam_bench.doors.first_use import first_use_figures
from foveacam_bench.doors.foreign import foreign_figures
from foveacam_bench.doors.generated import generated_figures
from foveacam_bench.figures import Figures, Report
from foveacam_bench.judging import peak_memory_kib, percentile
from foveacam_bench.servers import ServerProcess, free_port
from foveacam_bench.stream.clients import upgrade
from foveacam_server.rig.stream import CLIENTS_EACH

STOPS, QUICK_STOPS = 320, 5
EVERY, QUICK_EVERY = 1, 4
"""The first use is timed of one request in this many."""
AT_ONCE, QUICK_AT_ONCE = 1, 3
"""Parts after the stops that run at once; a quick run's times are those of a busy machine."""
PAUSE_S = 0.15
"""Pause between two stops; the rig may move in its second half."""
WARM_UP_S = 3.0
STOP = "/api/v1/stop"
TOKEN = "of this bench alone"  # noqa: S105 - of a server that lives as long as the bench


@dataclass(frozen=True, slots=True, kw_only=True)
class TimedStop:
    """One stop as measured by its client."""

    took_ms: float
    confirmed: bool
    controller_ms: float | None


def run(*, quick: bool = False, report: Report = lambda progress: None) -> Figures:
    """Measure and return the figures; `quick`: fewer stops, situations, limited resources and requests."""
    count = QUICK_STOPS if quick else STOPS
    with TemporaryDirectory() as folder:
        report("stops")
        quiet_mb, _, _ = _time_stops(Path(folder) / "quiet", count=count, bodies=False)
        peak_mb, stops, counts = _time_stops(Path(folder) / "loaded", count=count, bodies=True)
        figures = {**_stop_figures(stops), "rss_peak_mb": peak_mb, "rss_peak_ratio": peak_mb / quiet_mb}
        parts: dict[str, Callable[[Path], Figures]] = {
            "viewers that never read": _open_figures,
            "ends": partial(end_figures, quick=quick),
            "generated requests": partial(_generated_figures, quick=quick),
            "first requests": partial(first_use_figures, every=QUICK_EVERY if quick else EVERY),
            "fairness": partial(fairness_figures, quick=quick),
        }
        with ThreadPoolExecutor(QUICK_AT_ONCE if quick else AT_ONCE) as pool:
            for part in [
                pool.submit(_run_part, name, work, Path(folder), report) for name, work in parts.items()
            ]:
                figures |= part.result()
    return {**figures, "load": counts}


def _run_part(name: str, work: Callable[[Path], Figures], folder: Path, report: Report) -> Figures:
    """Run a part in a folder of its own."""
    report(name)
    own = folder / name.replace(" ", "-")
    own.mkdir()
    return work(own)


def _open_figures(folder: Path) -> Figures:
    """Return the figures of viewers that never read, and of foreign requests."""
    with _server(folder / "open") as server:
        held = count_held_viewers(server.url)
        return {"dead_viewers_after_30_s": held, **foreign_figures(server.url, pid=server.process.pid)}


def _generated_figures(folder: Path, *, quick: bool) -> Figures:
    token_file = folder / "token"
    token_file.write_text(TOKEN)
    with _server(folder / "generated", options=("--token-file", str(token_file))) as server:
        return generated_figures(server.url, folder, token=TOKEN, quick=quick)


def _time_stops(folder: Path, *, count: int, bodies: bool) -> tuple[float, list[TimedStop], dict[str, int]]:
    """Return the server's peak memory, MB, the stops, and the counts of the load."""
    with _server(folder) as server, _load(server.url, bodies=bodies) as load:
        time.sleep(WARM_UP_S)
        stops = [time_stop(server.url) for _ in range(count)]
        peak_mb = peak_memory_kib(server.process.pid) / 1e3
        printed, _ = load.communicate()
    return peak_mb, stops, json.loads(printed)


@contextmanager
def _server(folder: Path, *, options: Sequence[str] = ()) -> Iterator[ServerProcess]:
    folder.mkdir()
    with ServerProcess(folder, port=free_port(), options=options) as server:
        yield server


@contextmanager
def _load(url: str, *, bodies: bool) -> Iterator[subprocess.Popen[str]]:
    asked = [sys.executable, "-m", "foveacam_bench.doors.load", url, *["bodies"] * bodies]
    load = subprocess.Popen(asked, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)  # noqa: S603  # our own module
    try:
        yield load
    finally:
        load.kill()
        load.communicate()


def time_stop(url: str) -> TimedStop:
    """Request the stop on a new connection; release it after half a pause."""
    address = urlsplit(url)
    connection = http.client.HTTPConnection(address.hostname or "", address.port, timeout=60.0)
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


def _stop_figures(stops: list[TimedStop]) -> Figures:
    took_ms = sorted(stop.took_ms for stop in stops)
    controller_ms = [stop.controller_ms for stop in stops if stop.controller_ms is not None]
    return {
        "stops": len(stops),
        "stop_median_ms": statistics.median(took_ms),
        "stop_p99_ms": percentile(took_ms, 0.99),
        "stop_max_ms": took_ms[-1],
        "stops_unconfirmed": sum(not stop.confirmed for stop in stops),
        "controller_median_ms": statistics.median(controller_ms) if controller_ms else None,
        "controller_max_ms": max(controller_ms, default=None),
    }


VIEWERS = 64
WAIT_S = 30.0
_SMALL_BUFFER_BYTES = 4096
_SUBSCRIPTION = b'{"type": "subscribe", "views": {"wide": {"scale": 1}, "left": {"scale": 1}}}'


def count_held_viewers(url: str) -> int:
    """Open 64 viewers that subscribe and read nothing; return how many are still connected after 30 s."""
    viewers = [_viewer(url, f"127.0.0.{2 + number // CLIENTS_EACH}") for number in range(VIEWERS)]
    time.sleep(WAIT_S)
    held = sum(_held(viewer) for viewer in viewers)
    for viewer in viewers:
        viewer.close()
    return held


def _viewer(url: str, own_address: str) -> socket.socket:
    """Open a viewer from one local address: the server limits the viewers of each."""
    address = urlsplit(url)
    viewer = socket.socket()
    viewer.bind((own_address, 0))
    viewer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _SMALL_BUFFER_BYTES)
    viewer.connect((address.hostname, address.port))
    viewer.sendall(upgrade(address.netloc) + _masked(_SUBSCRIPTION))
    return viewer


def _masked(text: bytes) -> bytes:
    """Return a WebSocket text message of a client, with a mask of zeros."""
    return bytes((0x81, 0x80 | len(text))) + bytes(4) + text


def _held(viewer: socket.socket) -> bool:
    """Return whether the connection is still open after all waiting bytes have been read."""
    viewer.settimeout(1.0)
    try:
        while viewer.recv(65_536):
            pass
    except TimeoutError:
        return True
    except OSError:
        return False
    return False
