"""Prediction of a mirror's volts for a gaze from the looks so far, for steering during the sweep alone.

It is a Gaussian process about the nominal gain, accurate near known gazes and nominal far from them. The
calibration is fitted to the sweep without it.
"""

import math

import numpy as np
from numpy.typing import NDArray

REACH_RAD = 0.16
"""Unit of angles: about the reach of a mirror."""
OFFSET_V = 12.0
LINEAR_V = 40.0
"""Prior standard deviation of gain and cross-coupling at the reach."""
SATURATION_V = 25.0
"""Prior standard deviation of saturation; its length scale follows, as a share of the reach."""
SATURATION_LENGTH = 0.8
MEASURED_SIGMA_V = 0.05
"""Standard error of a gaze measured on a marker."""
LOCATED_SIGMA_V = 1.0
"""Standard error of a gaze found in the wide view: about two of its pixels."""
KNOCKED_V, KNOCKED_SIGMAS = 1.0, 6.0
"""A knock is detected when a marker is off its expected volts by more than this plus this many sigmas."""
BEFORE_KNOCK_SIGMA_V = 0.5
"""Standard error of gazes from before a knock after they are shifted, because a roll remains."""
MIN_KNOWN = 3
"""Minimum number of gazes that determine the gain."""
SURPRISE_V = 8.0
SURPRISE_V_PER_RAD = math.degrees(4.0)
"""A match in the wide view farther than this from the expected position is a similar, wrong one."""
SLOPE_STEP_RAD = 1e-3


class EyePrediction:
    """Prediction from pairs of gaze and volts; provisional pairs are dropped once a measured one is added."""

    def __init__(self, rad_per_v: tuple[float, float]) -> None:
        self._nominal = np.array([1.0 / rad_per_v[0], 1.0 / rad_per_v[1]])
        self._gazes = np.empty((0, 2))
        self._excess = np.empty((0, 2))
        self._sigma_v = np.empty(0)
        self._answer: NDArray[np.float64] | None = None

    @property
    def count(self) -> int:
        """Number of pairs, provisional ones included."""
        return len(self._gazes)

    def learn(self, gaze_rad: NDArray[np.float64], volts_v: NDArray[np.float64]) -> None:
        """Add a gaze, (2,) rad, that was measured on a marker under volts, (2,)."""
        self.drop_provisional()
        self._shift_after_knock(gaze_rad, volts_v)
        self._add(gaze_rad, volts_v, MEASURED_SIGMA_V)

    def _shift_after_knock(self, gaze_rad: NDArray[np.float64], volts_v: NDArray[np.float64]) -> None:
        """Shift the known pairs if a new one shows a knock of the mount; else no volts would fit both."""
        if self.count < MIN_KNOWN:
            return
        beside_v = volts_v - self.volts(gaze_rad)
        if np.abs(beside_v).max() > KNOCKED_V + KNOCKED_SIGMAS * self._error_v(gaze_rad):
            self._excess = self._excess + beside_v
            self._sigma_v = np.maximum(self._sigma_v, BEFORE_KNOCK_SIGMA_V)
            self._answer = None

    def _error_v(self, gaze_rad: NDArray[np.float64]) -> float:
        """Return the standard error of the volts for a gaze."""
        here, beside = gaze_rad[None], _kernel(gaze_rad[None], self._gazes)[0]
        known = float(beside @ np.linalg.solve(self._matrix(), beside))
        return math.sqrt(max(0.0, float(_kernel(here, here)[0, 0]) - known))

    def _matrix(self) -> NDArray[np.float64]:
        return np.asarray(_kernel(self._gazes, self._gazes) + np.diag(self._sigma_v**2))

    def add_provisional(self, gaze_rad: NDArray[np.float64], volts_v: NDArray[np.float64]) -> bool:
        """Add a gaze found in the wide view provisionally; return False when it is implausible."""
        beside_v = float(np.abs(self.volts(gaze_rad) - volts_v).max())
        if beside_v > SURPRISE_V + SURPRISE_V_PER_RAD * self.nearest_rad(gaze_rad):
            return False
        self._add(gaze_rad, volts_v, LOCATED_SIGMA_V)
        return True

    def drop_provisional(self) -> None:
        """Drop all provisional pairs."""
        known = self._sigma_v < LOCATED_SIGMA_V
        self._gazes, self._excess = self._gazes[known], self._excess[known]
        self._sigma_v, self._answer = self._sigma_v[known], None

    def _add(self, gaze_rad: NDArray[np.float64], volts_v: NDArray[np.float64], sigma_v: float) -> None:
        self._gazes = np.vstack([self._gazes, gaze_rad])
        self._excess = np.vstack([self._excess, volts_v - self._nominal * gaze_rad])
        self._sigma_v = np.append(self._sigma_v, sigma_v)
        self._answer = None

    def volts(self, gaze_rad: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the volts for a gaze, (2,) each; they may exceed the limits."""
        nominal = np.asarray(self._nominal * gaze_rad, dtype=np.float64)
        if self.count == 0:
            return nominal
        if self._answer is None:
            self._answer = np.asarray(np.linalg.solve(self._matrix(), self._excess), dtype=np.float64)
        return np.asarray(nominal + (_kernel(gaze_rad[None], self._gazes) @ self._answer)[0])

    def slope(self, gaze_rad: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the (2, 2) derivative of the volts at a gaze, V/rad; rows are the volts' axes."""
        columns = [
            (self.volts(gaze_rad + step) - self.volts(gaze_rad - step)) / (2.0 * SLOPE_STEP_RAD)
            for step in SLOPE_STEP_RAD * np.eye(2)
        ]
        return np.column_stack(columns)

    def nearest_rad(self, gaze_rad: NDArray[np.float64]) -> float:
        """Return the distance to the nearest known gaze, infinity when there is none."""
        apart = np.linalg.norm(self._gazes - gaze_rad, axis=1)
        return float(apart.min(initial=np.inf))

    def reach_rad(self, axis: int, max_v: float) -> float:
        """Return the reach of an axis by its gain at the middle; saturation reduces the real reach."""
        return float(max_v / abs(self.slope(np.zeros(2))[axis, axis]))


def _kernel(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    one, other = a / REACH_RAD, b / REACH_RAD
    apart = np.sum((one[:, None] - other[None]) ** 2, axis=2)
    bent = np.exp(-apart / (2.0 * SATURATION_LENGTH**2))
    return np.asarray(OFFSET_V**2 + LINEAR_V**2 * (one @ other.T) + SATURATION_V**2 * bent, dtype=np.float64)


def clamp_volts(volts_v: NDArray[np.float64], max_v: float) -> NDArray[np.float64]:
    """Return volts with each axis limited to ±`max_v`."""
    return np.clip(volts_v, -max_v, max_v)


def degrees(rad: float) -> str:
    """Return an angle as text, in degrees."""
    return f"{math.degrees(rad):.2f}°"
