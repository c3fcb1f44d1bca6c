"""Residuals of a mirror sweep, divided by cause: rounding, what both eyes share, and what is an eye's own.

Two mirrors with drives of their own cannot err alike, so errors that both eyes share belong to the target's
pose or to what all mirrors of a kind have. The shared part is divided by scan direction, order of visit, and
position in the scan.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri, fdtrc

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.fit.mirror_models import MirrorModelFamily, MirrorScore, fit_mirror_models
from foveacam_pipeline.geometry.polynomial import PolynomialFit, fit_polynomial

FOVEA_FOCAL_PX = 28_760.0  # Table 2: 2.86 deg over 1440 px
ORDER = 5
"""Order of the mirrors' law in the division; simulated mirrors leave 1.3 fovea px of it, the cubic 10."""
LEAST_POSES = 63
"""Three for each of its coefficients."""
ROUNDING_TRIALS = 60
BOUND_P = 0.05
LINE = 2
"""Place of the lines among the factors."""
MOST_LINES_SHARE = 0.15
"""Largest number of lines, or of positions in a line, as a share of the poses; in an irregular scan there are
more, and neither is judged."""
_STEPS = (1.0, 0.1, 0.01, 1e-3, 1e-4)
_SAME_LINE = 0.5
"""A move along the slow axis beyond this share of the largest one begins a new line of the scan."""
_SAME_PLACE = 0.1
"""A move below this share of the largest one along its axis has no direction."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EyeScan:
    """Poses of one eye in the order of visit; `volts_v`, `angles_rad`: (n, 2) float64, x and y.

    `volts_step_v`, `angles_step_rad`: the steps to which they are rounded.
    """

    volts_v: NDArray[np.float64]
    angles_rad: NDArray[np.float64]
    volts_step_v: float
    angles_step_rad: float


@dataclass(frozen=True, slots=True, kw_only=True)
class EyeErrors:
    """Errors at left-out poses of one eye: of the chosen model, of the paper's cubic, and by rounding alone.

    `rounding_rad`: root sum square of both axes, of rounded sweeps of the fitted model (Monte Carlo).
    """

    chosen: MirrorScore
    paper: MirrorScore
    rounding_rad: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Cause:
    """A cause that both eyes share: its share of the variance of all residuals, and its F-tests by axis.

    `p_values`: of the mean of both eyes, x and y; None where the sweep cannot show it.
    """

    name: str
    share: float
    p_values: tuple[float, float] | None


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepResiduals:
    """Division of the residuals of a sweep; shares are of the variance of both eyes and axes together.

    `direction_rad`: half the difference between poses reached from either side of the fast axis, x and y,
    mean of both eyes; on the fast axis it is positive where the mirrors lag, negative where the target's
    turntable does. `own_rad`, `own_limit_rad`: scatter of one axis of one eye beyond rounding, and its
    upper limit at 95 %. `line_rad`: rms deviation of the angles from straight lines along the scan; that of
    rounding alone means computed angles, not measured ones.
    """

    left: EyeErrors
    right: EyeErrors
    rounding_share: float
    shared_share: float
    causes: tuple[Cause, ...]
    direction_rad: tuple[float, float]
    own_rad: float
    own_limit_rad: float
    line_rad: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Residuals:
    """Residuals of both eyes (n, 2), rad, and an orthonormal basis (n, k) of what was fitted to them."""

    left: NDArray[np.float64]
    right: NDArray[np.float64]
    basis: NDArray[np.float64]

    @property
    def free(self) -> int:
        """Degrees of freedom of an axis."""
        return len(self.basis) - len(self.basis.T)

    def shared(self) -> float:
        """Return the covariance of the eyes, both axes added, rad²."""
        return float(np.sum(self.left * self.right)) / self.free

    def own(self) -> float:
        """Return the variance of one eye that the other does not have, both axes added, rad²."""
        return float(np.sum((self.left - self.right) ** 2)) / (2.0 * self.free)

    def extended(self, columns: NDArray[np.float64]) -> "_Residuals":
        """Return the residuals with further columns (n, q) fitted."""
        fresh = columns - self.basis @ (self.basis.T @ columns)
        vectors, sizes, _ = np.linalg.svd(fresh, full_matrices=False)
        added = vectors[:, sizes > 1e-6]
        left, right = (each - added @ (added.T @ each) for each in (self.left, self.right))
        return _Residuals(left=left, right=right, basis=np.column_stack([self.basis, added]))


def analyse_sweep(left: EyeScan, right: EyeScan, *, rng: np.random.Generator) -> SweepResiduals:
    """Divide the residuals of a sweep, both eyes at the same poses, by cause."""
    _check(left, right)
    errors = [_eye_errors(eye, rng) for eye in (left, right)]
    residuals = _residuals(left, right)
    total = residuals.shared() + residuals.own()
    rounded = zip(*(_rounded(eye, ORDER, rng) for eye in (left, right)), strict=True)
    by_rounding = [_residuals(*trial) for trial in rounded]
    rounding = float(np.mean([each.own() + each.shared() for each in by_rounding]))
    free = 2 * residuals.free
    most = residuals.own() * free / float(chdtri(free, 1.0 - BOUND_P))
    return SweepResiduals(
        left=errors[0],
        right=errors[1],
        rounding_share=rounding / total,
        shared_share=residuals.shared() / total,
        causes=tuple(_causes(residuals, left.angles_rad, total)),
        direction_rad=_direction_rad(residuals, left.angles_rad),
        own_rad=math.sqrt(max(0.0, residuals.own() - rounding) / 2.0),
        own_limit_rad=math.sqrt(max(0.0, most - rounding) / 2.0),
        line_rad=_line_rad(left.angles_rad),
    )


def rounding_step(values: NDArray[np.float64]) -> float:
    """Return the decimal step of which all values are multiples, 0.0001 at least."""
    for step in _STEPS:
        if np.abs(values - np.round(values / step) * step).max() < 1e-3 * step:
            return step
    return _STEPS[-1]


def _check(left: EyeScan, right: EyeScan) -> None:
    shapes = {each.shape for eye in (left, right) for each in (eye.volts_v, eye.angles_rad)}
    if len(shapes) != 1 or left.volts_v.ndim != 2 or left.volts_v.shape[1] != 2:
        raise InvalidInput(f"sweep: (n, 2) volts and angles of both eyes are needed, {sorted(shapes)} given")
    if len(left.volts_v) < LEAST_POSES:
        raise InvalidInput(f"sweep: {len(left.volts_v)} poses are too few; give {LEAST_POSES} or more")
    apart_rad = float(np.abs(left.angles_rad - right.angles_rad).max())
    if apart_rad > 0.1 * float(np.ptp(left.angles_rad)):
        raise InvalidInput("sweep: the eyes look at different targets; give poses of both eyes in one order")


def _eye_errors(eye: EyeScan, rng: np.random.Generator) -> EyeErrors:
    fit = fit_mirror_models(eye.volts_v, eye.angles_rad)
    paper = next(score for score in fit.scores if score.paper)
    order = fit.chosen.order if fit.chosen.family is MirrorModelFamily.POLYNOMIAL else ORDER
    rounded = _rounded(eye, order, rng)
    fits = [fit_polynomial(each.volts_v, each.angles_rad, order, "square") for each in rounded]
    rounding_rad = math.sqrt(float(np.mean([np.sum(each.loo_rms**2) for each in fits])))
    return EyeErrors(chosen=fit.chosen, paper=paper, rounding_rad=rounding_rad)


def _rounded(eye: EyeScan, order: int, rng: np.random.Generator) -> list[EyeScan]:
    """Return exact sweeps of the law that was fitted, rounded to the same volts and steps of the angles."""
    law = fit_polynomial(eye.volts_v, eye.angles_rad, order, "square").polynomial
    found = []
    for _ in range(ROUNDING_TRIALS):
        exact_rad = law(eye.volts_v + eye.volts_step_v * rng.uniform(-0.5, 0.5, eye.volts_v.shape))
        angles_rad = np.round(exact_rad / eye.angles_step_rad) * eye.angles_step_rad
        found.append(replace(eye, angles_rad=angles_rad))
    return found


def _regressed(volts_v: NDArray[np.float64], angles_rad: NDArray[np.float64]) -> PolynomialFit:
    """Fit the angles that the volts predict by a polynomial of the angles.

    The errors of a sweep are in its volts. Fitted the other way, a regressor that is related to the angles,
    such as the line of the scan, would repair errors that it did not cause.
    """
    predicted_rad = fit_polynomial(volts_v, angles_rad, ORDER, "square").polynomial(volts_v)
    return fit_polynomial(angles_rad, predicted_rad, ORDER, "square")


def _residuals(left: EyeScan, right: EyeScan) -> _Residuals:
    fits = [_regressed(eye.volts_v, eye.angles_rad) for eye in (left, right)]
    basis = np.linalg.qr(fits[0].polynomial.basis(left.angles_rad))[0]
    return _Residuals(left=fits[0].residuals, right=fits[1].residuals, basis=basis)


def _causes(residuals: _Residuals, angles_rad: NDArray[np.float64], total: float) -> Iterator[Cause]:
    """Yield the shared causes one after the other, each beyond those before, and the rest that is shared."""
    factors = _factors(angles_rad)
    stages = [residuals]
    for columns in factors.values():
        stages.append(stages[-1].extended(columns))
    shared = [stage.shared() for stage in stages]
    for index, name in enumerate(factors):
        share = (shared[index] - shared[index + 1]) / total
        yield Cause(name=name, share=share, p_values=_p_values(stages, index))
    yield Cause(name="unexplained", share=shared[-1] / total, p_values=None)


def _p_values(stages: list[_Residuals], index: int) -> tuple[float, float] | None:
    """Return the probabilities of F-tests, x and y, that a factor improves the eyes' mean so by chance.

    Factors before the lines' vary from line to line, so they are tested against the lines' scatter where that
    is larger than the scatter of poses: nine lines that err at random can seem to alternate.
    """
    squares = np.array([np.sum((0.5 * (each.left + each.right)) ** 2, axis=0) for each in stages])
    free = np.array([each.free for each in stages])
    terms = free[:-1] - free[1:]
    if terms[index] == 0:
        return None
    found = []
    for axis in (0, 1):
        means = (squares[:-1, axis] - squares[1:, axis]) / np.maximum(terms, 1)
        noise, noise_free = squares[-1, axis] / free[-1], free[-1]
        if index < LINE and means[LINE] > noise:
            noise, noise_free = means[LINE], terms[LINE]
        found.append(float(fdtrc(terms[index], noise_free, means[index] / noise)))
    return found[0], found[1]


def _factors(angles_rad: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    """Return the regressors (n, q) of each cause."""
    time = np.linspace(-1.0, 1.0, len(angles_rad))
    line, position = _line_and_position(angles_rad)
    return {
        "scan_direction": _direction(angles_rad)[:, None],
        "order_of_visit": np.column_stack([time, time**2]),
        "line": _indicators(line),
        "position_in_line": _indicators(position),
    }


def _fast_axis(angles_rad: NDArray[np.float64]) -> int:
    return int(np.argmax(np.abs(np.diff(angles_rad, axis=0)).sum(axis=0)))


def _direction(angles_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the direction of the last move along the fast axis, (n,), 1 or -1."""
    moves = np.diff(angles_rad[:, _fast_axis(angles_rad)])
    signs = np.where(np.abs(moves) < _SAME_PLACE * np.abs(moves).max(), 0.0, np.sign(moves))
    last = np.maximum.accumulate(np.where(signs != 0.0, np.arange(len(signs)), np.argmax(signs != 0.0)))
    return np.concatenate([signs[last[:1]], signs[last]])


def _line_and_position(angles_rad: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the number of each pose's line, and its rank in that line along the fast axis, (n,) each."""
    fast = _fast_axis(angles_rad)
    slow_moves = np.abs(np.diff(angles_rad[:, 1 - fast], prepend=angles_rad[0, 1 - fast]))
    line = np.cumsum(slow_moves > _SAME_LINE * slow_moves.max())
    position = np.zeros_like(line)
    for number in np.unique(line):
        rows = np.flatnonzero(line == number)
        position[rows[np.argsort(angles_rad[rows, fast])]] = np.arange(len(rows))
    return line, position


def _indicators(group: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return one column (n,) a group; a column of zeros for more groups than a grid's lines."""
    groups = np.unique(group)
    if len(groups) > MOST_LINES_SHARE * len(group):
        return np.zeros((len(group), 1))
    return np.asarray(group[:, None] == groups, dtype=np.float64)


def _direction_rad(residuals: _Residuals, angles_rad: NDArray[np.float64]) -> tuple[float, float]:
    direction = _direction(angles_rad)
    free = direction - residuals.basis @ (residuals.basis.T @ direction)
    size = float(free @ free)
    if size < 1e-6:
        return 0.0, 0.0
    x, y = (free @ (residuals.left + residuals.right) / (2.0 * size)).tolist()
    return x, y


def _line_rad(angles_rad: NDArray[np.float64]) -> float:
    """Return the rms deviation of the angles from straight, evenly spaced lines."""
    line, position = _line_and_position(angles_rad)
    squares, free = 0.0, 0
    for number in np.unique(line):
        rows = line == number
        if rows.sum() > 2:
            basis = np.column_stack([np.ones(rows.sum()), position[rows]])
            squares += float(np.linalg.lstsq(basis, angles_rad[rows], rcond=None)[1].sum())
            free += 2 * (int(rows.sum()) - 2)
    return math.sqrt(squares / max(free, 1))
