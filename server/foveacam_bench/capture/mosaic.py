"""Measure a mosaic of a raster at full resolution on the simulated rig, judged by the simulation's truth.

`seam_rms_px`: distance between the positions of one textured point in two overlapping views of the mosaic,
rms, fovea px; its position in the raw frames is the simulation's. Blank points, such as those of a white
margin, are counted apart (`seam_rms_px_with_blank` includes them): the standard deviation of the noise-free
image of the 64 px about them is below `BLANK_SHARE` of its mean. Points beside depth edges and occluded
points are included. `mosaic_depth_rel_rms`: fused depth against the true surface without cells beside a depth
edge (`..._with_edges` includes them), each error scaled to 10 m (it grows as Z, Sec. 4.1). `python -m
foveacam_bench.capture.mosaic` prints the figures; `--folder` keeps the dataset and the mosaic.
"""

import argparse
import json
import resource
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_bench.figures import Figures
from foveacam_bench.judging import rms
from foveacam_hardware.contract import FoveaError, Role
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.render.projection import Projection
from foveacam_hardware.sim.rig import open_simulated
from foveacam_hardware.sim.truth import Truth
from foveacam_pipeline.capture.dataset import (
    CapturedPoint,
    Dataset,
    DatasetHeader,
    DatasetWriter,
    PlanPosition,
    Shot,
)
from foveacam_pipeline.capture.mosaic.build import PlacedScan, build_mosaic
from foveacam_pipeline.capture.mosaic.chart import CELL, Chart
from foveacam_pipeline.capture.mosaic.correspondences import overlap_points
from foveacam_pipeline.capture.mosaic.views import MosaicView
from foveacam_pipeline.capture.plan import RasterPlan, fill_in_plan, plan_from, point_volts, points_of_plan
from foveacam_pipeline.models import Calibration, load_calibration
from foveacam_pipeline.stereo.values import DepthMesh
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.resources.studying.studies.click_truth import truth_of
from foveacam_web.glb import write_glb

Floats = NDArray[np.float64]
CERTIFICATE = SHIPPED / "sim-rig120.json"
SCENE = "bench"
WHOLE, QUICK_SIDE = 9, 3
"""Columns and rows: the paper's raster over the field that both mirrors reach, and a small one."""
STEP_DEG = (2.15, 1.65)
"""Step between views of the small one: a quarter of 2.86° x 2.15° overlaps."""
CENTRE_DEG = (0.0, 1.0)
DISTANCE_M = 4.0
REFERENCE_M = 10.0
EDGE_SHARE, EDGE_CELLS = 0.01, 5
"""A cell lies beside a depth edge where true depth varies by more per cell in a window of this many cells."""
WRONG_SHARE = 0.02
BLANK_PX, BLANK_SHARE = 64, 0.01
"""One grey level of a hundred: the sensor noise of one px."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JudgedMosaic:
    """Seam distances, px, and which are of blank points, (n,); depth errors scaled to 10 m, (m,)."""

    seams_px: Floats
    blank: NDArray[np.bool_]
    unadjusted_px: Floats
    one_depth_px: Floats
    depth_rel: Floats
    all_depth_rel: Floats
    known: float


def measure_mosaic(*, quick: bool = False) -> Figures:
    """Return the figures, measured in a separate process for its memory. `quick`: 3 x 3 points."""
    side = QUICK_SIDE if quick else WHOLE
    command = [sys.executable, "-m", __name__, "--side", str(side)]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603 - this module
    if ended.returncode != 0:
        raise FoveaError(f"the mosaic of {side} x {side} points ended early: {ended.stderr.strip()[-500:]}")
    found: Figures = json.loads(ended.stdout)
    return found


def mosaic_figures(folder: Path, *, side: int) -> Figures:
    """Capture side x side points into `folder`/raster, build the mosaic in `folder`/mosaic, judge it."""
    with open_simulated(SCENE, inline=True) as rig:
        calibration = load_calibration(CERTIFICATE)
        capture_s = capture_raster(rig, calibration, folder / "raster", plan_of(side, calibration))
        began_s, began_cpu_s = time.perf_counter(), time.process_time()
        mosaic = build_mosaic(Dataset.open(folder / "raster"), folder / "mosaic", mesh_file=glb_of)
        mosaic_s, cpu_s = time.perf_counter() - began_s, time.process_time() - began_cpu_s
        peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        judged = judge(mosaic.placed, truth_of(rig), calibration)
    built = mosaic.figures
    return {
        **mosaic_figures_of(judged),
        "mosaic_width": built.width,
        "mosaic_height": built.height,
        "mosaic_views": built.views,
        "mosaic_tiles": built.tiles,
        "mosaic_capture_s": round(capture_s, 1),
        "mosaic_s": round(mosaic_s, 1),
        "mosaic_cpu_s": round(cpu_s, 1),
        "mosaic_peak_rss_mb": round(peak_mb, 1),
        "mosaic_own": {"seams": asdict(built.seams), "depth": asdict(built.depth)},
    }


def plan_of(side: int, calibration: Calibration) -> RasterPlan:
    """Return the paper's raster, or a smaller one with the same steps, verged at `DISTANCE_M`."""
    verging = {"mode": "given", "distance_m": DISTANCE_M}
    if side == WHOLE:
        return fill_in_plan(plan_from({"verging": verging}), calibration)
    half_width_deg, half_height_deg = (step * (side - 1) / 2 for step in STEP_DEG)
    grid = {
        "kind": "grid",
        "columns": side,
        "rows": side,
        "centre_ax_deg": CENTRE_DEG[0],
        "centre_ay_deg": CENTRE_DEG[1],
        "half_width_deg": half_width_deg,
        "half_height_deg": half_height_deg,
    }
    return plan_from({"points": grid, "verging": verging})


def capture_raster(rig: Rig, calibration: Calibration, folder: Path, plan: RasterPlan) -> float:
    """Capture a raster; return how long it took, s."""
    began_s = time.perf_counter()
    rig.mirrors.enable()
    wanted = list(points_of_plan(plan))
    header = DatasetHeader(points=len(wanted), calibration=calibration, label="bench mosaic")
    with DatasetWriter.create(folder, header) as writer:
        for point in wanted:
            seen = rig.head.look(point_volts(point, calibration))
            place = PlanPosition(
                index=point.index,
                column=point.column,
                row=point.row,
                aim_rad=(point.ax_rad, point.ay_rad),
                distance_m=point.distance_m,
            )
            frames = (seen.left, seen.right, seen.wide)
            writer.add(CapturedPoint(place=place, shots=tuple(Shot(frame=frame) for frame in frames)))
        writer.finish()
    return time.perf_counter() - began_s


def glb_of(mesh: DepthMesh) -> bytes:
    """Return a mesh as a GLB file."""
    return write_glb(mesh, y_up=True)


def judge(laid: PlacedScan, truth: Truth, calibration: Calibration, *, eye: Role = Role.LEFT) -> JudgedMosaic:
    """Compare a mosaic with the simulation's truth."""
    chart, depth = laid.chart, laid.depth
    eye_rig_m = calibration.reference_rig_m(eye)
    t_ns = _frame_ns(laid.views[0], eye)
    true_z_m, textured = true_depth_m(truth, chart, eye_rig_m, t_ns)
    seams, blank = [], []
    for place in overlap_points(laid.views, chart):
        here = place.row, place.column
        if textured[here]:
            u = chart.u0_px + CELL * place.column + (CELL - 1) / 2
            v = chart.v0_px + CELL * place.row + (CELL - 1) / 2
            ray = np.array([u / chart.f_px, v / chart.f_px, 1.0])
            pair = [laid.views[k] for k in (place.first, place.second)]
            point_rig_m = eye_rig_m + float(true_z_m[here]) * ray
            per_depth = float(depth.filled[here])
            seams.append(seam_distances_px(pair, point_rig_m, truth, eye=eye, per_depth=per_depth))
            blank.append(contrast(truth, (u, v), chart.f_px, eye_rig_m, t_ns) < BLANK_SHARE)
    relative = depth.z_m / true_z_m - 1.0
    known = np.isfinite(relative)
    scaled = relative * REFERENCE_M / true_z_m
    seams_px, unadjusted_px, one_depth_px = np.array(seams).T
    return JudgedMosaic(
        seams_px=seams_px,
        blank=np.array(blank, dtype=np.bool_),
        unadjusted_px=unadjusted_px,
        one_depth_px=one_depth_px,
        depth_rel=scaled[known & ~beside_edges(true_z_m)],
        all_depth_rel=scaled[known],
        known=float((known & textured).sum() / max(1, int(textured.sum()))),
    )


def seam_distances_px(
    pair: Sequence[MosaicView], point_rig_m: Floats, truth: Truth, *, eye: Role, per_depth: float
) -> tuple[float, float, float]:
    """Return the distances of one point between two views: adjusted, unadjusted, at each view's own depth."""
    raw = [truth.projection(eye, _frame_ns(view, eye)).project(point_rig_m[None]) for view in pair]
    still = [view.look.with_adjustment(np.zeros(2), np.eye(2)) for view in pair]
    laid = [view.look.plane(px, per_depth) for view, px in zip(pair, raw, strict=True)]
    plain = [look.plane(px, per_depth) for look, px in zip(still, raw, strict=True)]
    flat = [look.plane(px, view.per_depth) for look, px, view in zip(still, raw, pair, strict=True)]
    adjusted, unadjusted, one_depth = (float(np.linalg.norm(b - a)) for a, b in (laid, plain, flat))
    return adjusted, unadjusted, one_depth


def mosaic_figures_of(judged: JudgedMosaic) -> Figures:
    """Return the figures of a mosaic."""
    own, shown = judged.depth_rel, ~judged.blank
    return {
        "seam_rms_px": rms(judged.seams_px[shown]),
        "seam_p95_px": float(np.quantile(judged.seams_px[shown], 0.95)),
        "seam_median_px": float(np.median(judged.seams_px[shown])),
        "seam_unadjusted_rms_px": rms(judged.unadjusted_px[shown]),
        "seam_one_depth_rms_px": rms(judged.one_depth_px[shown]),
        "seam_places": int(shown.sum()),
        "seam_rms_px_with_blank": rms(judged.seams_px),
        "seam_blank_places": int(judged.blank.sum()),
        "mosaic_depth_rel_rms": rms(own),
        "mosaic_depth_rel_median": float(np.median(own)),
        "mosaic_depth_wrong_share": float(np.mean(np.abs(own) > WRONG_SHARE)),
        "mosaic_depth_rel_rms_with_edges": rms(judged.all_depth_rel),
        "mosaic_depth_known_share": judged.known,
    }


def true_depth_m(
    truth: Truth, chart: Chart, eye_rig_m: Floats, t_ns: int
) -> tuple[Floats, NDArray[np.bool_]]:
    """Return (rows, columns) true depth of cells along z, m (NaN: background), and which show texture."""
    middle = (CELL - 1) / 2
    f_px = chart.f_px / CELL
    k = np.array(
        [
            [f_px, 0.0, -(chart.u0_px + middle) / CELL],
            [0.0, f_px, -(chart.v0_px + middle) / CELL],
            [0.0, 0.0, 1.0],
        ]
    )
    eye = Projection(M=k, C=eye_rig_m, width=chart.columns, height=chart.rows)
    drawn = truth.world.animated_scene.probe(eye, truth.world.scene_s(t_ns))
    numbers = [
        int(number) for number in np.unique(drawn.ids) if truth.world.animated_scene.textured(int(number))
    ]
    textured = np.isin(drawn.ids, numbers)
    return np.where(drawn.ids >= 0, drawn.depth_m.astype(np.float64), np.nan), textured


def contrast(truth: Truth, place_px: tuple[float, float], f_px: float, eye_rig_m: Floats, t_ns: int) -> float:
    """Return the noise-free contrast about a position of an eye's plane: standard deviation over mean."""
    u, v = place_px
    middle = BLANK_PX / 2
    k = np.array([[f_px, 0.0, middle - u], [0.0, f_px, middle - v], [0.0, 0.0, 1.0]])
    window = Projection(M=k, C=eye_rig_m, width=BLANK_PX, height=BLANK_PX)
    drawn = truth.world.animated_scene.probe(window, truth.world.scene_s(t_ns))
    grey = drawn.radiance.reshape(BLANK_PX, BLANK_PX, -1).mean(axis=2)
    return float(grey.std() / max(float(grey.mean()), 1e-6))


def beside_edges(z_m: Floats) -> NDArray[np.bool_]:
    """Return which cells lie beside a depth edge or the background."""
    kernel = np.ones((EDGE_CELLS, EDGE_CELLS), dtype=np.uint8)
    filled = np.where(np.isfinite(z_m), z_m, 1e3)
    ratio = cv2.dilate(filled, kernel) / cv2.erode(filled, kernel) - 1.0
    return np.asarray(ratio > EDGE_SHARE * EDGE_CELLS)


def _frame_ns(view: MosaicView, eye: Role) -> int:
    return view.point.frame(eye).t_ns


def main() -> None:
    """Print the figures of one mosaic."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--side", type=int, default=WHOLE, help="number of columns and of rows")
    parser.add_argument("--folder", type=Path, help="folder that keeps raster and mosaic")
    asked = parser.parse_args()
    with TemporaryDirectory() as scratch:
        figures = mosaic_figures(asked.folder or Path(scratch), side=asked.side)
    json.dump(figures, sys.stdout, indent=1)


if __name__ == "__main__":
    main()
