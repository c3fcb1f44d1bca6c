"""Renders a look at a random scene by the simulated rig's optics, sensors and calibration, with its truth."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame, InvalidInput, Role, StereoVolts, VirtualClock
from foveacam_hardware.sim.animated_scene import AnimatedScene
from foveacam_hardware.sim.cameras import CAMERA_NUMBER
from foveacam_hardware.sim.presets import RIG120
from foveacam_hardware.sim.render.projection import Projection, disparity_of
from foveacam_hardware.sim.sensor import image_from_radiance
from foveacam_hardware.sim.world import World, renderer_projection
from foveacam_pipeline.learn.pair_folder import PairTruth
from foveacam_pipeline.models import Calibration, load_calibration
from foveacam_pipeline.stereo.rectify import halved, rectify_frames, window_from_raw
from foveacam_pipeline.stereo.values import RectifiedPair
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.resources.studying.learning.random_scenes import PairScene

PRESET = RIG120
EYES = (Role.LEFT, Role.RIGHT)
SCALES = (0.25, 0.5, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LabelledLook:
    """A pair, its truth, and the median over pixels of |row of the right picture - row of the left|, px."""

    pair: RectifiedPair
    truth: PairTruth
    row_error_px: float


def scale_of(calibration: Calibration, size: tuple[int, int]) -> float:
    """Return the scale that gives pairs of a size; raise InvalidInput for any other size."""
    sizes = {
        (round(calibration.fovea_width * scale), round(calibration.fovea_height * scale)): scale
        for scale in SCALES
    }
    if size not in sizes:
        listed = ", ".join(f"{width}x{height}" for width, height in sizes)
        raise InvalidInput(f"pairs of {size[0]}x{size[1]} px: they have one of the sizes {listed}")
    return sizes[size]


@cache
def own_calibration() -> Calibration:
    """Return the shipped calibration of the simulated rig, which was measured."""
    return load_calibration(SHIPPED / f"sim-{PRESET.name}.json")


def render_look(drawn: PairScene, calibration: Calibration, *, scale: float, noise_seed: int) -> LabelledLook:
    """Render both foveae, verged; rectify them by the calibration; add the truth of the renderer."""
    scene = AnimatedScene(drawn.file, threads=1)
    world = World(scene=scene, preset=PRESET, seed=0, clock=VirtualClock(0))
    x, y = np.tan([drawn.ax_rad, drawn.ay_rad]).tolist()
    distance_m = drawn.z_m * float(np.sqrt(1.0 + x * x + y * y))
    volts = calibration.steer(drawn.ax_rad, drawn.ay_rad, distance_m=distance_m)
    t_ns = round(drawn.age_s * 1e9)
    views = {
        role: renderer_projection(world.static_view(role, drive, t_ns=t_ns))
        for role, drive in zip(EYES, (volts.left, volts.right), strict=True)
    }
    left, right = (_frame(scene, views[role], role, drawn, key=noise_seed) for role in EYES)
    pair = rectify_frames(left, right, volts, calibration, scale=max(scale, 0.5))
    pair = pair if scale >= 0.5 else halved(pair)
    truth, row_error_px = _truth(scene, views, calibration, volts, pair)
    scene.close()
    return LabelledLook(pair=pair, truth=truth, row_error_px=row_error_px)


def _frame(scene: AnimatedScene, view: Projection, role: Role, drawn: PairScene, *, key: int) -> Frame:
    settings = drawn.cameras[role]
    radiance = scene.radiance(view, 0.0, channels=3)
    return Frame(
        image=image_from_radiance(radiance, role, settings, key=(key, CAMERA_NUMBER[role], 0)),
        role=role,
        seq=0,
        t_ns=round(drawn.age_s * 1e9),
        exposure_ns=settings.exposure_ns,
        bits=8,
        epoch=1,
    )


def _truth(
    scene: AnimatedScene,
    views: dict[Role, Projection],
    calibration: Calibration,
    volts: StereoVolts,
    pair: RectifiedPair,
) -> tuple[PairTruth, float]:
    """Return the truth of a pair and its median row error, px; each window is rendered as a camera.

    A window is a homography of a raw picture, so that the renderer gives the depth of exactly its pixels.
    """
    left, right = (_window(views[role], calibration, role, volts, pair) for role in EYES)
    near, far = scene.probe(left, 0.0), scene.probe(right, 0.0)
    disparity_px, seen = disparity_of(left, near.depth_m, near.ids, right, far.depth_m, far.ids)
    disparity_px[~pair.valid_left] = np.nan
    hit = np.isfinite(disparity_px)
    both = seen & hit & _inside(pair.valid_right, disparity_px)
    rows, columns = np.nonzero(both)
    points = left.points(np.column_stack([columns, rows]), near.depth_m[both])
    off_px = np.abs(right.project(points)[:, 1] - rows)
    truth = PairTruth(disparity_px=disparity_px, both=both, occluded=hit & ~both)
    return truth, float(np.median(off_px)) if len(off_px) else 0.0


def _window(
    view: Projection, calibration: Calibration, role: Role, volts: StereoVolts, pair: RectifiedPair
) -> Projection:
    """Return the projection to the pixels of an eye's window."""
    u0_px = pair.u0_left_px if role is Role.LEFT else pair.u0_right_px
    scale = pair.f_px / calibration.fovea_f_px
    height, width = pair.left.shape[:2]
    window = window_from_raw(calibration, role, volts, scale=scale, origin_px=(u0_px, pair.v0_px))
    return Projection(M=window @ view.M, C=view.C, width=width, height=height)


def _inside(valid_right: NDArray[np.bool_], disparity_px: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Return (h, w) bool: whether the right window has a valid pixel at the true match."""
    rows, columns = np.indices(disparity_px.shape)
    target = np.rint(columns - np.nan_to_num(disparity_px)).astype(np.intp)
    inside = (target >= 0) & (target < disparity_px.shape[1])
    return np.asarray(inside & valid_right[rows, np.where(inside, target, 0)], dtype=np.bool_)
