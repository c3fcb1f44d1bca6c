"""How an eye's mount drifted while it was being calibrated, and what its measurements would be at the end.

A small turn about the rig's x, y and z (roll) against time, zero at the end of the last run; linear between
knots. `mount_drift_fit` estimates it.
"""

import math
from collections.abc import Collection
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.calibrate.drift.values import EyeTurn

S_PER_MIN = 60.0
LEAST_KNOCK_RAD = math.radians(0.004)
"""Steps up to this much, two fovea px, are left to the drift."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DriftRun:
    """One run of the procedures, in which times are comparable.

    `knots_s`: (k,) times, increasing. `turn_rad`: (k, 3) turns at the knots against the reference moment,
    rig axes, linear in between. `sigma_rad`: (k, 2) standard errors of the turns about x and y. `knocked`:
    whether a knock ended it; what was measured after that is the next run.
    """

    knots_s: NDArray[np.float64]
    turn_rad: NDArray[np.float64]
    sigma_rad: NDArray[np.float64]
    knocked: bool = False

    def at(self, t_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (n, 3) turns at (n,) times."""
        turns = [np.interp(t_s, self.knots_s, column) for column in self.turn_rad.T]
        return np.column_stack(turns)

    @property
    def minutes(self) -> float:
        """How long it lasted."""
        return float(self.knots_s[-1] - self.knots_s[0]) / S_PER_MIN


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MountDrift:
    """The drift of one eye during a calibration, all runs, the reference moment at the end of the last one.

    `sigma_rad`: standard error, across and down, of what was taken out of a pose on the average.
    `pivot_sigma_m`: what the uncertainty of the drift, and of all else, leaves of where the gaze leaves.
    `visits`: how many measurements repeat a node.
    """

    runs: tuple[DriftRun, ...]
    sigma_rad: tuple[float, float]
    pivot_sigma_m: float
    visits: int

    @property
    def minutes(self) -> float:
        """How long the runs lasted together."""
        return sum(run.minutes for run in self.runs)

    @property
    def pieces(self) -> int:
        """Into how many straight pieces the drift is parted."""
        return sum(len(run.knots_s) - 1 for run in self.runs)

    @property
    def moved_rad(self) -> float:
        """How far the gaze was from where it stood at the end, at most."""
        return max(float(np.linalg.norm(run.turn_rad[:, :2], axis=1).max()) for run in self.runs)

    @property
    def rad_per_minute(self) -> float:
        """How fast the gaze moved on the average, while it was watched."""
        path_rad = sum(
            float(np.linalg.norm(np.diff(run.turn_rad[:, :2], axis=0), axis=1).sum()) for run in self.runs
        )
        return path_rad / self.minutes if self.minutes > 0.0 else 0.0

    @property
    def wander_rad(self) -> tuple[float, float]:
        """Standard deviation of the gaze in time, across and down, over the longest run."""
        run = max(self.runs, key=lambda run: run.minutes)
        turns = run.at(np.linspace(run.knots_s[0], run.knots_s[-1], 64))
        return float(turns[:, 1].std()), float(turns[:, 0].std())

    @property
    def knocks_rad(self) -> tuple[float, ...]:
        """How far the gaze jumped at each knock; the other eye's mount may have been the one that was hit."""
        steps = (
            float(np.linalg.norm(after.turn_rad[0, :2] - before.turn_rad[-1, :2]))
            for before, after in pairwise(self.runs)
            if before.knocked
        )
        return tuple(step for step in steps if step > LEAST_KNOCK_RAD)

    def knocked_after(self, ended: Collection[int]) -> "MountDrift":
        """Return the same, the runs of these numbers ended by a knock."""
        runs = (replace(run, knocked=number in ended) for number, run in enumerate(self.runs))
        return replace(self, runs=tuple(runs))

    def moved_by(self, turns_rad: NDArray[np.float64]) -> "MountDrift":
        """Return the same with each run turned by (runs, 3) more: a mount that was moved between them."""
        runs = (
            replace(run, turn_rad=run.turn_rad + turn) for run, turn in zip(self.runs, turns_rad, strict=True)
        )
        return replace(self, runs=tuple(runs))

    @property
    def stated_rad(self) -> tuple[float, float]:
        """What a calibration states of the mount, across and down.

        The error of the drift that was taken out, and the wandering itself: what a mount did while it was
        watched it goes on doing.
        """
        (own_x, own_y), (wander_x, wander_y) = self.sigma_rad, self.wander_rad
        return math.hypot(own_x, wander_x), math.hypot(own_y, wander_y)


def turn_back(
    angles_rad: NDArray[np.float64],
    plane_px: NDArray[np.float64],
    turns_rad: NDArray[np.float64],
    *,
    f_px: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return gazes (n, 2) and corners (n, m, 2) as they were if the mount had not turned by (n, 3).

    The corners lie on the virtual pinhole's plane, px from the gaze; both turn with the eye.
    """
    gazes, corners = np.empty_like(angles_rad), np.empty_like(plane_px)
    for i, turn in enumerate(turns_rad):
        x_rad, y_rad, roll_rad = (-turn).tolist()
        back = EyeTurn(turn_rad=(x_rad, y_rad, roll_rad))
        tangents = np.tan(angles_rad[i])
        moved = back.apply(np.vstack([tangents, tangents + plane_px[i] / f_px]))
        gazes[i] = np.arctan(moved[0])
        corners[i] = f_px * (moved[1:] - moved[0])
    return gazes, corners
