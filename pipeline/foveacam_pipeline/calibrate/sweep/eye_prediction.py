"""Which volts bring a mirror to a gaze, guessed from the looks taken so far. Only the sweep steers by it.

A Gaussian process about the nominal gain: good beside what was seen, sober far from it. The calibration that
comes of a sweep is fitted elsewhere and knows nothing of this.
"""

import math

import numpy as np
from numpy.typing import NDArray

REACH_RAD = 0.16
"""Angles are counted in this unit: about what a mirror reaches."""
OFFSET_V = 12.0
LINEAR_V = 40.0
"""How much gain and cross-coupling may add at the reach."""
SATURATION_V = 25.0
"""How much saturation may add, and over which part of the reach it changes."""
SATURATION_LENGTH = 0.8
MEASURED_SIGMA_V = 0.05
"""What a gaze measured on a marker is good for."""
LOCATED_SIGMA_V = 1.0
"""What a gaze read off the wide view is good for: about two of its pixels."""
KNOCKED_V, KNOCKED_SIGMAS = 1.0, 6.0
"""A marker seen farther than this from where it was expected: the mount was knocked."""
BEFORE_KNOCK_SIGMA_V = 0.5
"""What gazes from before a knock are good for once they are moved along: a roll is left in them."""
MIN_KNOWN = 3
"""So many gazes tell the gain; with fewer nothing is expected for sure."""
SURPRISE_V = 8.0
SURPRISE_V_PER_RAD = math.degrees(4.0)
"""A place in the wide view that is farther off than this from what was expected is another, alike."""
SLOPE_STEP_RAD = 1e-3


class EyePrediction:
    """Learns from pairs of gaze and volts; what is only supposed is forgotten once something is known."""

    def __init__(self, rad_per_v: tuple[float, float]) -> None:
        self._nominal = np.array([1.0 / rad_per_v[0], 1.0 / rad_per_v[1]])
        self._gazes = np.empty((0, 2))
        self._excess = np.empty((0, 2))
        self._sigma_v = np.empty(0)
        self._answer: NDArray[np.float64] | None = None

    @property
    def count(self) -> int:
        """How many pairs it has learnt from, supposed ones included."""
        return len(self._gazes)

    def learn(self, gaze_rad: NDArray[np.float64], volts_v: NDArray[np.float64]) -> None:
        """Take note of a gaze, (2,) rad, that was measured on a marker under volts, (2,)."""
        self.forget()
        self._follow(gaze_rad, volts_v)
        self._add(gaze_rad, volts_v, MEASURED_SIGMA_V)

    def _follow(self, gaze_rad: NDArray[np.float64], volts_v: NDArray[np.float64]) -> None:
        """Move along what was learnt before the mount was knocked: else no volts would suit both."""
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

    def suppose(self, gaze_rad: NDArray[np.float64], volts_v: NDArray[np.float64]) -> bool:
        """Take note for now of a gaze read off the wide view; return False when it cannot be true."""
        beside_v = float(np.abs(self.volts(gaze_rad) - volts_v).max())
        if beside_v > SURPRISE_V + SURPRISE_V_PER_RAD * self.nearest_rad(gaze_rad):
            return False
        self._add(gaze_rad, volts_v, LOCATED_SIGMA_V)
        return True

    def forget(self) -> None:
        """Forget what was supposed."""
        known = self._sigma_v < LOCATED_SIGMA_V
        self._gazes, self._excess = self._gazes[known], self._excess[known]
        self._sigma_v, self._answer = self._sigma_v[known], None

    def _add(self, gaze_rad: NDArray[np.float64], volts_v: NDArray[np.float64], sigma_v: float) -> None:
        self._gazes = np.vstack([self._gazes, gaze_rad])
        self._excess = np.vstack([self._excess, volts_v - self._nominal * gaze_rad])
        self._sigma_v = np.append(self._sigma_v, sigma_v)
        self._answer = None

    def volts(self, gaze_rad: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the volts for a gaze, (2,) each; they may be beyond what is allowed."""
        nominal = np.asarray(self._nominal * gaze_rad, dtype=np.float64)
        if self.count == 0:
            return nominal
        if self._answer is None:
            self._answer = np.asarray(np.linalg.solve(self._matrix(), self._excess), dtype=np.float64)
        return np.asarray(nominal + (_kernel(gaze_rad[None], self._gazes) @ self._answer)[0])

    def slope(self, gaze_rad: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (2, 2) volts a radian at a gaze; rows are the volts' axes."""
        columns = [
            (self.volts(gaze_rad + step) - self.volts(gaze_rad - step)) / (2.0 * SLOPE_STEP_RAD)
            for step in SLOPE_STEP_RAD * np.eye(2)
        ]
        return np.column_stack(columns)

    def nearest_rad(self, gaze_rad: NDArray[np.float64]) -> float:
        """Return how far the nearest gaze lies that it has learnt from, infinity when there is none."""
        apart = np.linalg.norm(self._gazes - gaze_rad, axis=1)
        return float(apart.min(initial=np.inf))

    def reach_rad(self, axis: int, max_v: float) -> float:
        """Return what an axis would reach with its gain about the middle; it saturates, and reaches less."""
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
    """Return an angle for a sentence."""
    return f"{math.degrees(rad):.2f}°"
