"""Looks with depth made to order, for what measures in them."""

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import MirrorVolts, StereoVolts
from foveacam_pipeline.measure.look import LookDepth

WIDTH, HEIGHT = 240, 180
F_PX, BASELINE_M = 14_380.0, 0.2
U0_LEFT_PX, V0_PX = 600.0, -300.0
MATCHING_PX, POSE_PX = 0.1, (0.3, 0.25, 0.2)
POINT_M = np.array([-0.05, -0.04, 3.0])
NORMAL = np.array([0.25, -0.35, -np.sqrt(1 - 0.25**2 - 0.35**2)])


def look_of(disparity_px: NDArray[np.float64], *, u0_left_px: float = U0_LEFT_PX) -> LookDepth:
    """Return a look whose left window pixel (x, y) has the total disparity `disparity_px[y, x]`."""
    still = StereoVolts(left=MirrorVolts(x_v=1.0, y_v=2.0), right=MirrorVolts(x_v=3.0, y_v=4.0))
    return LookDepth(
        z_m=(F_PX * BASELINE_M / disparity_px).astype(np.float32),
        sigma_px=np.full(disparity_px.shape, MATCHING_PX, dtype=np.float32),
        f_px=F_PX,
        baseline_m=BASELINE_M,
        u0_left_px=u0_left_px,
        u0_right_px=-350.0,
        v0_px=V0_PX,
        scale=0.5,
        pose_sigma_px=POSE_PX,
        window_from_left=np.diag([0.5, 0.5, 1.0]),
        window_from_right=np.diag([0.5, 0.5, 1.0]),
        volts=still,
        t_ns=5,
    )


def plane_disparity_px() -> NDArray[np.float64]:
    """Return (h, w) total disparity of the plane through `POINT_M` with `NORMAL`."""
    ys, xs = np.indices((HEIGHT, WIDTH)).astype(np.float64)
    rays = np.stack([(xs + U0_LEFT_PX) / F_PX, (ys + V0_PX) / F_PX, np.ones_like(xs)], axis=-1)
    left_eye = np.array([-BASELINE_M / 2.0, 0.0, 0.0])
    z_m = ((POINT_M - left_eye) @ NORMAL) / (rays @ NORMAL)
    return np.asarray(F_PX * BASELINE_M / z_m, dtype=np.float64)
