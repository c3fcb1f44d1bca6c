"""Samples of a calibration sweep as arrays: volts, directions, and corners of flat targets facing the rig."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.fit.mount_drift import MountDrift
from foveacam_pipeline.geometry.shapes import as_finite_rows
from foveacam_pipeline.models.intrinsics import Intrinsics


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EyeSweep:
    """n poses of one mirror, each with the same m corners of a target parallel to the image plane.

    `volts_v`: (n, 2) drive. `angles_rad`: (n, 2) direction of what the image centre sees, from the eye's
    reference point. `depth_m`: (n,) Z of the target. `raw_px`: (n, m, 2) corners found in the fovea image,
    NaN where one was not seen. `plane_px`: (n, m, 2) the same corners on the virtual pinhole plane of the
    reference point, relative to what the image centre sees. `group`: (n,) int, poses with the same number
    had the same gaze (at targets of several distances); cross-validation leaves them out together. `t_s`:
    (n,) times of measurement. `drift`: drift of the mount that was removed; None: not measured.
    """

    volts_v: NDArray[np.float64]
    angles_rad: NDArray[np.float64]
    depth_m: NDArray[np.float64]
    raw_px: NDArray[np.float64]
    plane_px: NDArray[np.float64]
    group: NDArray[np.int64] | None = None
    t_s: NDArray[np.float64] | None = None
    drift: MountDrift | None = None

    def __post_init__(self) -> None:
        poses = len(as_finite_rows(self.volts_v, columns=2, name="volts_v"))
        as_finite_rows(self.angles_rad, columns=2, name="angles_rad")
        corners = self.raw_px.shape[1] if self.raw_px.ndim == 3 else 0
        found = (self.angles_rad.shape, self.depth_m.shape, self.raw_px.shape, self.plane_px.shape)
        needed = ((poses, 2), (poses,), (poses, corners, 2), (poses, corners, 2))
        if found != needed:
            raise InvalidInput(
                f"sweep of {poses} poses: angles, depths, raw and plane corners have shapes {found}, "
                f"{needed} are needed; give every pose all its values"
            )
        if not (self.depth_m > 0.0).all():
            raise InvalidInput("sweep: every target must stand at a depth above 0 m; correct depth_m")

    @property
    def has_two_depths(self) -> bool:
        """Whether the targets' depths differ by a factor of 1.5 or more, with enough poses of each."""
        inverse = 1.0 / self.depth_m
        near = inverse > np.sqrt(inverse.min() * inverse.max())
        enough = min(int(near.sum()), int((~near).sum())) >= 10
        return bool(inverse.max() / inverse.min() >= 1.5 and enough)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RigSweep:
    """The sweeps of both eyes, and the nominal dimensions of the rig.

    `baseline_m`: distance of the reference points from which the angles were measured. `pupil_m`: nominal
    distance of the pupil behind its pivot; sweeps over two depths measure it instead.
    """

    rig_id: str
    created_utc: str
    origin: str
    label: str
    wide: Intrinsics
    left: EyeSweep
    right: EyeSweep
    baseline_m: float
    fovea_f_px: float
    fovea_width: int
    fovea_height: int
    pupil_m: float
