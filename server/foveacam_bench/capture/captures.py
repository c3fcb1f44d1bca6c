"""Measure captures: time against the physical limit, writing, memory, SIGKILL, recordings, a mosaic.

Cameras and mirrors are stubs without computing time, images are full size, the clock is real. Time is
measured on a file system in memory where there is one, writing on the disk of temporary files. The mosaic is
made on the simulated rig (`mosaic.py`).
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from foveacam_bench.capture.dataset_kills import KillPlan, kill_figures
from foveacam_bench.capture.mosaic import measure_mosaic
from foveacam_bench.capture.recording import measure_recording
from foveacam_bench.capture.stub_rig import MOST_HZ, StubRig
from foveacam_bench.figures import Figures
from foveacam_bench.judging import peak_memory_kib
from foveacam_hardware.contract import FoveaError, Frame, MirrorVolts, MonotonicClock, Role
from foveacam_hardware.sim.presets import RIG120
from foveacam_pipeline.capture.dataset import (
    CapturedPoint,
    DatasetHeader,
    DatasetWriter,
    ImageCodec,
    PlanPosition,
    Shot,
)
from foveacam_pipeline.capture.dataset.images import encode
from foveacam_pipeline.capture.plan import RasterPlan, plan_from
from foveacam_pipeline.capture.run import CaptureReport, run_capture
from foveacam_pipeline.models import load_calibration
from foveacam_pipeline.storage.disk import sync_folder
from foveacam_server.datasets.capture_tools import rig_facts
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.resources.capturing.captures.begin import CaptureSpec, begin_dataset

EXPOSURE_NS = 5_000_000
FEW_POINTS, MANY_SCANS = (3, 3), 5
"""Memory is compared between 9 points and 5 scans of 81."""
WRITE_POINTS, WRITE_ROUNDS = 27, 5
PACE_ROUNDS = 3
MEMORY = Path("/dev/shm")  # noqa: S108 - the rig is timed, not the disk


class SilentCaptureWatcher:
    """A capture watcher that ignores every report."""

    def progress(self, report: CaptureReport) -> None:
        """Ignore it."""

    def cancelled(self) -> bool:
        """Go on."""
        return False

    def paused(self) -> bool:
        """Go on."""
        return False

    def ask_operator(self, request: str) -> None:
        """Do nothing: this rail moves itself."""

    def show_frames(self, frames: tuple[Frame, ...]) -> None:
        """Ignore it."""


def run(*, quick: bool = False) -> Figures:
    """Measure; `quick`: 20 kills, one round of each, one scan, short recordings, a small mosaic."""
    load_before = os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        (folder / "kills").mkdir()
        figures = {
            **pace_figures(rounds=1 if quick else PACE_ROUNDS),
            **write_figures(folder, rounds=1 if quick else WRITE_ROUNDS),
            **memory_figures(folder, scans=1 if quick else MANY_SCANS),
            **kill_figures(folder / "kills", KillPlan(kills=20 if quick else 200)),
            **measure_recording(quick=quick),
            **measure_mosaic(quick=quick),
        }
    return {**figures, "load_1min_before": round(load_before, 2)}


def pace_figures(*, rounds: int) -> Figures:
    """Return the time of 81 points over the physical limit, median and worst of `rounds`."""
    ratios, seconds = [], []
    limit_s = 0.0
    for _ in range(rounds):
        with tempfile.TemporaryDirectory(dir=MEMORY if MEMORY.is_dir() else None) as scratch:
            took_s, limit_s = capture_plan(Path(scratch) / "pace", paper_plan())
        seconds.append(took_s)
        ratios.append(took_s / limit_s)
    return {
        "time_over_limit": round(float(np.median(ratios)), 3),
        "time_over_limit_worst": round(max(ratios), 3),
        "capture_s": round(float(np.median(seconds)), 3),
        "limit_s": round(limit_s, 3),
    }


def capture_plan(folder: Path, plan: RasterPlan) -> tuple[float, float]:
    """Capture a plan with the stub rig; return the time it took and the physical limit, s."""
    calibration = load_calibration(SHIPPED / "sim-rig120.json")
    rig = StubRig(
        MonotonicClock(),
        rig_id=calibration.rig_id,
        settle_us=RIG120.settle_us,
        exposure_ns=EXPOSURE_NS,
        wide_hz=MOST_HZ,
    )
    with begin_dataset(
        rig, folder, CaptureSpec(plan=plan), calibration, watch=SilentCaptureWatcher()
    ) as writer:
        begin_s = time.perf_counter()
        run_capture(rig, writer, watch=SilentCaptureWatcher())
        took_s = time.perf_counter() - begin_s
    return took_s, rig_facts(rig).estimate(plan, calibration, codec=ImageCodec.TIFF).limit_s


def write_figures(folder: Path, *, rounds: int) -> Figures:
    """Return MB/s of the dataset writer, and of a bare loop with the same encoder and the same syncs."""
    points = list(_points())
    size_mb = sum(shot.frame.image.nbytes for point in points for shot in point.shots) / 1e6
    ours, bare = [], []
    for turn in range(rounds):
        ours.append(size_mb / _writer_s(folder / f"ours-{turn}", points))
        bare.append(size_mb / _bare_loop_s(folder / f"bare-{turn}", points))
    return {
        "write_ratio": round(float(np.median([a / b for a, b in zip(ours, bare, strict=True)])), 3),
        "write_mb_per_s": round(float(np.median(ours)), 1),
        "bare_mb_per_s": round(float(np.median(bare)), 1),
    }


def memory_figures(folder: Path, *, scans: int) -> Figures:
    """Return the growth of a process' memory from 9 points to many, each measured in its own process."""
    few = _peak_mb(folder / "few", FEW_POINTS, scans=1)
    many = _peak_mb(folder / "many", (9, 9), scans=scans)
    return {
        "rss_growth_mb": round(many - few, 1),
        "rss_few_mb": round(few, 1),
        "rss_points": 81 * scans,
    }


def paper_plan(columns: int = 9, rows: int = 9) -> RasterPlan:
    """Return the paper's raster with every setting given."""
    return plan_from(
        {
            "points": {
                "kind": "grid",
                "columns": columns,
                "rows": rows,
                "half_width_deg": 7.0,
                "half_height_deg": 7.0,
            },
            "verging": {"mode": "given", "distance_m": 4.0},
        }
    )


def _points() -> Iterator[CapturedPoint]:
    """Yield points with fovea-like pictures: noise of a few grey levels over a gradient."""
    rng = np.random.default_rng(5)
    slope = np.add.outer(np.arange(1080) // 16, np.arange(1440) // 12).astype(np.uint8)
    images = [slope + rng.integers(0, 12, slope.shape, dtype=np.uint8) for _ in range(6)]
    for index in range(WRITE_POINTS):
        shots = []
        for number, role in enumerate(Role):
            volts = None if role is Role.WIDE else MirrorVolts(x_v=float(index), y_v=0.5)
            frame = Frame(
                image=images[(index + number) % len(images)],
                role=role,
                seq=index,
                t_ns=index,
                exposure_ns=EXPOSURE_NS,
                volts=volts,
            )
            shots.append(Shot(frame=frame))
        yield CapturedPoint(place=PlanPosition(index=index, column=index, row=0), shots=tuple(shots))


def _writer_s(folder: Path, points: list[CapturedPoint]) -> float:
    with DatasetWriter.create(folder, DatasetHeader(points=len(points), codec=ImageCodec.PNG)) as writer:
        begin_s = time.perf_counter()
        for point in points:
            writer.add(point)
        writer.flush()
        took_s = time.perf_counter() - begin_s
        writer.finish()
    return took_s


def _bare_loop_s(folder: Path, points: list[CapturedPoint]) -> float:
    """Encode and write in sequence; sync every file, and a folder and an index line for each point."""
    folder.mkdir()
    begin_s = time.perf_counter()
    with (folder / "lines").open("ab", buffering=0) as lines:
        for point in points:
            for shot in point.shots:
                path = folder / f"{point.place.index}-{shot.frame.role}.png"
                with path.open("wb", buffering=0) as file:
                    file.write(encode(shot.frame.image, ImageCodec.PNG))
                    os.fsync(file.fileno())
            sync_folder(folder)
            lines.write(f"{point.place.index}\n".encode())
            os.fsync(lines.fileno())
    return time.perf_counter() - begin_s


def _peak_mb(folder: Path, size: tuple[int, int], *, scans: int) -> float:
    """Return the peak resident memory of a process that writes such a capture, MiB."""
    command = [sys.executable, "-m", __name__, str(folder), *map(str, size), str(scans)]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603 - this module
    if ended.returncode != 0:
        raise FoveaError(f"a capture of {size} ended early: {ended.stderr.strip()[-500:]}; run it again")
    return float(json.loads(ended.stdout)["peak_mb"])


def main() -> None:
    """Write a dataset of `scans` scans and print the peak resident memory, MiB."""
    folder, columns, rows, scans = Path(sys.argv[1]), *map(int, sys.argv[2:5])
    plan = paper_plan(columns, rows * scans)
    folder.mkdir(parents=True)
    capture_plan(folder / "dataset", plan)
    sys.stdout.write(json.dumps({"peak_mb": peak_memory_kib() / 1024}) + "\n")


if __name__ == "__main__":
    main()
