"""The projection of a fovea's pixels on its eye's plane, for objects at any depth, and its inverse.

With q = 1 / Z, a raw pixel that the homography of the gaze maps to h lies at f t + s q + (1 + p q) h: t are
the tangents of the gaze, p is the distance of the pupil behind the pivot, s the lateral offset of the
pivot, px m. Everything is linear in q, so it is exact for objects nearer or farther than where the eyes
meet.
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import MirrorVolts, Role
from foveacam_pipeline.geometry.plane_window import homography_apply
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.footprint import fovea_corners_px

Floats = NDArray[np.float64]


def _none() -> Floats:
    return np.zeros(2)


def _identity() -> Floats:
    return np.eye(2)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EyeLook:
    """One eye under one drive.

    `gaze_px`: (2,) f times the tangents of the gaze. `pivot_px_m`: (2,) s. `pupil_m`: p. `gaze_from_raw`:
    (3, 3) raw px to h. `shift_px`: (2,) and `turn`: (2, 2) come from the adjustment: h is turned,
    everything is shifted.
    """

    gaze_px: Floats
    pivot_px_m: Floats
    pupil_m: float
    gaze_from_raw: Floats
    shift_px: Floats = field(default_factory=_none)
    turn: Floats = field(default_factory=_identity)

    @classmethod
    def of(cls, calibration: Calibration, role: Role, drive: MirrorVolts) -> "EyeLook":
        """Return the projection of an eye under `drive`."""
        eye, f_px = calibration.eye(role), calibration.fovea_f_px
        ax_rad, ay_rad = eye.mirror.angles_rad(drive)
        tangents = np.array([math.tan(ax_rad), math.tan(ay_rad)])
        x_m, y_m, z_m = eye.pivot_offset_m
        return cls(
            gaze_px=f_px * tangents,
            pivot_px_m=f_px * (np.array([x_m, y_m]) - z_m * tangents),
            pupil_m=calibration.pupil_m / math.hypot(1.0, *tangents),
            gaze_from_raw=eye.homography.at(ax_rad, ay_rad),
        )

    def with_adjustment(self, shift_px: Floats, turn: Floats) -> "EyeLook":
        """Return a copy with the shift and turn of an adjustment."""
        return replace(self, shift_px=shift_px, turn=turn)

    def plane(self, raw_px: Floats, per_depth: float) -> Floats:
        """Return (n, 2) plane positions of raw px (n, 2) at q = `per_depth`, 1/m."""
        about = homography_apply(self.gaze_from_raw, raw_px) @ self.turn.T
        return self._offset(per_depth) + (1.0 + self.pupil_m * per_depth) * about

    def gaze_relative(self, u_px: Floats, v_px: Floats, per_depth: Floats) -> tuple[Floats, Floats]:
        """Return h of plane positions at q = `per_depth`, 1/m; all of shapes that broadcast."""
        widening = 1.0 + self.pupil_m * per_depth
        hx = (u_px - self.gaze_px[0] - self.shift_px[0] - self.pivot_px_m[0] * per_depth) / widening
        hy = (v_px - self.gaze_px[1] - self.shift_px[1] - self.pivot_px_m[1] * per_depth) / widening
        back = np.linalg.inv(self.turn)
        return back[0, 0] * hx + back[0, 1] * hy, back[1, 0] * hx + back[1, 1] * hy

    def raw(self, u_px: Floats, v_px: Floats, per_depth: Floats) -> tuple[Floats, Floats]:
        """Return raw px (x, y) of plane positions at q = `per_depth`, 1/m; all of shapes that broadcast."""
        hx, hy = self.gaze_relative(u_px, v_px, per_depth)
        back = np.linalg.inv(self.gaze_from_raw)
        w = back[2, 0] * hx + back[2, 1] * hy + back[2, 2]
        x = (back[0, 0] * hx + back[0, 1] * hy + back[0, 2]) / w
        y = (back[1, 0] * hx + back[1, 1] * hy + back[1, 2]) / w
        return x, y

    def corners(self, calibration: Calibration, per_depth: float) -> Floats:
        """Return (4, 2) plane positions of the image's outer corners, clockwise from the top left."""
        return self.plane(fovea_corners_px(calibration), per_depth)

    def _offset(self, per_depth: float) -> Floats:
        return self.gaze_px + self.shift_px + self.pivot_px_m * per_depth


def box_of(corners_px: Floats) -> tuple[float, float, float, float]:
    """Return left, top, right, bottom of positions (n, 2)."""
    low, high = corners_px.min(axis=0), corners_px.max(axis=0)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])
