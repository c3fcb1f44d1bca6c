"""`foveacam bench soak`: 24 hours in virtual time, then 20 minutes with everybody at once.

The day: clicks, scans, recordings, drift, knocks, unplugged cameras, a silent holder of the lease, full
disks, stops, viewers that come and go; some minutes are skipped after each. Then a server as a user starts it
has twelve viewers, four services and one viewer that never reads, and is stopped every few seconds. Ctrl-C
ends either part early; its figures are those of the time until then.
"""

import json
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from foveacam_bench.doors.stop import TimedStop, time_stop
from foveacam_bench.figures import Figures, Report
from foveacam_bench.judging import percentile
from foveacam_bench.servers import ServerProcess, free_port
from foveacam_bench.small_disk import small_disk
from foveacam_bench.soak.activities import Soak
from foveacam_bench.soak.day import CLICKS, QUICK_CLICKS, live_through
from foveacam_bench.soak.held import growth_figures
from foveacam_bench.soak.soaked_server import Resources, SoakedServer, process_resources
from foveacam_bench.soak.tally import count_lost_jobs

HOURS, QUICK_HOURS = 24, 1
CROWD_S, QUICK_CROWD_S = 1200.0, 20.0
SETTLED_H = 4
"""Hours after which each kind of work has been done several times, and all its caches are filled."""
WARM_UP_SHARE = 1 / 3
"""Share of the second part after which memory is expected to be flat."""
STOP_PERIOD_S = 4.0
DISK_BYTES = 1_600_000_000
SEED = 2117


def run(*, quick: bool = False, report: Report) -> Figures:
    """Measure and return the figures; `quick`: one hour, whose growth is null, and a shorter second part."""
    hours, clicks = (QUICK_HOURS, QUICK_CLICKS) if quick else (HOURS, CLICKS)
    figures = day_figures(hours, clicks=clicks, report=report)
    crowd = crowd_figures(QUICK_CROWD_S if quick else CROWD_S, report=report)
    return figures | {f"crowd_{name}" if name in figures else name: value for name, value in crowd.items()}


def day_figures(hours: int, *, report: Report, clicks: int = CLICKS) -> Figures:
    """Live through the hours; return what the server held after them, and what went wrong."""
    with (
        TemporaryDirectory(prefix="foveacam-soak-") as name,
        small_disk(Path(name), size_bytes=DISK_BYTES) as disk,
        SoakedServer(Path(name)) as server,
    ):
        soak = Soak(server, seed=SEED, disk=disk)
        held: list[Resources] = []
        stopped = False
        try:
            for found in live_through(soak, hours=hours, clicks=clicks):
                held.append(found)
                report(f"hour {len(held) - 1} of {hours}")
        except KeyboardInterrupt:
            stopped = True
        third = max(1, len(soak.tally.click_ms) // 3)
        first, last = soak.tally.click_ms[:third], soak.tally.click_ms[-third:]
        return {
            "simulated_hours": len(held) - 1,
            "cut_short": stopped,
            **growth_figures(held, after=1),
            "rss_slope_settled_mb_per_h": growth_figures(held, after=SETTLED_H)["rss_slope_mb_per_h"],
            "rss_mb_by_hour": [round(found.rss_mb) for found in held],
            "activities": dict(soak.tally.done),
            "jobs": len(soak.tally.jobs),
            "lost_jobs": count_lost_jobs(soak.tally, server),
            "unparked_s": server.unparked_s,
            "unexpected": dict(soak.tally.unexpected),
            "full_disks": soak.tally.done["full_disk"] if disk is not None else 0,
            "click_p50_ms": statistics.median(soak.tally.click_ms or [0.0]),
            "click_last_over_first": statistics.median(last or [0.0]) / statistics.median(first or [1.0]),
        }


def crowd_figures(duration_s: float, *, report: Report) -> Figures:
    """Let all clients use a server at once; return its resources, and the delays of stops and events."""
    with TemporaryDirectory(prefix="foveacam-crowd-") as name:
        folder = Path(name)
        with ServerProcess(folder, port=free_port()) as server, _crowd(server.url) as crowd:
            began_s = time.monotonic()
            held: list[Resources] = []
            stops: list[TimedStop] = []
            try:
                while (passed_s := time.monotonic() - began_s) < duration_s:
                    stops.append(time_stop(server.url))
                    held.append(process_resources(server.process.pid, folder / "data", t_s=passed_s))
                    report(f"everybody at once, {passed_s:.0f} of {duration_s:.0f} s")
                    time.sleep(STOP_PERIOD_S)
            except KeyboardInterrupt:
                duration_s = time.monotonic() - began_s
            printed, _ = crowd.communicate()
            seen = json.loads(printed)
            lost = sum(not _ended(server, job_id) for job_id in seen.pop("jobs"))
        took_ms = [stop.took_ms for stop in stops]
        return {
            "crowd_s": duration_s,
            **growth_figures(held, after=round(WARM_UP_SHARE * len(held))),
            "lost_jobs": lost,
            "stops": len(stops),
            "stop_p50_ms": statistics.median(took_ms or [0.0]),
            "stop_p99_ms": percentile(took_ms, 0.99),
            "stops_unconfirmed": sum(not stop.confirmed for stop in stops),
            **seen,
        }


def _ended(server: ServerProcess, job_id: str) -> bool:
    return server.send("GET", f"/jobs/{job_id}").json()["ended_utc"] is not None


@contextmanager
def _crowd(url: str) -> Iterator[subprocess.Popen[str]]:
    asked = [sys.executable, "-m", "foveacam_bench.soak.crowd", url]
    crowd = subprocess.Popen(asked, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)  # noqa: S603  # our own module
    try:
        yield crowd
    finally:
        crowd.kill()
        crowd.communicate()
