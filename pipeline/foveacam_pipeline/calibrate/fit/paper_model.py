"""The paper's own calibration (Sec. 3.2), for comparison only: nothing here is used for steering.

It has cubics in both directions, fitted separately (Eqs. 2, 3), one homography a pose and a polynomial for
each entry (Eq. 4), and one distance. The gaze is the wide camera's bearing (Eq. 1 is not corrected); pivot
and pupil are nominal.
"""

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import MirrorVolts, OutOfRange, Role, StereoVolts
from foveacam_pipeline.calibrate.fit.fit import FitChoice, RigFit, fit_rig
from foveacam_pipeline.calibrate.fit.measured import DistanceSource, NominalRig, reduce_sweeps
from foveacam_pipeline.calibrate.sweep.sweep import Sweep
from foveacam_pipeline.geometry.plane_window import homography_apply
from foveacam_pipeline.geometry.polynomial import PolynomialFit, fit_polynomial
from foveacam_pipeline.geometry.verging import vergence_angles
from foveacam_pipeline.models.calibration import Calibration, eye_volts
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.models.mirror import DAC_STEP_V

CUBIC = 3
PAPER_CHOICE = FitChoice(
    mirror_orders=(CUBIC,), spring_orders=(), field_orders=(CUBIC,), pose_by_pose=True, fits_pivots=False
)

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PaperModel:
    """A rig calibrated as in the paper.

    `fit`: volts to angles and the rectification. `inverse`: angles to volts, for each eye. `station`: the
    name of the station of its sweep.
    """

    fit: RigFit
    inverse: dict[Role, PolynomialFit]
    station: str

    @property
    def calibration(self) -> Calibration:
        """The forward models as a `Calibration`."""
        return self.fit.calibration

    @property
    def wide(self) -> Intrinsics:
        """The wide camera."""
        return self.calibration.wide

    @property
    def fovea_f_px(self) -> float:
        """Focal length of the virtual pinholes, px."""
        return self.calibration.fovea_f_px

    @property
    def baseline_m(self) -> float:
        """Distance of the eyes' reference points, m."""
        return self.calibration.baseline_m

    def steer(self, ax_rad: float, ay_rad: float, *, distance_m: float = math.inf) -> StereoVolts:
        """Return the volts by Eq. 2 for a direction and a distance from the origin, or raise OutOfRange."""
        references = self.calibration.reference_rig_m(Role.LEFT), self.calibration.reference_rig_m(Role.RIGHT)
        left, right = vergence_angles(ax_rad, ay_rad, distance_m, pivots_rig_m=references)
        return StereoVolts(left=self._volts(Role.LEFT, left), right=self._volts(Role.RIGHT, right))

    def plane_px(
        self, role: Role, volts: StereoVolts, *, raw_px: NDArray[np.float64], depth_m: float
    ) -> NDArray[np.float64]:
        """Return the (n, 2) px of raw px (n, 2) on an eye's virtual plane; the depth is ignored."""
        del depth_m
        eye = self.calibration.eye(role)
        ax_rad, ay_rad = eye.mirror.angles_rad(eye_volts(volts, role))
        gaze = self.fovea_f_px * np.array([math.tan(ax_rad), math.tan(ay_rad)])
        return np.asarray(gaze + homography_apply(eye.homography.at(ax_rad, ay_rad), raw_px), np.float64)

    @property
    def roundtrip_lsb(self) -> float:
        """Largest error of volts -> angles -> volts at the measured poses, DAC steps, by both cubics."""
        missed = [
            self.inverse[role].polynomial(self.calibration.eye(role).mirror.angles_of(sweep.volts_v))
            - sweep.volts_v
            for role, sweep in self.fit.sweeps.items()
        ]
        return float(np.abs(np.concatenate(missed)).max() / DAC_STEP_V)

    def _volts(self, role: Role, angles_rad: tuple[float, float]) -> MirrorVolts:
        mirror = self.calibration.eye(role).mirror
        if not mirror.contains(*angles_rad):
            ax_deg, ay_deg = np.rad2deg(angles_rad)
            raise OutOfRange(
                f"paper model, {role} eye: ax {ax_deg:.2f}°, ay {ay_deg:.2f}° is beyond what was swept; "
                "choose a direction nearer to the centre"
            )
        x_v, y_v = self.inverse[role].polynomial([angles_rad])[0].tolist()
        return MirrorVolts(x_v=x_v, y_v=y_v)


def fit_paper(sweep: Sweep, wide: Intrinsics, *, drawing: NominalRig) -> PaperModel:
    """Fit the paper's models to the sweep of one station."""
    measured = reduce_sweeps(
        [sweep],
        wide,
        drawing=replace(drawing, pupil_m=0.0),
        label="paper",
        distance=DistanceSource.UNKNOWN,
        take_out_drift=False,
    )
    fit = fit_rig(measured.rig, PAPER_CHOICE)
    inverse = {role: fit_polynomial(eye.angles_rad, eye.volts_v, CUBIC) for role, eye in fit.sweeps.items()}
    return PaperModel(fit=fit, inverse=inverse, station=sweep.header.station.name)


def farthest_sweep(sweeps: Sequence[Sweep], distances_m: Sequence[float]) -> Sweep:
    """Return the sweep with the farthest target, where the parallax of Eq. 1 is smallest."""
    return sweeps[int(np.argmax(distances_m))]
