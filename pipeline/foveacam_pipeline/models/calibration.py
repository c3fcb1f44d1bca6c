"""The calibration of a whole rig: wide camera, mirrors, rectifications and their standard errors.

The gaze of an eye starts at its pivot. The pivots are stored as offsets from the reference points at
(-B/2, 0, 0) and (+B/2, 0, 0), to which Z = f B / d refers.
"""

import math
from dataclasses import dataclass, replace
from datetime import datetime
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Binning, InvalidInput, MirrorVolts, NotCalibrated, Role, StereoVolts
from foveacam_pipeline.geometry.angles import ray
from foveacam_pipeline.geometry.triangulate import RayIntersection, closest_approach
from foveacam_pipeline.geometry.verging import vergence_angles
from foveacam_pipeline.models.content import content_id, plain
from foveacam_pipeline.models.homography import HomographyField
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.models.mirror import MirrorModel


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EyeCalibration:
    """One eye: its mirror, its rectification, and the start point of its gaze.

    `pivot_offset_m`: (x, y, z) of the pivot from the eye's reference point, rig frame.
    `pivot_sigma_m`: standard error of the offset's x and y. `reference_depth_m`: the depth at which the
    angles were measured, where an error of the offset has no effect; None means infinity.
    """

    mirror: MirrorModel
    homography: HomographyField
    pivot_offset_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    pivot_sigma_m: float = 0.0
    reference_depth_m: float | None = None

    def angle_sigma_rad(self, depth_m: float) -> tuple[float, float]:
        """Return the standard error of the gaze (ax, ay), rad, as seen from the reference point.

        The error of the pivot's position counts in proportion to 1/Z minus that of the reference depth.
        """
        reference = 0.0 if self.reference_depth_m is None else 1.0 / self.reference_depth_m
        walk = self.pivot_sigma_m * abs(1.0 / depth_m - reference)
        return math.hypot(self.mirror.sigma_rad[0], walk), math.hypot(self.mirror.sigma_rad[1], walk)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Calibration:
    """The models that convert volts and pixels of one rig to angles and metres.

    `created_utc`: ISO 8601. `origin`: "factory", "measured" (by the procedures), "corrected" (for drift; then
    `parent_id` names what was corrected) or "imported". `session_id`: the session that measured it.
    `fovea_f_px`: focal length of the virtual pinholes. `pupil_m`: how far behind the pivot the entrance pupil
    lies, along the gaze.
    """

    rig_id: str
    created_utc: str
    origin: str
    label: str
    wide: Intrinsics
    left: EyeCalibration
    right: EyeCalibration
    baseline_m: float
    fovea_f_px: float
    fovea_width: int
    fovea_height: int
    pupil_m: float
    parent_id: str | None = None
    session_id: str | None = None

    @property
    def id(self) -> str:
        """Id of the calibration: a hash of its content."""
        return content_id(plain(self))

    @property
    def created(self) -> datetime:
        """Time of creation, with time zone."""
        return datetime.fromisoformat(self.created_utc)

    def check_rig(self, rig_id: str) -> None:
        """Raise NotCalibrated when it was made on another rig."""
        if rig_id != self.rig_id:
            raise NotCalibrated(
                f"calibration {self.id} ({self.label}) belongs to rig {self.rig_id!r}, "
                f"this rig is {rig_id!r}; load this rig's calibration or calibrate it"
            )

    def binned(self, binning: Binning, *, made_at: Binning = 1) -> "Calibration":
        """Return the calibration in pixels of binned pictures, fovea and wide; unchanged at binning 1.

        Angles, volts and metres are the same. It is for reading pictures, and is not stored. `made_at`: the
        binning of the pictures whose pixels this one counts; `binned(1, made_at=2)` is the sensor's.
        """
        return self if binning == made_at else _scaled(self, made_at / binning)

    def eye(self, role: Role) -> EyeCalibration:
        """Return the left or the right eye."""
        if role is Role.WIDE:
            raise InvalidInput("the wide camera has no mirror; ask for the left or the right eye")
        return self.left if role is Role.LEFT else self.right

    def reference_rig_m(self, role: Role) -> NDArray[np.float64]:
        """Return the (3,) reference point of an eye, m, rig frame: (-B/2, 0, 0) or (+B/2, 0, 0)."""
        half = 0.5 * self.baseline_m
        return np.array([-half if role is Role.LEFT else half, 0.0, 0.0])

    def pivot_rig_m(self, role: Role) -> NDArray[np.float64]:
        """Return the (3,) point from which an eye's gaze leaves, m, rig frame."""
        pivot: NDArray[np.float64] = self.reference_rig_m(role) + np.array(self.eye(role).pivot_offset_m)
        return pivot

    def gaze_rad(self, volts: StereoVolts) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return the (ax, ay), rad, of the left and of the right eye under `volts`."""
        return self.left.mirror.angles_rad(volts.left), self.right.mirror.angles_rad(volts.right)

    def steer(
        self, ax_rad: float, ay_rad: float, *, distance_m: float = math.inf, shift_rad: float = 0.0
    ) -> StereoVolts:
        """Return the volts with which both eyes look at a direction and distance from the rig's origin.

        `shift_rad`: vertical shift of the eyes against each other; the left looks that much lower, the right
        that much higher.
        """
        left, right = vergence_angles(
            ax_rad,
            ay_rad,
            distance_m,
            pivots_rig_m=(self.pivot_rig_m(Role.LEFT), self.pivot_rig_m(Role.RIGHT)),
        )
        return StereoVolts(
            left=self.left.mirror.volts(left[0], left[1] + shift_rad),
            right=self.right.mirror.volts(right[0], right[1] - shift_rad),
        )

    def meeting(self, volts: StereoVolts) -> RayIntersection:
        """Return where the two gazes meet under `volts`."""
        left, right = self.gaze_rad(volts)
        return closest_approach(
            self.pivot_rig_m(Role.LEFT), ray(*left), self.pivot_rig_m(Role.RIGHT), ray(*right)
        )

    def rectification(
        self, role: Role, ax_rad: float, ay_rad: float, *, depth_m: float = math.inf
    ) -> NDArray[np.float64]:
        """Return the (3, 3) homography of one gaze at one depth (as `rectifications`)."""
        homography: NDArray[np.float64] = self.rectifications(
            role, np.array([[ax_rad, ay_rad]]), depths_m=np.array([depth_m])
        )[0]
        return homography

    def rectifications(
        self, role: Role, gazes_rad: NDArray[np.float64], *, depths_m: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return (n, 3, 3) homographies from raw fovea px to (du, dv, 1) for what lies at Z = `depths_m`.

        `gazes_rad`: (n, 2) rad; `depths_m`: (n,) m, or infinity. Like `HomographyField.at_each`, with what a
        finite depth adds: the pupil lies `pupil_m` behind the pivot, which widens the field by
        1 + pupil cos(gaze) / Z, and the pivot lies beside the eye's reference point, to which (du, dv)
        refers.
        """
        eye = self.eye(role)
        tangents = np.tan(gazes_rad)
        displacement = np.zeros((len(tangents), 3, 3))
        widening = 1.0 + self.pupil_m / (depths_m * np.sqrt(1.0 + np.sum(tangents**2, axis=1)))
        displacement[:, 0, 0] = displacement[:, 1, 1] = widening
        x_m, y_m, z_m = eye.pivot_offset_m
        shifts_m = np.array([x_m, y_m]) - z_m * tangents
        displacement[:, :2, 2] = self.fovea_f_px * shifts_m / depths_m[:, None]
        displacement[:, 2, 2] = 1.0
        homographies: NDArray[np.float64] = displacement @ eye.homography.at_each(gazes_rad)
        homographies /= homographies[:, 2:, 2:]
        return homographies

    def pose_sigma_px(self, depth_m: float = math.inf) -> float:
        """Return the standard error of the total disparity at `depth_m` that all pixels share, fovea px."""
        left, right = self.left.angle_sigma_rad(depth_m), self.right.angle_sigma_rad(depth_m)
        return self.fovea_f_px * math.hypot(left[0], right[0])

    def epipolar_sigma_px(self, depth_m: float = math.inf) -> float:
        """Return the standard error of the row difference between the eyes at `depth_m`, fovea px."""
        left, right = self.left.angle_sigma_rad(depth_m), self.right.angle_sigma_rad(depth_m)
        return self.fovea_f_px * math.hypot(left[1], right[1])

    def reach_rad(self) -> tuple[float, float, float, float]:
        """Return a box (ax min, ax max, ay min, ay max), rad, that both eyes reach entirely.

        It is the common bounding box of both fields, shrunk until it lies inside them.
        """
        hulls = [self.left.mirror.hull_rad, self.right.mirror.hull_rad]
        low = np.max([hull.min(axis=0) for hull in hulls], axis=0)
        high = np.min([hull.max(axis=0) for hull in hulls], axis=0)
        centre, half = (low + high) / 2.0, (high - low) / 2.0
        rim = np.array([(x, y) for x in np.linspace(-1, 1, 9) for y in np.linspace(-1, 1, 9)])
        smallest, largest = 0.0, 1.0
        for _ in range(20):
            size = (smallest + largest) / 2.0
            box = centre + size * half * rim
            fits = self.left.mirror.inside(box).all() and self.right.mirror.inside(box).all()
            smallest, largest = (size, largest) if fits else (smallest, size)
        low, high = centre - smallest * half, centre + smallest * half
        return float(low[0]), float(high[0]), float(low[1]), float(high[1])


@lru_cache(maxsize=8)
def _scaled(calibration: Calibration, scale: float) -> Calibration:
    """Return the calibration of cameras with `scale` times as many pixels a side."""
    left, right = (
        replace(eye, homography=eye.homography.scaled(scale)) for eye in (calibration.left, calibration.right)
    )
    return replace(
        calibration,
        wide=calibration.wide.scaled(scale),
        left=left,
        right=right,
        fovea_f_px=calibration.fovea_f_px * scale,
        fovea_width=math.floor(calibration.fovea_width * scale),
        fovea_height=math.floor(calibration.fovea_height * scale),
    )


def eye_volts(volts: StereoVolts, role: Role) -> MirrorVolts:
    """Return the volts of one eye's mirror."""
    return volts.left if role is Role.LEFT else volts.right
