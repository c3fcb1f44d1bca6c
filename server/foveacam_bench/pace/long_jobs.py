"""Duration of the jobs that a person waits for: a raster, a look around, a whole calibration.

Each runs on a server in real time, as a job of REST, while nobody looks at the views; the calibration also as
`foveacam calibrate all`, in virtual time.
"""

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from foveacam_bench.figures import Figures, Report
from foveacam_bench.servers import ServerProcess, free_port
from foveacam_client import Rig, StartedJob, models
from foveacam_client.call import ResultT
from foveacam_hardware.contract import DeviceFault
from foveacam_server.commands.server_rig import server_rig

POINTS, QUICK_POINTS = 9, 3
"""Points of the raster along each side."""
NODES = 9
"""Nodes of the sweeps along each side; a fit needs 30 poses."""
OF_CALIBRATIONS = (
    "calibrate_all_s",
    "calibrate_all_nodes",
    "calibrate_all_real_time_s",
    "calibrate_all_check_epipolar_rms_px",
    "calibrate_all_check_pointing_rms_px",
)
HALF_DEG = 7.0
DISTANCE_M = 4.0
CALIBRATION_SCENE = "calibration"
PATIENCE_S = 900.0


def long_job_figures(folder: Path, *, quick: bool = False, report: Report = lambda progress: None) -> Figures:
    """Return the times of all; `quick`: of a smaller raster (`…_points`), and null for the calibrations."""
    report("a raster and a look around")
    found = raster_figures(folder / "raster", side=QUICK_POINTS if quick else POINTS)
    found |= look_around_figures(folder / "around")
    report("calibrate all")
    return found | (dict.fromkeys(OF_CALIBRATIONS) if quick else all_calibration_figures(folder))


def all_calibration_figures(folder: Path) -> Figures:
    """Return the times of a whole calibration by the command and by a server."""
    found = command_figures(folder / "command", nodes=NODES)
    return found | calibration_figures(folder / "calibration", nodes=NODES)


def raster_figures(folder: Path, *, side: int) -> Figures:
    """Capture `side` x `side` points of the opening scene at full size; return seconds, points and frames."""
    grid = models.GridPoints(
        kind="grid", columns=side, rows=side, half_width_deg=HALF_DEG, half_height_deg=HALF_DEG
    )
    plan = models.RasterPlan(points=grid, verging=models.Verging(mode="given", distance_m=DISTANCE_M))
    request = models.CaptureRequest(name="raster", plan=plan)
    with _served(folder) as rig:
        took_s, taken = run_job(rig, lambda: rig.api.captures.create(request))
    return {"raster_s": took_s, "raster_points": taken.points.taken, "raster_frames": taken.points.frames}


def look_around_figures(folder: Path) -> Figures:
    """Look around in the opening scene; return seconds and the share of the wide view with a depth."""
    with _served(folder) as rig:
        took_s, found = run_job(rig, rig.api.wide_depth.look_around)
    return {"look_around_s": took_s, "look_around_known_fraction": found.known_fraction}


def command_figures(folder: Path, *, nodes: int) -> Figures:
    """Run `foveacam calibrate all`, which has its own time; return the seconds until it has ended."""
    folder.mkdir(parents=True)
    options = ["--nodes", f"{nodes}x{nodes}", "--data", str(folder / "data"), "--json"]
    command = [sys.executable, "-m", "foveacam_server", "calibrate", "all", *options]
    began_s = time.monotonic()
    ended = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603 - our own
    took_s = time.monotonic() - began_s
    if ended.returncode != 0:
        raise DeviceFault(f"the bench's `calibrate all` has failed: {ended.stderr.strip()[-500:]}")
    return {"calibrate_all_s": round(took_s, 1), "calibrate_all_nodes": nodes * nodes}


def calibration_figures(folder: Path, *, nodes: int) -> Figures:
    """Calibrate from nothing as a job of a server; return seconds in real time, and errors checked."""
    options = models.AllOptions(
        mirrors=models.MirrorsOptions(nodes=[nodes, nodes]),
        activate=True,
    )
    request = models.AllRun(step="all", options=options)
    with _served(folder, "--scene", CALIBRATION_SCENE) as rig:
        session = rig.api.calibration_sessions.create(models.SessionRequest(label="bench"))
        took_s, ended = run_job(rig, lambda: rig.api.calibration_sessions.run(session.id, request))
    if ended.check is None:
        raise DeviceFault("the bench's calibration has checked nothing")
    return {
        "calibrate_all_real_time_s": took_s,
        "calibrate_all_check_epipolar_rms_px": ended.check.epipolar_rms_px,
        "calibrate_all_check_pointing_rms_px": ended.check.pointing_rms_px,
    }


def run_job(rig: Rig, begin: Callable[[], StartedJob[ResultT]]) -> tuple[float, ResultT]:
    """Begin a job; return the seconds until it has succeeded, and its result."""
    began_s = time.monotonic()
    found = rig.wait(begin(), timeout_s=PATIENCE_S)
    return round(time.monotonic() - began_s, 2), found


@contextmanager
def _served(folder: Path, *options: str) -> Iterator[Rig]:
    folder.mkdir(parents=True)
    with (
        ServerProcess(folder, port=free_port(), options=options) as server,
        server_rig(server.url, token=None) as rig,
    ):
        yield rig
