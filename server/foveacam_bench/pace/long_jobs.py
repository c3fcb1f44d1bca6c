"""How long the jobs that a person waits for take: a raster, a look around, a whole calibration.

Each runs on a server in real time, as a job of REST, while nobody looks at the views; the calibration also as
`foveacam calibrate all`, which has its own time.
"""

import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from foveacam_bench.figures import Figures, Report
from foveacam_bench.servers import ServerProcess, free_port
from foveacam_client.document import JsonObject
from foveacam_hardware.contract import DeviceFault, Timeout

POINTS, QUICK_POINTS = 9, 3
"""Points of the raster along each side."""
NODES, QUICK_NODES = 9, 5
"""Nodes of the sweeps along each side; a fit needs 30 poses."""
VIEWS, QUICK_VIEWS = None, 8
"""Views of the board; None: as many as a calibration takes."""
HALF_DEG = 7.0
DISTANCE_M = 4.0
CALIBRATION_SCENE = "calibration"
PATIENCE_S = 900.0
POLL_S = 0.25


def long_job_figures(folder: Path, *, quick: bool = False, report: Report = lambda progress: None) -> Figures:
    """Return the times of all; quick ones are smaller, and say how large (`…_points`, `…_nodes`)."""
    side, nodes, views = (QUICK_POINTS, QUICK_NODES, QUICK_VIEWS) if quick else (POINTS, NODES, VIEWS)
    report("a raster and a look around")
    found = raster_figures(folder / "raster", side=side) | look_around_figures(folder / "around")
    report("calibrate all")
    found |= command_figures(folder / "command", nodes=nodes, views=views)
    report("calibrate all in real time")
    return found | calibration_figures(folder / "calibration", nodes=nodes, views=views)


def raster_figures(folder: Path, *, side: int) -> Figures:
    """Capture `side` x `side` points of the opening scene at full size; return seconds, points and frames."""
    grid = {
        "kind": "grid",
        "columns": side,
        "rows": side,
        "half_width_deg": HALF_DEG,
        "half_height_deg": HALF_DEG,
    }
    plan = {"points": grid, "verging": {"mode": "given", "distance_m": DISTANCE_M}}
    with _served(folder) as server:
        took_s = run_job(server, "/captures", {"name": "raster", "plan": plan})
        taken = server.send("GET", "/captures").json()[0]["points"]
    return {"raster_s": took_s, "raster_points": taken["taken"], "raster_frames": taken["frames"]}


def look_around_figures(folder: Path) -> Figures:
    """Look around in the opening scene; return seconds and the share of the wide view with a depth."""
    with _served(folder) as server:
        took_s = run_job(server, "/wide_depth/surveys")
        known = server.send("GET", "/wide_depth").json()
    return {"look_around_s": took_s, "look_around_known_fraction": known["known_fraction"]}


def command_figures(folder: Path, *, nodes: int, views: int | None) -> Figures:
    """Run `foveacam calibrate all`, which has its own time; return the seconds until it has ended."""
    folder.mkdir(parents=True)
    options = ["--nodes", f"{nodes}x{nodes}", "--data", str(folder / "data"), "--json"]
    options += [] if views is None else ["--views", str(views)]
    command = [sys.executable, "-m", "foveacam_server", "calibrate", "all", *options]
    began_s = time.monotonic()
    ended = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603 - our own
    took_s = time.monotonic() - began_s
    if ended.returncode != 0:
        raise DeviceFault(f"the bench's `calibrate all` has failed: {ended.stderr.strip()[-500:]}")
    return {"calibrate_all_s": round(took_s, 1), "calibrate_all_nodes": nodes * nodes}


def calibration_figures(folder: Path, *, nodes: int, views: int | None) -> Figures:
    """Calibrate from nothing as a job of a server; return seconds in real time, and errors checked."""
    options: JsonObject = {
        "wide": {"views": views},
        "mirrors": {"nodes": [nodes, nodes]},
        "activate": True,
    }
    with _served(folder, "--scene", CALIBRATION_SCENE) as server:
        session = server.send("POST", "/calibration_sessions", {"label": "bench"}).json()
        path = f"/calibration_sessions/{session['id']}"
        took_s = run_job(server, f"{path}/runs", {"step": "all", "options": options})
        check = server.send("GET", path).json()["check"]
    return {
        "calibrate_all_real_time_s": took_s,
        "calibrate_all_check_epipolar_rms_px": check["epipolar_rms_px"],
        "calibrate_all_check_pointing_rms_px": check["pointing_rms_px"],
    }


def run_job(server: ServerProcess, path: str, body: object = None) -> float:
    """Begin a job and return the seconds until it has succeeded."""
    began_s = time.monotonic()
    job_id = server.send("POST", path, body).json()["id"]
    while (took_s := time.monotonic() - began_s) < PATIENCE_S:
        job: dict[str, Any] = server.send("GET", f"/jobs/{job_id}").json()  # Any: a JSON document
        if job["state"] == "succeeded":
            return round(took_s, 2)
        if job["state"] in ("failed", "cancelled"):
            raise DeviceFault(f"the bench's job {path} has {job['state']}: {job.get('problem')}")
        time.sleep(POLL_S)
    raise Timeout(f"the bench's job {path} did not end within {PATIENCE_S:.0f} s")


def _served(folder: Path, *options: str) -> ServerProcess:
    folder.mkdir(parents=True)
    return ServerProcess(folder, port=free_port(), options=options)
