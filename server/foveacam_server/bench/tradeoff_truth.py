"""The wide camera's stereo pair with its truth: the rig half a baseline to each side, as on a linear stage.

Both pictures are straightened to one pinhole; depth and occlusion are the renderer's, at that pinhole.
"""

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import DeviceFault
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.render.projection import Projection
from foveacam_pipeline.models import Calibration
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.study.tradeoff.streets import StereoScene

NEAR_M = 2.5
"""Nothing is looked for nearer: 250 px of disparity."""
FAR_M = 60.0
"""What is farther away, or nothing, is not counted."""
SAME_SHARE = 0.01
"""Left and right see the same point where their depths agree to so much."""


def wide_pair(
    rig: Rig, calibration: Calibration, aside: Callable[[float], None], *, name: str
) -> StereoScene:
    """Return the pair; `aside` puts the rig so many metres to its right. The rig is left at 0.

    Raise DeviceFault for a rig without its world.
    """
    if rig.truth is None:
        raise DeviceFault("the rig came without its world; open it with open_simulated")
    half_m = calibration.baseline_m / 2.0
    pictures, depths_m = [], []
    for x_m in (-half_m, half_m):
        aside(x_m)
        pictures.append(_straight(to_uint8(rig.head.wide(max_age_ms=0.0)), calibration.wide))
        depths_m.append(_depth_m(rig, calibration.wide))
    aside(0.0)
    f_px = calibration.wide.fx_px
    left_m, right_m = depths_m
    return StereoScene(
        name=name,
        left=pictures[0],
        right=pictures[1],
        f_px=f_px,
        baseline_m=calibration.baseline_m,
        truth_z_m=np.where(left_m < FAR_M, left_m, np.nan).astype(np.float32),
        seen=_seen(left_m, right_m, f_b=f_px * calibration.baseline_m),
        near_m=NEAR_M,
    )


def _pinhole(wide: Intrinsics) -> NDArray[np.float64]:
    """Return (3, 3): the wide camera's pinhole without its distortion, its pixels square."""
    return np.array([[wide.fx_px, 0.0, wide.cx_px], [0.0, wide.fx_px, wide.cy_px], [0.0, 0.0, 1.0]])


def _straight(image: NDArray[np.uint8], wide: Intrinsics) -> NDArray[np.uint8]:
    maps = cv2.initUndistortRectifyMap(
        wide.matrix,
        np.array(wide.distortion),
        np.eye(3),
        _pinhole(wide),
        (wide.width, wide.height),
        cv2.CV_32FC1,
    )
    return np.asarray(cv2.remap(image, *maps, cv2.INTER_CUBIC), dtype=np.uint8)


def _depth_m(rig: Rig, wide: Intrinsics) -> NDArray[np.float32]:
    """Return (h, w) float32, depth along the rig's z now; infinite where there is nothing."""
    if rig.truth is None:
        raise DeviceFault("the rig came without its world; open it with open_simulated")
    world = rig.truth.world
    pinhole = Projection(M=_pinhole(wide), C=np.zeros(3), width=wide.width, height=wide.height)
    return world.stage.probe(pinhole, world.scene_s(rig.clock.now_ns())).depth_m.copy()


def _seen(left_m: NDArray[np.float32], right_m: NDArray[np.float32], *, f_b: float) -> NDArray[np.bool_]:
    """Return (h, w) bool: whether the right camera sees the left one's point."""
    height, width = left_m.shape
    y, x = np.mgrid[:height, :width].astype(np.float32)
    there_m = cv2.remap(
        right_m, x - np.float32(f_b) / left_m, y, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT
    )
    known = np.isfinite(left_m) & np.isfinite(there_m)
    apart_m = np.where(known, there_m, 0.0) - np.where(known, left_m, 0.0)
    return np.asarray(known & (np.abs(apart_m) < SAME_SHARE * left_m))
