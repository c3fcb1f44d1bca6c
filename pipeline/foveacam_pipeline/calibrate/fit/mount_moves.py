"""How far the mounts were moved between runs of the procedures: sessions before and after a rig was carried.

`mount_drift_fit` compares measurements of one node about a model of the mirror that all runs share, which is
right for moves of some pixels. Larger ones bend that model. Here mirror, pivot and one turn a run are fitted
together and the turns taken out exactly, again and again, until what is left is small.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.calibrate.fit.mount_drift_fit import (
    GAZE_NOISE_RAD,
    PIVOT_PRIOR_M,
    PIVOT_UNKNOWNS,
    motion_columns,
)
from foveacam_pipeline.geometry.polynomial import huber_weights, monomials

MIN_MOVE_RAD = math.radians(0.01)
"""Moves up to this much are drift, some fovea px."""
MOVE_SIGMAS = 5.0
"""Two runs at one distance each cannot tell a move from a pivot beside its place: the errors are large."""
MAX_MIRROR_ORDER = 7
ROWS_AN_UNKNOWN = 3
MOVE_ROUNDS = 4
_ROBUST_ROUNDS = 3
TURNS = 3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MountMoves:
    """(runs, 3) the turn about x, y and z of each run against the last one, to first order, and its error."""

    turn_rad: NDArray[np.float64]
    sigma_rad: NDArray[np.float64]

    @property
    def far(self) -> bool:
        """Whether any is more than drift, and surely so."""
        least_rad = np.maximum(MIN_MOVE_RAD, MOVE_SIGMAS * self.sigma_rad)
        return bool((np.abs(self.turn_rad) > least_rad).any())


def fit_moves(
    volts_v: NDArray[np.float64],
    angles_rad: NDArray[np.float64],
    depth_m: NDArray[np.float64],
    run: NDArray[np.int64],
) -> MountMoves:
    """Return how each run's mount stands turned against the last one's.

    `volts_v`, `angles_rad`: (n, 2); `depth_m`: (n,) of the target; `run`: (n,) numbered from 0.
    """
    runs = int(run.max()) + 1
    mirror = mirror_columns(volts_v)
    member = (run[:, None] == np.arange(runs - 1)).astype(np.float64)
    matrix = np.hstack([both_axes(mirror), motion_columns(angles_rad, depth_m, turns=member, rolls=member)])
    found, sigmas = _solve_moves(matrix, angles_rad.T.ravel(), pivot=2 * mirror.shape[1])
    turns, errors = (
        np.vstack([part[-TURNS * (runs - 1) :].reshape(TURNS, runs - 1).T, np.zeros(TURNS)])
        for part in (found, sigmas)
    )
    return MountMoves(turn_rad=turns, sigma_rad=errors)


def mirror_columns(volts_v: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n, k) the powers of the drive, of the highest order that the rows can bear."""
    scaled = volts_v / np.abs(volts_v).max()
    order, unknowns = MAX_MIRROR_ORDER, len(volts_v) // ROWS_AN_UNKNOWN
    while order > 1 and (order + 1) * (order + 2) // 2 > unknowns:
        order -= 1
    return monomials(scaled[:, 0], scaled[:, 1], order)


def both_axes(columns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (2 n, 2 k) the same (n, k) columns for ax, then for ay, each with unknowns of its own."""
    nothing = np.zeros_like(columns)
    return np.vstack([np.hstack([columns, nothing]), np.hstack([nothing, columns])])


def _solve_moves(
    matrix: NDArray[np.float64], values: NDArray[np.float64], *, pivot: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the unknowns and their errors by robust least squares; from `pivot` on come the pivot's."""
    prior = np.zeros((PIVOT_UNKNOWNS, matrix.shape[1]))
    prior[:, pivot : pivot + PIVOT_UNKNOWNS] = np.eye(PIVOT_UNKNOWNS) * (GAZE_NOISE_RAD / PIVOT_PRIOR_M)
    weights = np.ones(len(values))
    for _ in range(_ROBUST_ROUNDS):
        root = np.sqrt(weights)
        rows = np.vstack([matrix * root[:, None], prior])
        found = np.linalg.lstsq(rows, np.concatenate([values * root, np.zeros(PIVOT_UNKNOWNS)]), rcond=None)[
            0
        ]
        left = values - matrix @ found
        weights = huber_weights(left)
    free = max(1, len(values) - matrix.shape[1])
    sigma = max(GAZE_NOISE_RAD, math.sqrt(float(np.sum(weights * left**2)) / free))
    variance = sigma**2 * np.diag(np.linalg.pinv(rows.T @ rows))
    return np.asarray(found, dtype=np.float64), np.sqrt(variance)
