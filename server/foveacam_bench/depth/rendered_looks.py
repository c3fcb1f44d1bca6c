"""Rendered looks about 10 m away with the true disparity of every pixel, for `bench depth`.

The looks are at seeded random textured points of both simulated scenes, verged with the shipped calibration.
The error model of dense matching was fitted on looks drawn with another seed.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_bench.depth.stereo import true_residual_px
from foveacam_bench.verge.fixations import CERTIFICATE, SCENES
from foveacam_hardware.contract import Binning, OutOfRange, Role
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.rig import open_simulated
from foveacam_hardware.sim.truth import Truth
from foveacam_pipeline.models import Calibration, load_calibration
from foveacam_pipeline.stereo.rectify import rectify
from foveacam_pipeline.stereo.values import RectifiedPair
from foveacam_server.resources.studying.studies.click_truth import ClickKind, classify_click, truth_of
from foveacam_server.resources.studying.studies.judged_clicks import BORDER_PX
from foveacam_server.resources.studying.studies.simulated_rigs import bin_cameras

NEAREST_M, FARTHEST_M = 7.0, 13.0
HIDDEN_PX = 1.0
"""A pixel is occluded in the right eye by a surface that is nearer by more disparity."""
SEED = 20_31


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RenderedLook:
    """A rectified look and its truth; `truth_px`: (h, w) residual disparity, NaN where no surface is seen.

    `judged`: (h, w), true where both eyes see the surface and its distance is in the requested range.
    """

    scene: str
    pair: RectifiedPair
    truth_px: NDArray[np.float64]
    judged: NDArray[np.bool_]


def true_looks(
    count: int,
    *,
    seed: int = SEED,
    nearest_m: float = NEAREST_M,
    farthest_m: float = FARTHEST_M,
    binning: Binning = 1,
) -> Iterator[RenderedLook]:
    """Yield `count` looks of each scene, at points between both distances."""
    for scene in SCENES:
        rng = np.random.default_rng([seed, *scene.encode()])
        with open_simulated(scene=scene, inline=True) as rig:
            bin_cameras(rig, binning)
            calibration = load_calibration(CERTIFICATE)
            looks = (_look(rig, calibration, scene, rng, (nearest_m, farthest_m)) for _ in range(400 * count))
            yield from (look for look, _ in zip((one for one in looks if one), range(count), strict=False))


def _look(
    rig: Rig, calibration: Calibration, scene: str, rng: np.random.Generator, between_m: tuple[float, float]
) -> RenderedLook | None:
    """Return a look at a random point; None if it is not textured, not in reach or not `between_m`."""
    truth = truth_of(rig)
    size = np.array([calibration.wide.width, calibration.wide.height])
    x_px, y_px = rng.uniform(BORDER_PX, size - BORDER_PX).tolist()
    click = classify_click(truth, calibration, scene=scene, pixel=(x_px, y_px), t_ns=rig.clock.now_ns())
    nearest_m, farthest_m = between_m
    if click is None or click.kind is not ClickKind.TEXTURED or not nearest_m <= click.range_m <= farthest_m:
        return None
    x_m, y_m, z_m = click.point_rig_m
    try:
        volts = calibration.steer(
            float(np.arctan2(x_m, z_m)), float(np.arctan2(y_m, z_m)), distance_m=click.range_m
        )
    except OutOfRange:
        return None
    sighting = rig.head.look(volts)
    pair = rectify(sighting, calibration)
    truth_px, seen = true_residual_px(rig, calibration, sighting, pair)
    truth_px[~seen] = np.nan
    true_z_m = pair.f_px * pair.baseline_m / (truth_px + pair.offset_px)
    distant = (true_z_m >= nearest_m) & (true_z_m <= farthest_m)
    both = seen & _seen_by_right(truth, pair, truth_px, t_ns=sighting.right.t_ns)
    return RenderedLook(scene=scene, pair=pair, truth_px=truth_px, judged=both & distant)


def _seen_by_right(
    truth: Truth, pair: RectifiedPair, truth_px: NDArray[np.float64], *, t_ns: int
) -> NDArray[np.bool_]:
    """Return (h, w) whether the right eye sees the surface of each left pixel."""
    view = truth.projection(Role.RIGHT, t_ns)
    drawn = truth.world.animated_scene.probe(view, truth.world.scene_s(t_ns))
    rows, columns = np.indices(truth_px.shape)
    f_b = pair.f_px * pair.baseline_m
    z_m = f_b / (np.nan_to_num(truth_px) + pair.offset_px)
    x_m = (columns + pair.u0_left_px) * z_m / pair.f_px - pair.baseline_m / 2
    y_m = (rows + pair.v0_px) * z_m / pair.f_px
    seen_at = (np.stack([x_m, y_m, z_m], axis=-1).reshape(-1, 3) - view.C) @ view.M.T
    raw = np.rint(seen_at[:, :2] / seen_at[:, 2:]).astype(np.intp)
    inside = (raw >= 0).all(axis=1) & (raw < (view.width, view.height)).all(axis=1)
    raw[~inside] = 0
    hit = drawn.ids[raw[:, 1], raw[:, 0]] >= 0
    depth_m = np.where(hit, drawn.depth_m[raw[:, 1], raw[:, 0]], 1.0).astype(np.float64)
    front_z_m = view.points(raw, depth_m)[:, 2]
    nearer_px = f_b * (1.0 / front_z_m - 1.0 / z_m.ravel())
    clear = inside & ~(hit & (nearer_px > HIDDEN_PX))
    return np.asarray(clear.reshape(truth_px.shape), dtype=np.bool_)
