"""The model of a steering mirror: drive volts <-> gaze angles (Eqs. 2 and 3).

The forward polynomial is the model. The inverse polynomial is only the starting point of a Newton iteration
on the forward one, so that a round trip is exact to far below one step of the DAC.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foveacam_hardware.contract import MirrorVolts, NotCalibrated, OutOfRange
from foveacam_pipeline.geometry.polynomial import BivariatePolynomial
from foveacam_pipeline.geometry.shapes import as_rows

DAC_STEP_V = 200.0 / 65_535.0
"""Volts of one DAC code: the smallest change of a differential drive (200 V full scale, 16 bits)."""
_NEWTON_ROUNDS = 20
_NEWTON_STOP_V = 1e-6 * DAC_STEP_V


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MirrorModel:
    """A calibrated mirror.

    `forward`: volts (x, y) -> (ax, ay), rad. `inverse`: (ax, ay) -> volts, approximate.
    `hull_rad`: (m, 2) corners of the convex hull of the calibrated directions, anticlockwise in (ax, ay).
    `max_v`: the largest |x| and |y| volts that were calibrated. `sigma_rad`: standard error of a predicted
    (ax, ay). `loo_rad`: root mean square leave-one-out residual; it contains the noise of one sample.
    """

    forward: BivariatePolynomial
    inverse: BivariatePolynomial
    hull_rad: NDArray[np.float64]
    margin_rad: float
    max_v: tuple[float, float]
    sigma_rad: tuple[float, float]
    loo_rad: tuple[float, float]

    def angles_rad(self, volts: MirrorVolts) -> tuple[float, float]:
        """Return the gaze (ax, ay), rad, under `volts`."""
        ax_rad, ay_rad = self.forward([[volts.x_v, volts.y_v]])[0].tolist()
        return ax_rad, ay_rad

    def angles_of(self, volts_v: ArrayLike) -> NDArray[np.float64]:
        """Return (n, 2) float64 gaze angles, rad, under `volts_v`: (n, 2)."""
        return self.forward(as_rows(volts_v, columns=2, name="volts_v"))

    def volts(self, ax_rad: float, ay_rad: float) -> MirrorVolts:
        """Return the drive that looks along (ax, ay), or raise OutOfRange."""
        x_v, y_v = self.volts_for([[ax_rad, ay_rad]])[0].tolist()
        return MirrorVolts(x_v=x_v, y_v=y_v)

    def volts_for(self, angles_rad: ArrayLike) -> NDArray[np.float64]:
        """Return (n, 2) float64 volts for `angles_rad`: (n, 2), or raise OutOfRange for the first outside."""
        angles = as_rows(angles_rad, columns=2, name="angles_rad")
        inside, volts = self._solve(angles)
        if not inside.all():
            self._refuse(angles[int(np.argmin(inside))])
        return volts

    def contains(self, ax_rad: float, ay_rad: float) -> bool:
        """Return whether the mirror is calibrated to look along (ax, ay)."""
        return bool(self.inside([[ax_rad, ay_rad]])[0])

    def inside(self, angles_rad: ArrayLike) -> NDArray[np.bool_]:
        """Return (n,) bool: which of `angles_rad`: (n, 2) the mirror is calibrated to look along."""
        return self._solve(as_rows(angles_rad, columns=2, name="angles_rad"))[0]

    def _in_hull(self, angles: NDArray[np.float64]) -> NDArray[np.bool_]:
        edges = np.roll(self.hull_rad, -1, axis=0) - self.hull_rad
        outward = np.column_stack([edges[:, 1], -edges[:, 0]])
        outward = outward / np.linalg.norm(outward, axis=1, keepdims=True)
        beyond = angles @ outward.T - np.sum(outward * self.hull_rad, axis=1)
        return np.asarray((beyond <= self.margin_rad).all(axis=1))

    def _solve(self, angles: NDArray[np.float64]) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
        """Return which rows are in the domain, and their volts (clipped values for rows outside)."""
        inside = self._in_hull(angles)
        volts = np.zeros_like(angles)
        if not inside.any():
            return inside, volts
        volts[inside] = self._newton(angles[inside])
        max_v = np.array(self.max_v)
        within = (np.abs(volts) <= max_v + DAC_STEP_V).all(axis=1)
        return inside & within, np.clip(volts, -max_v, max_v)

    def _newton(self, angles: NDArray[np.float64]) -> NDArray[np.float64]:
        volts = self.inverse(angles)
        for _ in range(_NEWTON_ROUNDS):
            reached, jacobian = self.forward.value_and_jacobian(volts)
            step = np.linalg.solve(jacobian, (reached - angles)[:, :, None])[:, :, 0]
            volts = volts - step
            if float(np.max(np.abs(step))) < _NEWTON_STOP_V:
                return volts
        raise NotCalibrated(
            "the mirror model has no inverse inside its own calibrated field; calibrate the mirror again"
        )

    def _refuse(self, angles: NDArray[np.float64]) -> None:
        low, high = np.rad2deg(self.hull_rad.min(axis=0)), np.rad2deg(self.hull_rad.max(axis=0))
        ax_deg, ay_deg = (math.degrees(a) for a in angles.tolist())
        raise OutOfRange(
            f"ax {ax_deg:.2f}°, ay {ay_deg:.2f}° is beyond the calibrated field of the mirror "
            f"(ax {low[0]:.2f}° to {high[0]:.2f}°, ay {low[1]:.2f}° to {high[1]:.2f}°, corners cut); "
            "choose a direction nearer to the centre"
        )
