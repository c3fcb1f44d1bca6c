"""Samples of a calibration sweep as arrays, and the drift of the eyes' mounts during it.

A sample has volts, direction, and corners of a flat target facing the rig. The drift of a mount is a small
turn about the rig's x, y and z (roll) over time, linear between knots, zero at the end of the last run;
`mount_drift` estimates it.
"""

import math
from collections.abc import Collection
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.drift.values import EyeTurn
from foveacam_pipeline.geometry.shapes import as_finite_rows
from foveacam_pipeline.models.intrinsics import Intrinsics

S_PER_MIN = 60.0
LEAST_KNOCK_RAD = math.radians(0.004)
"""Smaller steps, up to two fovea px, are described by the drift."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DriftRun:
    """Drift during one run of the procedures, within which times are comparable.

    `knots_s`: (k,) times, increasing. `turn_rad`: (k, 3) turns at the knots against the reference moment,
    rig axes, linear in between. `sigma_rad`: (k, 2) standard errors of the turns about x and y. `knocked`:
    whether a knock ended it; the measurements after the knock form the next run.
    """

    knots_s: NDArray[np.float64]
    turn_rad: NDArray[np.float64]
    sigma_rad: NDArray[np.float64]
    knocked: bool = False

    def at(self, t_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the (n, 3) turns at (n,) times."""
        turns = [np.interp(t_s, self.knots_s, column) for column in self.turn_rad.T]
        return np.column_stack(turns)

    @property
    def minutes(self) -> float:
        """Duration."""
        return float(self.knots_s[-1] - self.knots_s[0]) / S_PER_MIN


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MountDrift:
    """The drift of one eye during a calibration, all runs, against the end of the last one.

    `sigma_rad`: standard error, across and down, of the mean correction of a pose. `pivot_sigma_m`: standard
    error of the pivot, from the drift and everything else. `visits`: number of measurements that repeat a
    node.
    """

    runs: tuple[DriftRun, ...]
    sigma_rad: tuple[float, float]
    pivot_sigma_m: float
    visits: int

    @property
    def minutes(self) -> float:
        """Total duration of the runs."""
        return sum(run.minutes for run in self.runs)

    @property
    def pieces(self) -> int:
        """Number of straight pieces of the drift."""
        return sum(len(run.knots_s) - 1 for run in self.runs)

    @property
    def moved_rad(self) -> float:
        """Largest distance of the gaze from its direction at the end."""
        return max(float(np.linalg.norm(run.turn_rad[:, :2], axis=1).max()) for run in self.runs)

    @property
    def rad_per_minute(self) -> float:
        """Mean speed of the gaze during the runs."""
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
        """Steps of the gaze at the knocks, without those of the other eye's mount alone."""
        steps = (
            float(np.linalg.norm(after.turn_rad[0, :2] - before.turn_rad[-1, :2]))
            for before, after in pairwise(self.runs)
            if before.knocked
        )
        return tuple(step for step in steps if step > LEAST_KNOCK_RAD)

    def with_knocks(self, ended: Collection[int]) -> "MountDrift":
        """Return the same drift with the runs of these numbers marked as ended by a knock."""
        runs = (replace(run, knocked=number in ended) for number, run in enumerate(self.runs))
        return replace(self, runs=tuple(runs))

    def with_moves(self, turns_rad: NDArray[np.float64]) -> "MountDrift":
        """Return the same drift with a turn (runs, 3) added to each run: the mount was moved between them."""
        runs = (
            replace(run, turn_rad=run.turn_rad + turn) for run, turn in zip(self.runs, turns_rad, strict=True)
        )
        return replace(self, runs=tuple(runs))

    @property
    def stated_rad(self) -> tuple[float, float]:
        """Standard error that a calibration states for the mount, across and down.

        It combines the error of the correction and the drift itself, which is assumed to continue.
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
    """Return gazes (n, 2) and corners (n, m, 2) turned back by the mount's turns (n, 3).

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
