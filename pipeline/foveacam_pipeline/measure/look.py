"""The dense depth of one look, with the geometry that converts a pixel of any of its pictures to a point.

Errors: the disparity of each pixel has its own matching error; all pixels of the look share three pose
errors: the shifts of the left and of the right window along u, and the common shift of both along v, px at
the window's scale.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role, StereoVolts
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.rectify import crossing_z_m, window_from_raw
from foveacam_pipeline.stereo.values import DepthMap, RectifiedPair


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LookDepth:
    """Depth of every pixel of the left rectified window.

    `z_m`: (h, w) float32 along +z of the rig frame, NaN where unknown. `sigma_px`: (h, w) float32 matching
    error of the disparity. A pixel (x, y) lies at (x + u0_left_px, y + v0_px) on the left virtual pinhole
    plane. `pose_sigma_px`: (left along u, right along u, both along v). `window_from_left`,
    `window_from_right`: (3, 3) from raw fovea pixels to pixels of the eye's own window. `volts`: drive of
    both mirrors during the exposure.
    """

    z_m: NDArray[np.float32]
    sigma_px: NDArray[np.float32]
    f_px: float
    baseline_m: float
    u0_left_px: float
    u0_right_px: float
    v0_px: float
    scale: float
    pose_sigma_px: tuple[float, float, float]
    window_from_left: NDArray[np.float64]
    window_from_right: NDArray[np.float64]
    volts: StereoVolts
    t_ns: int

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height of the window, px."""
        height, width = self.z_m.shape
        return int(width), int(height)

    @property
    def median_z_m(self) -> float:
        """Median depth of the known pixels, m; NaN when there is none."""
        known = self.z_m[np.isfinite(self.z_m)]
        return float(np.median(known)) if known.size else float("nan")

    def residual_px(self, z_m: float) -> float:
        """Return the residual disparity, left minus right column, px, of a surface at depth `z_m`."""
        return self.f_px * self.baseline_m / z_m - (self.u0_left_px - self.u0_right_px)


def look_depth(
    pair: RectifiedPair, depth: DepthMap, *, calibration: Calibration, volts: StereoVolts, scale: float
) -> LookDepth:
    """Return the depth of a look with its geometry and its pose errors."""
    z_m = crossing_z_m(calibration, volts)
    left_rad, right_rad = (eye.angle_sigma_rad(z_m) for eye in (calibration.left, calibration.right))
    per_px = depth.z_m * depth.z_m / np.float32(pair.f_px * pair.baseline_m)
    both_v_rad = float(np.hypot(left_rad[1], right_rad[1])) / 2.0
    f_px = pair.f_px
    return LookDepth(
        z_m=depth.z_m,
        sigma_px=np.asarray(depth.sigma_m / per_px, dtype=np.float32),
        f_px=f_px,
        baseline_m=pair.baseline_m,
        u0_left_px=pair.u0_left_px,
        u0_right_px=pair.u0_right_px,
        v0_px=pair.v0_px,
        scale=scale,
        pose_sigma_px=(f_px * left_rad[0], f_px * right_rad[0], f_px * both_v_rad),
        window_from_left=window_from_raw(
            calibration, Role.LEFT, volts, scale=scale, origin_px=(pair.u0_left_px, pair.v0_px)
        ),
        window_from_right=window_from_raw(
            calibration, Role.RIGHT, volts, scale=scale, origin_px=(pair.u0_right_px, pair.v0_px)
        ),
        volts=volts,
        t_ns=pair.t_ns,
    )
