"""Convert a pixel of a look to a point of the rig frame, with its covariance in two parts.

P = (u Z / f - B/2, v Z / f, Z) with Z = f B / d. The matching error of d moves a point along its ray only;
the pose errors, which all points of a look share, move it along and across.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.measure.look import LookDepth

EDGE_JUMP_PX = 2.0
"""Variation of disparity in a 5 x 5 window above which a point may lie on either of two surfaces, px."""
EDGE_REACH_PX = 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeasuredPoint:
    """A point with its errors.

    `point_rig_m`: (3,). `own_cov_m2`: (3, 3) covariance that no other point shares. `pose_jacobian`: (3, 3)
    m per px of each pose error; `pose_sigma_px`: (3,) of them; both zero for a point whose pose errors are
    not known separately. `look_id`: points of one look share its pose errors; None: it shares none.
    """

    point_rig_m: NDArray[np.float64]
    own_cov_m2: NDArray[np.float64]
    pose_jacobian: NDArray[np.float64]
    pose_sigma_px: NDArray[np.float64]
    look_id: str | None

    @property
    def cov_m2(self) -> NDArray[np.float64]:
        """The whole (3, 3) covariance, m^2."""
        spread = self.pose_jacobian * self.pose_sigma_px
        return np.asarray(self.own_cov_m2 + spread @ spread.T, dtype=np.float64)

    @property
    def sigma_m(self) -> tuple[float, float, float]:
        """Standard errors of X, Y and Z, m."""
        x_m, y_m, z_m = np.sqrt(np.diag(self.cov_m2)).tolist()
        return x_m, y_m, z_m

    @property
    def distance_m(self) -> float:
        """Distance from the rig's origin, m."""
        return float(np.linalg.norm(self.point_rig_m))

    @property
    def distance_sigma_m(self) -> float:
        """Standard error of the distance, m."""
        along = self.point_rig_m / self.distance_m
        return math.sqrt(float(along @ self.cov_m2 @ along))


def point_at(look: LookDepth, x_px: int, y_px: int, *, look_id: str) -> MeasuredPoint:
    """Return the point of a window pixel whose depth is known."""
    return point_of(
        look,
        (float(x_px), float(y_px)),
        float(look.z_m[y_px, x_px]),
        sigma_px=float(look.sigma_px[y_px, x_px]),
        look_id=look_id,
    )


def point_of(
    look: LookDepth, pixel: tuple[float, float], z_m: float, *, sigma_px: float, look_id: str
) -> MeasuredPoint:
    """Return the point of a window pixel at a depth whose disparity has the matching error `sigma_px`."""
    f_px, b_m = look.f_px, look.baseline_m
    ray = np.array([(pixel[0] + look.u0_left_px) / f_px, (pixel[1] + look.v0_px) / f_px, 1.0])
    per_px = z_m * z_m / (f_px * b_m) * ray
    across_m = z_m / f_px
    pose = np.column_stack([np.array([across_m, 0.0, 0.0]) - per_px, per_px, np.array([0.0, across_m, 0.0])])
    return MeasuredPoint(
        point_rig_m=z_m * ray - np.array([b_m / 2.0, 0.0, 0.0]),
        own_cov_m2=np.outer(per_px, per_px) * sigma_px**2,
        pose_jacobian=pose,
        pose_sigma_px=np.array(look.pose_sigma_px),
        look_id=look_id,
    )


def lone_point(point_rig_m: tuple[float, float, float], *, sigma_z_m: float) -> MeasuredPoint:
    """Return a point of which only the total standard error of depth is known; it shares no error."""
    point = np.array(point_rig_m)
    step = point / point[2] * sigma_z_m
    none = np.zeros(3)
    return MeasuredPoint(
        point_rig_m=point,
        own_cov_m2=np.outer(step, step),
        pose_jacobian=np.zeros((3, 3)),
        pose_sigma_px=none,
        look_id=None,
    )


def nearest_known(look: LookDepth, x_px: float, y_px: float, *, reach_px: float) -> tuple[int, int] | None:
    """Return the (x, y) of the nearest window pixel with depth, None when none is within `reach_px`."""
    width, height = look.size_px
    left, right = max(0, math.ceil(x_px - reach_px)), min(width - 1, math.floor(x_px + reach_px))
    top, bottom = max(0, math.ceil(y_px - reach_px)), min(height - 1, math.floor(y_px + reach_px))
    if left > right or top > bottom:
        return None
    near = look.z_m[top : bottom + 1, left : right + 1]
    rows, columns = np.nonzero(np.isfinite(near))
    if len(rows) == 0:
        return None
    away_px = np.hypot(columns + left - x_px, rows + top - y_px)
    best = int(np.argmin(away_px))
    if away_px[best] > reach_px:
        return None
    return int(columns[best]) + left, int(rows[best]) + top


def beside_edge(look: LookDepth, x_px: int, y_px: int) -> bool:
    """Return whether a depth edge is so near to a window pixel that its depth may be of either surface."""
    reach = EDGE_REACH_PX
    near = look.z_m[max(0, y_px - reach) : y_px + reach + 1, max(0, x_px - reach) : x_px + reach + 1]
    known = near[np.isfinite(near)]
    if known.size < 2:
        return False
    disparity = look.f_px * look.baseline_m / known
    return bool(np.ptp(disparity) > EDGE_JUMP_PX)
