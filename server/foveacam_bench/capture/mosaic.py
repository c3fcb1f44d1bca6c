"""Measure a mosaic of a raster at full resolution on the simulated rig, judged by the simulation's truth.

`seam_rms_px`: distance between the positions of one textured point in two overlapping views of the mosaic,
rms, fovea px; its position in the raw frames is the simulation's. Blank points are counted apart (with them:
`seam_rms_px_with_blank`): the white margin of a chessboard looks the same everywhere. A point is blank where
the noise-free image of the 64 px about it, from the eye's reference point, spreads by less than `BLANK_SHARE`
of its mean. Nothing is left out for lying beside a jump of depth or being hidden from a view.
`mosaic_depth_rel_rms`: fused depth against the true surface, cells beside a jump of depth left out (with
them: `..._with_edges`), each error carried to 10 m (it grows as Z, Sec. 4.1). `python -m
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

from foveacam_bench.calibration.procedures import truth_of
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
from foveacam_server.resources.calibrations.service import SHIPPED
from foveacam_web.glb import write_glb

Floats = NDArray[np.float64]
CERTIFICATE = SHIPPED / "sim-rig120.json"
SCENE = "bench"
WHOLE, QUICK_SIDE = 9, 3
"""Points across and down: the paper's raster over the field that both mirrors reach, and a small one."""
STEP_DEG = (2.15, 1.65)
"""From view to view of a smaller one: a quarter of the 2.86° x 2.15° overlaps."""
CENTRE_DEG = (0.0, 1.0)
DISTANCE_M = 4.0
REFERENCE_M = 10.0
EDGE_SHARE, EDGE_CELLS = 0.01, 5
"""A cell about which true depth differs by more a cell, in a window so wide, lies beside a jump."""
WRONG_SHARE = 0.02
BLANK_PX, BLANK_SHARE = 64, 0.01
"""One grey level of a hundred: what the sensor's noise makes of a single px."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JudgedMosaic:
    """Distances of seams, px, and which are of blank places, (n,); errors of depth carried to 10 m, (m,)."""

    seams_px: Floats
    blank: NDArray[np.bool_]
    unadjusted_px: Floats
    one_depth_px: Floats
    depth_rel: Floats
    all_depth_rel: Floats
    known: float


def measure_mosaic(*, quick: bool = False) -> dict[str, object]:
    """Return the figures, taken in a process of its own: its memory is one of them. `quick`: 3 x 3 points."""
    side = QUICK_SIDE if quick else WHOLE
    words = [sys.executable, "-m", __name__, "--side", str(side)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)  # noqa: S603 - this very module
    if done.returncode != 0:
        raise FoveaError(f"the mosaic of {side} x {side} points ended early: {done.stderr.strip()[-500:]}")
    found: dict[str, object] = json.loads(done.stdout)
    return found


def mosaic_figures(folder: Path, *, side: int) -> dict[str, object]:
    """Capture side x side points into `folder`/raster, lay them out in `folder`/mosaic, judge."""
    with open_simulated(SCENE, inline=True) as rig:
        calibration = load_calibration(CERTIFICATE)
        capture_s = captured(rig, calibration, folder / "raster", plan_of(side, calibration))
        began_s, began_cpu_s = time.perf_counter(), time.process_time()
        mosaic = build_mosaic(Dataset.open(folder / "raster"), folder / "mosaic", mesh_file=glb_of)
        mosaic_s, cpu_s = time.perf_counter() - began_s, time.process_time() - began_cpu_s
        peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        judged = judge(mosaic.placed, truth_of(rig), calibration)
    made = mosaic.figures
    return {
        **figures_of(judged),
        "mosaic_width": made.width,
        "mosaic_height": made.height,
        "mosaic_views": made.views,
        "mosaic_tiles": made.tiles,
        "mosaic_capture_s": round(capture_s, 1),
        "mosaic_s": round(mosaic_s, 1),
        "mosaic_cpu_s": round(cpu_s, 1),
        "mosaic_peak_rss_mb": round(peak_mb, 1),
        "mosaic_own": {"seams": asdict(made.seams), "depth": asdict(made.depth)},
    }


def plan_of(side: int, calibration: Calibration) -> RasterPlan:
    """Return the paper's raster, or a smaller one whose views lie as close, verged at `DISTANCE_M`."""
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


def captured(rig: Rig, calibration: Calibration, folder: Path, plan: RasterPlan) -> float:
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
    """Return a mesh as an exported file."""
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
            thing = eye_rig_m + float(true_z_m[here]) * ray
            seams.append(offset_px(pair, thing, truth, eye=eye, per_depth=float(depth.filled[here])))
            blank.append(spread(truth, (u, v), chart.f_px, eye_rig_m, t_ns) < BLANK_SHARE)
    relative = depth.z_m / true_z_m - 1.0
    known = np.isfinite(relative)
    carried = relative * REFERENCE_M / true_z_m
    seams_px, unadjusted_px, one_depth_px = np.array(seams).T
    return JudgedMosaic(
        seams_px=seams_px,
        blank=np.array(blank, dtype=np.bool_),
        unadjusted_px=unadjusted_px,
        one_depth_px=one_depth_px,
        depth_rel=carried[known & ~beside_jumps(true_z_m)],
        all_depth_rel=carried[known],
        known=float((known & textured).sum() / max(1, int(textured.sum()))),
    )


def offset_px(
    pair: Sequence[MosaicView], thing_rig_m: Floats, truth: Truth, *, eye: Role, per_depth: float
) -> tuple[float, float, float]:
    """Return the distances of one point in two views: adjusted, unadjusted, and at the pairs' depths."""
    raw = [truth.projection(eye, _frame_ns(view, eye)).project(thing_rig_m[None]) for view in pair]
    still = [view.look.with_adjustment(np.zeros(2), np.eye(2)) for view in pair]
    laid = [view.look.plane(px, per_depth) for view, px in zip(pair, raw, strict=True)]
    plain = [look.plane(px, per_depth) for look, px in zip(still, raw, strict=True)]
    flat = [look.plane(px, view.per_depth) for look, px, view in zip(still, raw, pair, strict=True)]
    as_laid, unadjusted, one_depth = (float(np.linalg.norm(b - a)) for a, b in (laid, plain, flat))
    return as_laid, unadjusted, one_depth


def figures_of(judged: JudgedMosaic) -> dict[str, object]:
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
    """Return (rows, columns) true depth along z of cells, m (NaN: nothing), and which show texture."""
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


def spread(truth: Truth, place_px: tuple[float, float], f_px: float, eye_rig_m: Floats, t_ns: int) -> float:
    """Return by how much brightness spreads about a place of an eye's plane, without noise, over its mean."""
    u, v = place_px
    middle = BLANK_PX / 2
    k = np.array([[f_px, 0.0, middle - u], [0.0, f_px, middle - v], [0.0, 0.0, 1.0]])
    window = Projection(M=k, C=eye_rig_m, width=BLANK_PX, height=BLANK_PX)
    drawn = truth.world.animated_scene.probe(window, truth.world.scene_s(t_ns))
    grey = drawn.radiance.reshape(BLANK_PX, BLANK_PX, -1).mean(axis=2)
    return float(grey.std() / max(float(grey.mean()), 1e-6))


def beside_jumps(z_m: Floats) -> NDArray[np.bool_]:
    """Return which cells have another depth beside them, or nothing."""
    kernel = np.ones((EDGE_CELLS, EDGE_CELLS), dtype=np.uint8)
    filled = np.where(np.isfinite(z_m), z_m, 1e3)
    spread = cv2.dilate(filled, kernel) / cv2.erode(filled, kernel) - 1.0
    return np.asarray(spread > EDGE_SHARE * EDGE_CELLS)


def rms(values: Floats) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def _frame_ns(view: MosaicView, eye: Role) -> int:
    return view.point.frame(eye).t_ns


def main() -> None:
    """Print the figures of one mosaic."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--side", type=int, default=WHOLE, help="points across and down")
    parser.add_argument("--folder", type=Path, help="where raster and mosaic shall stay")
    asked = parser.parse_args()
    with TemporaryDirectory() as scratch:
        figures = mosaic_figures(asked.folder or Path(scratch), side=asked.side)
    json.dump(figures, sys.stdout, indent=1)


if __name__ == "__main__":
    main()
