"""Measure the cost of depth over bare OpenCV, and its accuracy on a real pair and on rendered looks.

`overhead_ratio`: CPU time of rectify + match + depth map, errors included, of looks at the simulated bench,
minus and over that of one call of OpenCV's matcher on the same images, 128 px about the verged depth
(left-right check included); medians of alternating runs, one thread; of frames at binning 1 (`_full`) and 2
(`_binned`), both at 720 x 540 px. `stages_ms`: time of each stage. `density`, `epe_px`, `bad1`: on the
Motorcycle pair (Middlebury 2014, in scikit-image): share of pixels with ground truth that have a disparity,
their mean error, and the share of them with an error above 1 px. The `rendered_` figures compare the looks
with the renderer's exact depth.
"""

import numpy as np
from numpy.typing import NDArray

from foveacam_bench.depth.stages import overhead_figures
from foveacam_bench.figures import Figures
from foveacam_hardware.contract import Binning, InvalidInput, Role, Sighting, install_command
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.models import Calibration, load_calibration
from foveacam_pipeline.stereo.match import match
from foveacam_pipeline.stereo.rectify import plane_from_raw, rectify
from foveacam_pipeline.stereo.search import MatchSettings
from foveacam_pipeline.stereo.values import RectifiedPair
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.resources.studying.studies.click_truth import truth_of
from foveacam_server.resources.studying.studies.simulated_rigs import bin_cameras

CERTIFICATE = SHIPPED / "sim-rig120.json"
MOTORCYCLE_F_PX = 994.978  # its published calibration at quarter size
MOTORCYCLE_BASELINE_M = 0.193001
MOTORCYCLE_DOFFS_PX = 31.086
MOTORCYCLE_RANGE_PX = (7.0, 60.0)
LOOKS: tuple[tuple[float, float, float], ...] = (
    (1.6, 2.9, 2.7),
    (4.6, -2.0, 8.0),
    (2.5, 5.0, 1.9),
    (7.0, 1.0, 2.7),
)
"""(ax_deg, ay_deg, distance_m) of the rendered looks. The first sees no texture, the last only texture."""
BINNINGS: dict[str, Binning] = {"full": 1, "binned": 2}
RUNS, QUICK_RUNS = 15, 5


def run(*, quick: bool = False) -> Figures:
    """Measure, and return the figures."""
    calibration = load_calibration(CERTIFICATE)
    looks, rendered = {}, {}
    for name, binning in BINNINGS.items():
        with open_simulated(scene="bench", inline=True) as rig:
            bin_cameras(rig, binning)
            looks[name] = [_look(rig, calibration, look) for look in LOOKS[-1 if quick else 0 :]]
            rendered[name] = _rendered(rig, calibration, looks[name])
    found = overhead_figures(looks, calibration, runs=QUICK_RUNS if quick else RUNS)
    found |= motorcycle_figures()
    found |= rendered["full"]
    found |= {f"{key}_binned": value for key, value in rendered["binned"].items()}
    return found


def _look(rig: Rig, calibration: Calibration, look: tuple[float, float, float]) -> Sighting:
    ax_rad, ay_rad = np.deg2rad(look[:2]).tolist()
    return rig.head.look(calibration.steer(ax_rad, ay_rad, distance_m=look[2]))


def _published_pair() -> tuple[NDArray[np.uint8], NDArray[np.uint8], NDArray[np.float32]]:
    """Return left picture, right picture and left disparities, px, as scikit-image provides them."""
    try:
        from skimage.data import stereo_motorcycle
    except ImportError as error:
        raise InvalidInput(
            f"bench stereo needs scikit-image, which carries the real pair; {install_command('dev')}"
        ) from error
    left, right, truth_px = stereo_motorcycle()  # type: ignore[no-untyped-call]  # it ships no types
    return left, right, truth_px


def motorcycle() -> tuple[RectifiedPair, NDArray[np.float32]]:
    """Return the pair, and its disparities, px; NaN or infinite where there is no ground truth."""
    left, right, truth_px = _published_pair()
    height, width = left.shape[:2]
    seen = np.ones((height, width), dtype=np.bool_)
    pair = RectifiedPair(
        left=left,
        right=right,
        valid_left=seen,
        valid_right=seen,
        f_px=MOTORCYCLE_F_PX,
        baseline_m=MOTORCYCLE_BASELINE_M,
        u0_left_px=0.0,
        u0_right_px=-MOTORCYCLE_DOFFS_PX,
        v0_px=0.0,
        pose_sigma_px=0.0,
        t_ns=0,
    )
    return pair, truth_px


def motorcycle_figures() -> dict[str, float]:
    """Return the figures of the Motorcycle pair."""
    pair, truth_px = motorcycle()
    low_px, high_px = MOTORCYCLE_RANGE_PX
    f_b = pair.f_px * pair.baseline_m
    settings = MatchSettings(near_m=f_b / (high_px + pair.offset_px), far_m=f_b / (low_px + pair.offset_px))
    disparity = match(pair, settings)
    known = np.isfinite(truth_px)
    answered = known & np.isfinite(disparity.residual_px)
    error_px = np.abs(disparity.residual_px - truth_px)[answered]
    return {
        "density": float(answered.sum() / known.sum()),
        "epe_px": float(error_px.mean()),
        "bad1": float((error_px > 1.0).mean()),
        "median_error_px": float(np.median(error_px)),
    }


def _rendered(rig: Rig, calibration: Calibration, sightings: list[Sighting]) -> dict[str, float]:
    """Compare depth maps with the exact depth of the left eye's pixels, on surfaces that both eyes see."""
    errors_px, sigmas_px, answered, asked = [], [], 0, 0
    for sighting in sightings:
        pair = rectify(sighting, calibration)
        disparity = match(pair)
        residual_px, seen = true_residual_px(rig, calibration, sighting, pair)
        within = seen & (np.abs(residual_px) < 48.0)
        known = within & np.isfinite(disparity.residual_px)
        pose_error_px = np.median((disparity.residual_px - residual_px)[known])
        errors_px.append((disparity.residual_px - residual_px - pose_error_px)[known])
        sigmas_px.append(disparity.sigma_px[known])
        answered, asked = answered + int(known.sum()), asked + int(within.sum())
    error_px, sigma_px = np.concatenate(errors_px), np.concatenate(sigmas_px)
    return {
        "rendered_density": answered / asked,
        "rendered_median_error_px": float(np.median(np.abs(error_px))),
        "rendered_bad1": float((np.abs(error_px) > 1.0).mean()),
        "rendered_within_3_sigma_fraction": float((np.abs(error_px) <= 3.0 * sigma_px).mean()),
    }


def true_residual_px(
    rig: Rig, calibration: Calibration, sighting: Sighting, pair: RectifiedPair
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return each left pixel's true residual disparity, (h, w), and where the left eye sees a surface."""
    truth = truth_of(rig)
    projection = truth.projection(Role.LEFT, sighting.left.t_ns)
    drawn = truth.world.animated_scene.probe(projection, truth.world.scene_s(sighting.left.t_ns))
    height, width = pair.left.shape[:2]
    rows, columns = np.indices((height, width))
    scale = pair.f_px / calibration.fovea_f_px
    window = np.stack([columns + pair.u0_left_px, rows + pair.v0_px], axis=-1).reshape(-1, 2) / scale
    z_m = pair.verged_z_m
    to_raw = np.linalg.inv(plane_from_raw(calibration, Role.LEFT, sighting.volts, depth_m=z_m))
    raw = np.column_stack([window, np.ones(len(window))]) @ to_raw.T
    raw = np.rint(raw[:, :2] / raw[:, 2:]).astype(np.intp)
    inside = (raw >= 0).all(axis=1) & (raw < (projection.width, projection.height)).all(axis=1)
    raw[~inside] = 0
    hit = inside & (drawn.ids[raw[:, 1], raw[:, 0]] >= 0)
    points = projection.points(
        raw, np.where(hit, drawn.depth_m[raw[:, 1], raw[:, 0]], 1.0).astype(np.float64)
    )
    with np.errstate(divide="ignore"):
        residual_px = pair.f_px * pair.baseline_m / points[:, 2] - pair.offset_px
    seen = hit.reshape(height, width) & pair.valid_left
    return residual_px.reshape(height, width), seen
