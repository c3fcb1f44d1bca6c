"""Estimate of the drift of the eyes' mounts and of moves between runs, from nodes that were visited again.

Measurements of one node are compared with each other, because the errors of a mirror model change with the
row and so with time. Pivot and drift are fitted together, because two stations differ in both. `fit_moves`
first finds turns between runs that are too large for this.
"""

import logging
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.fit.mirror_models import ORDERS
from foveacam_pipeline.calibrate.fit.samples import DriftRun, MountDrift, turn_back
from foveacam_pipeline.calibrate.robust_least_squares import ResidualModel, fit_reweighted
from foveacam_pipeline.geometry.polynomial import (
    BivariatePolynomial,
    fit_best_order,
    huber_weights,
    least_squares,
    monomials,
)

MAX_PIECES = 8
SHORTEST_S = 15.0
"""Duration below which a run is assumed to be free of drift."""
MIN_VISITS = 4
"""Minimum number of repeated nodes for an estimate."""
PRIOR_RAD = math.radians(0.005)
"""Prior standard deviation of a mount's turn between two moments (deduced: some fovea px)."""
PIVOT_PRIOR_M = 5e-3
GAZE_NOISE_RAD = 2e-6
"""Standard error of one gaze measurement: some hundredths of a fovea px."""
MIRROR_MODEL_ERROR = 0.005
"""Relative error of the preliminary mirror model over the distance of a gaze from its node."""
MIN_SIGMA_RAD = 1e-7
PIVOT_UNKNOWNS = 6
"""Unknowns of the pivot: its (x, y) offset from the reference point, and the change of each with either
tangent. The depth of a pivot is one of those four changes; a lens off the mirror's middle causes all four,
and a model with three unknowns would leave 0.3 fovea px between 5 and 2.5 m, which change with the row and so
with time."""
_ROUNDS = 8
_ORDER_ROUNDS = 2

MIN_MOVE_RAD = math.radians(0.01)
"""Moves below this, some fovea px, are described by the drift."""
MOVE_SIGMAS = 5.0
"""Significance of a move that is removed: with one distance a run, move and pivot are hardly separable."""
MAX_MIRROR_ORDER = 7
ROWS_AN_UNKNOWN = 3
MOVE_ROUNDS = 4
_ROBUST_ROUNDS = 3
TURNS = 3

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DriftSamples:
    """n measurements of one eye: (n, 2) volts and gazes, (n,) depths of the target, times and runs.

    `run`: (n,) int, numbered in the order of time. `visit`: (n,) bool, whether it repeats a node. `group`:
    (n,) int, measurements with the same number had the same gaze.
    """

    volts_v: NDArray[np.float64]
    angles_rad: NDArray[np.float64]
    depth_m: NDArray[np.float64]
    t_s: NDArray[np.float64]
    run: NDArray[np.int64]
    visit: NDArray[np.bool_]
    group: NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DriftKnots:
    """Knots of the drift: for each run the (k,) times for the turn about x and y, and for the roll."""

    turns: tuple[NDArray[np.float64], ...]
    rolls: tuple[NDArray[np.float64], ...]

    def basis(self, samples: DriftSamples, which: tuple[NDArray[np.float64], ...]) -> NDArray[np.float64]:
        """Return the (n, knots - 1) linear weights of all knots but the last one at the samples."""
        columns = []
        for number, knots in enumerate(which):
            mine = samples.run == number
            for unit in np.eye(len(knots)):
                columns.append(np.where(mine, np.interp(samples.t_s, knots, unit), 0.0))
        return np.column_stack(columns)[:, :-1]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _DriftSolution:
    """Solution for one eye: `turns` (knots - 1, 2) about x and y, `rolls` (knots - 1,).

    `covariance`: of pivot, turns, rolls. `criterion`: Bayesian information criterion of the knots.
    """

    turns: NDArray[np.float64]
    rolls: NDArray[np.float64]
    covariance: NDArray[np.float64]
    criterion: float


def fit_mount_drift(samples: Mapping[Role, DriftSamples]) -> dict[Role, MountDrift] | None:
    """Return the drift of both eyes, or None where too few nodes were visited again.

    The number of pieces is chosen by the information criterion.
    """
    if not has_enough_visits(samples):
        return None
    straight = dict(samples)
    for _ in range(_ORDER_ROUNDS):
        mirrors = {role: _preliminary_mirror(straight[role]) for role in samples}
        choices = [place_knots(list(samples.values()), pieces) for pieces in range(1, MAX_PIECES + 1)]
        solved = [
            {role: _solve_drift(eye, mirrors[role], knots) for role, eye in samples.items()}
            for knots in choices
        ]
        best = int(np.argmin([sum(eye.criterion for eye in both.values()) for both in solved]))
        found = {role: _drift(eye, solved[best][role], choices[best]) for role, eye in samples.items()}
        straight = {role: _without_drift(eye, found[role]) for role, eye in samples.items()}
    for role, drift in found.items():
        logger.info(
            "%s mount: %.4f deg from the end at most, %.4f deg a minute, %d pieces",
            role,
            math.degrees(drift.moved_rad),
            math.degrees(drift.rad_per_minute),
            drift.pieces,
        )
    return found


def has_enough_visits(samples: Mapping[Role, DriftSamples]) -> bool:
    """Return whether enough nodes were visited again to estimate drift."""
    return min(int(eye.visit.sum()) for eye in samples.values()) >= MIN_VISITS


def _preliminary_mirror(samples: DriftSamples) -> BivariatePolynomial:
    """Return a preliminary mirror model, for the small differences within a group."""
    return fit_best_order(samples.volts_v, samples.angles_rad, orders=ORDERS).polynomial


def _without_drift(samples: DriftSamples, drift: MountDrift) -> DriftSamples:
    turns = turns_at(drift, samples.t_s, samples.run)
    nothing = np.empty((len(turns), 0, 2))
    return replace(samples, angles_rad=turn_back(samples.angles_rad, nothing, turns, f_px=1.0)[0])


def turns_at(drift: MountDrift, t_s: NDArray[np.float64], run: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the (n, 3) turns at (n,) times of (n,) runs."""
    turns = np.zeros((len(t_s), 3))
    for number, mine in enumerate(drift.runs):
        rows = run == number
        turns[rows] = mine.at(t_s[rows])
    return turns


def place_knots(eyes: list[DriftSamples], pieces: int) -> DriftKnots:
    """Return knots that divide the longest run into `pieces`, and the others into pieces as long."""
    times = np.concatenate([eye.t_s for eye in eyes])
    run = np.concatenate([eye.run for eye in eyes])
    visit = np.concatenate([eye.visit for eye in eyes])
    spans = [(times[run == k].min(), times[run == k].max()) for k in range(int(run.max()) + 1)]
    piece_s = max(SHORTEST_S, max(end - begin for begin, end in spans) / pieces)
    turns, rolls = [], []
    for k, (begin, end) in enumerate(spans):
        still = end - begin < SHORTEST_S or int(visit[run == k].sum()) < MIN_VISITS
        count = 0 if still else max(1, round((end - begin) / piece_s))
        turns.append(np.linspace(begin, end, count + 1) if count else np.array([end]))
        rolls.append(np.array([end]) if still else np.array([begin, end]))
    return DriftKnots(turns=tuple(turns), rolls=tuple(rolls))


def _solve_drift(samples: DriftSamples, mirror: BivariatePolynomial, knots: DriftKnots) -> _DriftSolution:
    """Fit pivot and drift by robust least squares; the gaze of every node is projected out.

    The rounds stay by hand: scipy's least squares with a gaze a node as unknowns took 40 times as long on the
    sweeps of the tests (150 ms for 4 ms, 32 times a fit), and its drift was within 1.3 sigma.
    """
    matrix = motion_columns(
        samples.angles_rad,
        samples.depth_m,
        turns=knots.basis(samples, knots.turns),
        rolls=knots.basis(samples, knots.rolls),
    )
    values = (samples.angles_rad - mirror(samples.volts_v)).T.ravel()
    nodes = _node_numbers(samples)
    moved = matrix.shape[1] - PIVOT_UNKNOWNS
    prior = np.diag(
        np.concatenate([np.full(PIVOT_UNKNOWNS, PIVOT_PRIOR_M**-2), np.full(moved, PRIOR_RAD**-2)])
    )
    trust = _model_weights(samples)
    weights, sigma = trust, GAZE_NOISE_RAD
    free = max(1, len(values) - int(nodes.max()) - 1 - matrix.shape[1])
    for _ in range(_ROUNDS):
        own, seen = (
            _minus_node_means(matrix, nodes, weights),
            _minus_node_means(values[:, None], nodes, weights)[:, 0],
        )
        normal = (own * weights[:, None]).T @ own / sigma**2 + prior
        unknowns = np.linalg.solve(normal, own.T @ (weights * seen) / sigma**2)
        left = seen - own @ unknowns
        weights = trust * huber_weights(left * np.sqrt(trust))
        sigma = max(MIN_SIGMA_RAD, math.sqrt(float(np.sum(weights * left**2)) / free))
    rolls = sum(len(run) for run in knots.rolls) - 1
    found = np.asarray(unknowns[PIVOT_UNKNOWNS:], dtype=np.float64)
    return _DriftSolution(
        turns=found[: moved - rolls].reshape(2, -1).T,
        rolls=found[moved - rolls :],
        covariance=np.asarray(np.linalg.inv(normal), dtype=np.float64),
        criterion=2.0 * len(values) * math.log(sigma) + moved * math.log(len(values)),
    )


def _node_numbers(samples: DriftSamples) -> NDArray[np.int64]:
    """Return the (2 n,) numbers of each row's node and axis."""
    _, number = np.unique(samples.group, return_inverse=True)
    return np.concatenate([number, number + int(number.max()) + 1]).astype(np.int64)


def _minus_node_means(
    rows: NDArray[np.float64], nodes: NDArray[np.int64], weights: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the (2 n, k) rows minus the weighted mean of their node."""
    member = np.zeros((int(nodes.max()) + 1, len(nodes)))
    member[nodes, np.arange(len(nodes))] = weights
    means = (member @ rows) / member.sum(axis=1)[:, None]
    return np.asarray(rows - means[nodes], dtype=np.float64)


def _model_weights(samples: DriftSamples) -> NDArray[np.float64]:
    """Return (2 n,) weights, lower for gazes away from their node, which rely on the mirror model."""
    aside_rad = np.zeros(len(samples.group))
    nodes, times_seen = np.unique(samples.group, return_counts=True)
    for node in nodes[times_seen > 1]:
        mine = samples.group == node
        middle = np.median(samples.angles_rad[mine], axis=0)
        aside_rad[mine] = np.linalg.norm(samples.angles_rad[mine] - middle, axis=1)
    weights = 1.0 / (1.0 + (MIRROR_MODEL_ERROR * aside_rad / GAZE_NOISE_RAD) ** 2)
    return np.tile(weights, 2)


def motion_columns(
    angles_rad: NDArray[np.float64],
    depth_m: NDArray[np.float64],
    *,
    turns: NDArray[np.float64],
    rolls: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the (2 n, unknowns) derivatives of ax, then ay, by the pivot, by turns about x and y, by rolls.

    `angles_rad`: (n, 2). `depth_m`: (n,). `turns`, `rolls`: (n, k) weights of their unknowns at the samples.
    """
    tangents = np.tan(angles_rad)
    flatter = 1.0 / (1.0 + tangents**2)
    x, y = tangents.T[:, :, None]
    leaves = np.column_stack([np.ones(len(tangents)), tangents]) / depth_m[:, None]
    nothing = np.zeros_like(leaves)
    across = np.hstack([flatter[:, :1] * leaves, nothing])
    down = np.hstack([nothing, flatter[:, 1:] * leaves])
    # a turn w moves the ray d by w x d, and its tangents by (w_y (1 + x²) - w_x x y - w_z y, ...)
    by_ax = [flatter[:, :1] * slope for slope in (-x * y * turns, (1.0 + x**2) * turns, -y * rolls)]
    by_ay = [flatter[:, 1:] * slope for slope in (-(1.0 + y**2) * turns, x * y * turns, x * rolls)]
    return np.vstack([np.hstack([across, *by_ax]), np.hstack([down, *by_ay])])


def _drift(samples: DriftSamples, solved: _DriftSolution, knots: DriftKnots) -> MountDrift:
    turns = np.vstack([solved.turns, np.zeros(2)])
    rolls = np.append(solved.rolls, 0.0)
    count = len(solved.turns)
    variance = np.diag(solved.covariance)[PIVOT_UNKNOWNS : PIVOT_UNKNOWNS + 2 * count].reshape(2, -1).T
    sigmas = np.sqrt(np.vstack([variance, np.zeros(2)]))
    runs, begin, rolled = [], 0, 0
    for mine, roll in zip(knots.turns, knots.rolls, strict=True):
        own = slice(begin, begin + len(mine))
        along = np.interp(mine, roll, rolls[rolled : rolled + len(roll)])
        turn = np.column_stack([turns[own], along])
        runs.append(DriftRun(knots_s=mine, turn_rad=turn, sigma_rad=sigmas[own]))
        begin, rolled = own.stop, rolled + len(roll)
    # the mean correction over all poses: an error of it turns the whole calibration
    mean = knots.basis(samples, knots.turns)[~samples.visit].mean(axis=0)
    about = [slice(PIVOT_UNKNOWNS + axis * count, PIVOT_UNKNOWNS + (axis + 1) * count) for axis in (0, 1)]
    sigma = [math.sqrt(float(mean @ solved.covariance[part, part] @ mean)) for part in about]
    pivot = np.diag(solved.covariance)[[0, PIVOT_UNKNOWNS // 2]]
    return MountDrift(
        runs=tuple(runs),
        sigma_rad=(sigma[1], sigma[0]),
        pivot_sigma_m=math.sqrt(float(pivot.max())),
        visits=int(samples.visit.sum()),
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MountMoves:
    """(runs, 3) turns about x, y and z of each run against the last one, to first order, and their errors."""

    turn_rad: NDArray[np.float64]
    sigma_rad: NDArray[np.float64]

    @property
    def significant(self) -> bool:
        """Whether any turn is larger than drift, and significantly so."""
        least_rad = np.maximum(MIN_MOVE_RAD, MOVE_SIGMAS * self.sigma_rad)
        return bool((np.abs(self.turn_rad) > least_rad).any())


def fit_moves(
    volts_v: NDArray[np.float64],
    angles_rad: NDArray[np.float64],
    depth_m: NDArray[np.float64],
    run: NDArray[np.int64],
) -> MountMoves:
    """Fit one turn of the mount a run together with mirror and pivot.

    `fit_mount_drift` uses one mirror model for all runs, which large moves would distort; the caller removes
    these turns exactly and repeats the fit until the rest is small. `volts_v`, `angles_rad`: (n, 2);
    `depth_m`: (n,) of the target; `run`: (n,) numbered from 0.
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
    """Return the (n, k) monomials of the drive, of the highest order that the number of rows allows."""
    scaled = volts_v / np.abs(volts_v).max()
    order, unknowns = MAX_MIRROR_ORDER, len(volts_v) // ROWS_AN_UNKNOWN
    while order > 1 and (order + 1) * (order + 2) // 2 > unknowns:
        order -= 1
    return monomials(scaled[:, 0], scaled[:, 1], order)


def both_axes(columns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (2 n, 2 k): the (n, k) columns for ax, then for ay, each with its own unknowns."""
    nothing = np.zeros_like(columns)
    return np.vstack([np.hstack([columns, nothing]), np.hstack([nothing, columns])])


def _solve_moves(
    matrix: NDArray[np.float64], values: NDArray[np.float64], *, pivot: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the unknowns and their errors by robust least squares; `pivot`: index of the pivot's first."""
    prior = np.zeros((PIVOT_UNKNOWNS, matrix.shape[1]))
    prior[:, pivot : pivot + PIVOT_UNKNOWNS] = np.eye(PIVOT_UNKNOWNS) * (GAZE_NOISE_RAD / PIVOT_PRIOR_M)
    rows = np.vstack([matrix, prior])
    aims = np.concatenate([values, np.zeros(PIVOT_UNKNOWNS)])

    def weights(residuals: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.append(huber_weights(residuals[: len(values)]), np.ones(PIVOT_UNKNOWNS))

    model = ResidualModel(residuals=lambda unknowns: rows @ unknowns - aims, jacobian=lambda _: rows)
    fit = fit_reweighted(model, least_squares(rows, aims), weights=weights, rounds=_ROBUST_ROUNDS - 1)
    left = values - matrix @ fit.terms
    free = max(1, len(values) - matrix.shape[1])
    sigma = max(GAZE_NOISE_RAD, math.sqrt(float(np.sum(huber_weights(left) * left**2)) / free))
    return fit.terms, sigma * np.sqrt(np.diag(fit.covariance()))
