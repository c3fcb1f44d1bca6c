"""Measure a wide-baseline reference: scans from the paper's rail positions, judged by the simulation's truth.

`short_rel_rms`, `reference_rel_rms`: relative depth error of the same samples by the rig's own baseline and
by the reference; `ratio`: of the two, to be compared with `baseline_ratio`. `*_px`: the same as disparity
errors over the respective baseline. `reference_over_stated`: rms error over stated error. `python -m
foveacam_bench.capture.reference [FOLDER]` prints the figures; FOLDER keeps dataset and reference.
"""

import json
import math
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from foveacam_bench.figures import Figures
from foveacam_bench.judging import rms
from foveacam_hardware.contract import DeviceFault, Rail, Role
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.rig import open_simulated
from foveacam_hardware.sim.truth import Truth
from foveacam_hardware.sim.world import renderer_projection
from foveacam_pipeline.capture.dataset import (
    CapturedPoint,
    Dataset,
    DatasetHeader,
    DatasetPoint,
    DatasetWriter,
    PlanPosition,
    Shot,
)
from foveacam_pipeline.capture.reference import (
    ReferenceSettings,
    WideBaselineReference,
    build_reference,
    write_reference,
)
from foveacam_pipeline.capture.reference.values import ReferenceSample
from foveacam_pipeline.models import Calibration, load_calibration
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.resources.studying.studies.click_truth import truth_of

Floats = NDArray[np.float64]
CERTIFICATE = SHIPPED / "sim-rig120.json"
SCENE = "bench"
DISTANCE_M = 4.0
POLL_NS = 20_000_000
EDGE_SHARE = 0.003
"""A sample counts as at an edge if the true depths of the four px about it differ by a larger share."""
WRONG = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class RailRaster:
    """Directions and rail positions to capture; the last is judged: the simulation still has its state."""

    columns_deg: tuple[float, ...] = (-6.45, -4.3, -2.15, 0.0, 2.15, 4.3, 6.45)
    rows_deg: tuple[float, ...] = (0.2, 1.85)
    stops_m: tuple[float, ...] = (-0.3, -0.1, 0.1, 0.3, 0.0)
    across: int = 12


FULL = RailRaster()
QUICK = RailRaster(columns_deg=(0.0, 2.15, 4.3), rows_deg=(0.2,), stops_m=(-0.3, 0.3, 0.0), across=8)
"""A wall 8 m away, from three positions."""


def reference_figures(*, quick: bool = False, folder: Path | None = None) -> Figures:
    """Capture, triangulate, judge. `folder` keeps dataset and reference."""
    raster = QUICK if quick else FULL
    with TemporaryDirectory() as scratch, open_simulated(SCENE, inline=True) as rig:
        dataset_folder = Path(scratch) / "raster" if folder is None else folder
        capture_scans(rig, load_calibration(CERTIFICATE), dataset_folder, raster)
        dataset = Dataset.open(dataset_folder)
        began_s = time.process_time()
        settings = ReferenceSettings(scan=len(raster.stops_m) - 1, across=raster.across)
        reference = build_reference(dataset, settings)
        took_s = time.process_time() - began_s
        write_reference(dataset_folder, reference)
        true_m = true_depths_m(truth_of(rig), dataset, reference.rows)
        return {**judge_reference(reference, true_m), "reference_cpu_s": round(took_s, 1)}


def capture_scans(rig: Rig, calibration: Calibration, folder: Path, raster: RailRaster) -> None:
    """Capture a scan at every rail position."""
    rig.mirrors.enable()
    rail = _rail(rig)
    rail.home()
    _wait_for_rail(rig, rail)
    aims = [(column, row) for row in raster.rows_deg for column in raster.columns_deg]
    header = DatasetHeader(
        points=len(aims) * len(raster.stops_m), calibration=calibration, label="bench reference"
    )
    with DatasetWriter.create(folder, header) as writer:
        for scan, stop_m in enumerate(raster.stops_m):
            rail.move_to(stop_m)
            _wait_for_rail(rig, rail)
            for index, aim_deg in enumerate(aims, start=scan * len(aims)):
                writer.add(_capture_point(rig, calibration, aim_deg, index=index, scan=scan, rail_m=stop_m))
        writer.finish()


def true_depths_m(truth: Truth, dataset: Dataset, rows: Sequence[ReferenceSample]) -> Floats:
    """Return (n,) true depth along z at the samples' left px; NaN at edges."""
    true_m = np.full(len(rows), np.nan)
    for point in dataset:
        here = [number for number, row in enumerate(rows) if row.point == point.index]
        if here:
            places = np.array([(rows[number].x_px, rows[number].y_px) for number in here])
            true_m[here] = _true_m(truth, point, places)
    return true_m


def judge_reference(reference: WideBaselineReference, true_m: Floats) -> Figures:
    """Return the figures of a reference against the truth of its samples."""
    names = ("short_m", "reference_m", "sigma_m", "baseline_m")
    short, found, sigma, longest = (
        np.array([getattr(row, name) for row in reference.rows]) for name in names
    )
    figures = reference.figures
    wrong = np.abs(short / true_m - 1.0) > WRONG
    known = np.isfinite(true_m) & ~wrong
    short, found, sigma, longest, z = (each[known] for each in (short, found, sigma, longest, true_m))
    short_rel, reference_rel = rms(short / z - 1.0), rms(found / z - 1.0)
    return {
        "samples": figures.samples,
        "referenced": figures.referenced,
        "judged": len(z),
        "short_wrong": float(wrong.mean()),
        "nearest_m": float(z.min()),
        "farthest_m": float(z.max()),
        "short_rel_rms": short_rel,
        "short_rel_bias": float(np.median(short / z - 1.0)),
        "reference_rel_rms": reference_rel,
        "reference_rel_bias": float(np.median(found / z - 1.0)),
        "ratio": short_rel / reference_rel,
        "baseline_ratio": figures.baseline_m / figures.short_baseline_m,
        "short_px": rms(figures.short_baseline_m * reference.f_px * (1.0 / short - 1.0 / z)),
        "reference_px": rms(longest * reference.f_px * (1.0 / found - 1.0 / z)),
        "reference_over_stated": rms((found - z) / sigma),
        "short_off_reference_rel_rms": figures.comparison.rms_rel,
        "residual_px": figures.residual_px,
        "outliers": figures.outliers,
        "stops_m": [stop.place_m for stop in figures.stops],
    }


def _capture_point(
    rig: Rig, calibration: Calibration, aim_deg: tuple[float, float], *, index: int, scan: int, rail_m: float
) -> CapturedPoint:
    aim_rad = math.radians(aim_deg[0]), math.radians(aim_deg[1])
    seen = rig.head.look(calibration.steer(*aim_rad, distance_m=DISTANCE_M))
    place = PlanPosition(index=index, scan=scan, aim_rad=aim_rad, distance_m=DISTANCE_M, rail_m=rail_m)
    return CapturedPoint(place=place, shots=tuple(Shot(frame=frame) for frame in (seen.left, seen.right)))


def _true_m(truth: Truth, point: DatasetPoint, places_px: Floats) -> Floats:
    """Return (n,) true depth at sub-pixel positions (n, 2) of a left fovea, by interpolation."""
    frame = point.frame(Role.LEFT)
    volts = point.pose.volts
    if volts is None:
        return np.full(len(places_px), np.nan)
    eye = renderer_projection(truth.static_projection(Role.LEFT, volts.left, t_ns=frame.t_ns))
    per_depth = 1.0 / truth.world.animated_scene.probe(eye, truth.world.scene_s(frame.t_ns)).depth_m.astype(
        np.float64
    )
    x, y = np.floor(places_px).astype(int).T
    right, down = (places_px - np.floor(places_px)).T
    four = np.array([per_depth[y + j, x + i] for j in (0, 1) for i in (0, 1)])
    weight = np.array([(1 - down) * (1 - right), (1 - down) * right, down * (1 - right), down * right])
    z = eye.points(places_px, 1.0 / np.sum(weight * four, axis=0))[:, 2]
    return np.where(four.max(axis=0) / four.min(axis=0) - 1.0 < EDGE_SHARE, z, np.nan)


def _rail(rig: Rig) -> Rail:
    if rig.rail is None:
        raise DeviceFault(f"rig {rig.rig_id} has no rail; measure a simulated rig with one")
    return rig.rail


def _wait_for_rail(rig: Rig, rail: Rail) -> None:
    while rail.state.moving:
        rig.clock.sleep_until_ns(rig.clock.now_ns() + POLL_NS)


if __name__ == "__main__":
    kept_in = Path(sys.argv[1]) if len(sys.argv) > 1 else None
    json.dump(reference_figures(folder=kept_in), sys.stdout, indent=1)
