"""Removal of mount drift, of moves between runs and of knocks within runs from the rows of sweeps.

Runs are split where a mount was knocked, that is at a step in time that no slow drift explains. Then turns
between runs that are too large for the drift model are fitted and removed. At last the remaining drift of
each run is estimated (`mount_drift`), and every row is corrected to the end of the last run.
"""

import logging
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.fit.measured_rows import FitRow, volts_of
from foveacam_pipeline.calibrate.fit.mount_drift import (
    GAZE_NOISE_RAD,
    MOVE_ROUNDS,
    PIVOT_UNKNOWNS,
    TURNS,
    DriftSamples,
    both_axes,
    fit_mount_drift,
    fit_moves,
    has_enough_visits,
    mirror_columns,
    motion_columns,
    place_knots,
    turns_at,
)
from foveacam_pipeline.calibrate.fit.samples import LEAST_KNOCK_RAD, MountDrift, turn_back

KNOCK_SIGMAS = 6.0
"""Significance of a knock; it is high because hundreds of moments are tried."""


ROWS_AN_OUTLIER = 10
"""At most one in this many measurements is left out as an outlier."""


KNOCK_PIECES = 3
"""Number of linear pieces of the drift; more of them could imitate a knock."""


MIN_ROWS_ASIDE = 3
"""Minimum measurements of a run on either side of a knock, so that one outlier does not look like a knock."""


MIN_FREEDOM = 12
"""Minimum degrees of freedom to search for knocks."""


MAX_KNOCKS = 4


MAX_UNSEEN = 0.35
"""Maximum share of a knock that revisited nodes do not show: 0.01 to 0.15 for knocks, more for errors that
change with the row."""


SAME_DEPTH = 0.02
"""Maximum relative difference of a node's depth between visits; other stations differ by more."""


REVISIT_FACTOR = 1.5
"""Maximum interval between visits to a node, over the shortest such interval."""


_RANK = 1e-9


_SMALLEST_RAD = 1e-12


logger = logging.getLogger(__name__)


def remove_drift(
    rows: Mapping[Role, Sequence[FitRow]], group: Mapping[tuple[int, int], int], *, f_px: float
) -> tuple[dict[Role, list[FitRow]], dict[Role, MountDrift] | None]:
    """Return the rows of both eyes corrected to the end of the last run, and the drift that was removed.

    `group`: numbers of the nodes; nodes of several sweeps with the same gaze share one. Where no nodes were
    visited again, only large moves between runs are corrected, and the drift is None.
    """
    runs = sorted({run_key(row) for mine in rows.values() for row in mine})
    numbers = {run: number for number, run in enumerate(runs)}
    whole = {role: _samples(mine, numbers, group) for role, mine in rows.items()}
    samples = split_at_knocks(whole) if has_enough_visits(whole) else whole
    count = 1 + max(int(eye.run.max(initial=0)) for eye in samples.values())
    corrected, moves_rad = {}, {}
    for role, mine in rows.items():
        moves = _remove_moves(list(mine), samples[role], runs=count, f_px=f_px)
        corrected[role], samples[role], moves_rad[role] = moves
    found = fit_mount_drift(samples)
    if found is None:
        return corrected, None
    for role, drift in found.items():
        turns = turns_at(drift, samples[role].t_s, samples[role].run)
        corrected[role] = [
            _turned_back(row, turn, f_px=f_px) for row, turn in zip(corrected[role], turns, strict=True)
        ]
    ended = _runs_ended_by_knocks(whole, samples)
    return corrected, {
        role: drift.with_moves(moves_rad[role]).with_knocks(ended) for role, drift in found.items()
    }


def _remove_moves(
    rows: list[FitRow], samples: DriftSamples, *, runs: int, f_px: float
) -> tuple[list[FitRow], DriftSamples, NDArray[np.float64]]:
    """Return rows and samples without large moves of the mount between runs, and the (runs, 3) moves.

    An eye without measurements in the last runs is corrected to the end of its own last one.
    """
    moved = np.zeros((runs, 3))
    for _ in range(MOVE_ROUNDS if samples.run.any() else 0):
        found = fit_moves(samples.volts_v, samples.angles_rad, samples.depth_m, samples.run)
        if not moved.any() and not found.significant:
            break
        turns = found.turn_rad[samples.run]
        rows = [_turned_back(row, turn, f_px=f_px) for row, turn in zip(rows, turns, strict=True)]
        samples = replace(samples, angles_rad=_angles(rows))
        moved[: len(found.turn_rad)] += found.turn_rad
    return rows, samples, moved


def _runs_ended_by_knocks(
    whole: Mapping[Role, DriftSamples], parted: Mapping[Role, DriftSamples]
) -> set[int]:
    """Return the numbers of the split runs that are not the last part of their original run."""
    origin = {
        part: run
        for role, samples in parted.items()
        for part, run in zip(samples.run.tolist(), whole[role].run.tolist(), strict=True)
    }
    return {part for part, run in origin.items() if origin.get(part + 1) == run}


def run_key(row: FitRow) -> tuple[str, int]:
    """Return the run of a row; where it was not recorded, each sweep counts as one run."""
    return (row.run, -1) if row.run else ("", row.node[0])


def _samples(
    rows: Sequence[FitRow], numbers: Mapping[tuple[str, int], int], group: Mapping[tuple[int, int], int]
) -> DriftSamples:
    return DriftSamples(
        volts_v=volts_of(rows),
        angles_rad=_angles(rows),
        depth_m=np.array([row.depth_m for row in rows], dtype=np.float64),
        t_s=1e-9 * np.array([row.t_ns for row in rows], dtype=np.float64),
        run=np.array([numbers[run_key(row)] for row in rows], dtype=np.int64),
        visit=np.array([row.visit for row in rows], dtype=np.bool_),
        group=np.array([group[row.node] for row in rows], dtype=np.int64),
    )


def _angles(rows: Sequence[FitRow]) -> NDArray[np.float64]:
    return np.array([row.angles_rad for row in rows], dtype=np.float64).reshape(-1, 2)


def _turned_back(row: FitRow, turn_rad: NDArray[np.float64], *, f_px: float) -> FitRow:
    gaze, corners = turn_back(row.angles_rad[None], row.plane_px[None], turn_rad[None], f_px=f_px)
    return replace(row, angles_rad=gaze[0], plane_px=corners[0])


@dataclass(frozen=True, slots=True, kw_only=True)
class _KnockStep:
    """A turn of a mount at one moment of a run, its gain in log likelihood and its size in standard errors.

    `unseen`: share of it that nodes visited shortly before and after do not show.
    """

    run: int
    t_s: float
    gain: float
    turn_rad: float
    sigmas: float
    unseen: float


def split_at_knocks(samples: Mapping[Role, DriftSamples]) -> dict[Role, DriftSamples]:
    """Return the same measurements with each run that was knocked split in two, in the order of time.

    Errors of the mirror model change with the row and so with time; a step counts only where nodes that were
    visited shortly before and after it jumped as well. Two stations are needed: with one, the mirror model
    adapts to the knock row by row.
    """
    found = dict(samples)
    for _ in range(MAX_KNOCKS):
        step = _best_step(found)
        if step is None or step.turn_rad < LEAST_KNOCK_RAD or step.sigmas < KNOCK_SIGMAS:
            break
        logger.info(
            "a mount turned by %.3f deg within run %d, %.1f s after it began",
            math.degrees(step.turn_rad),
            step.run,
            step.t_s - min(eye.t_s[eye.run == step.run].min() for eye in found.values()),
        )
        found = {
            role: replace(eye, run=eye.run + ((eye.run > step.run) | _is_after(eye, step.run, step.t_s)))
            for role, eye in found.items()
        }
    return found


def _is_after(samples: DriftSamples, run: int, t_s: float) -> NDArray[np.bool_]:
    return np.asarray((samples.run == run) & (samples.t_s > t_s))


def _best_step(samples: Mapping[Role, DriftSamples]) -> _KnockStep | None:
    """Return the step that best explains both eyes' residuals; None with too few degrees of freedom.

    A measurement that explains more than any step is left out as an outlier.
    """
    eyes = list(samples.values())
    for _ in range(1 + len(eyes[0].t_s) // ROWS_AN_OUTLIER):
        models = [_fit_run_model(eye, eyes) for eye in eyes]
        if any(model.free < MIN_FREEDOM for model in models):
            return None
        seen = [step for step in _fit_steps(models) if step.unseen < MAX_UNSEEN]
        best = max(seen, key=lambda step: step.gain, default=None)
        wrong, gain = max(((k, model.wrong_gain) for k, model in enumerate(models)), key=lambda one: one[1])
        if best is None or gain < max(best.gain, KNOCK_SIGMAS**2):
            return best
        eyes[wrong] = models[wrong].without_wrong()
    return best


def _fit_steps(models: "list[_RunModel]") -> Iterator[_KnockStep]:
    for run, t_s in _moments([model.samples for model in models]):
        yield _combine_eyes([model.fit_step(run, t_s) for model in models])


def _moments(eyes: list[DriftSamples]) -> list[tuple[int, float]]:
    """Return each run and each moment between two of its measurements, except near its ends."""
    found = []
    for run in np.unique(np.concatenate([eye.run for eye in eyes])).tolist():
        times = np.unique(np.concatenate([eye.t_s[eye.run == run] for eye in eyes]))
        middles = (times[:-1] + times[1:]) / 2.0
        found += [
            (run, t_s) for t_s in middles[MIN_ROWS_ASIDE - 1 : len(middles) - MIN_ROWS_ASIDE + 1].tolist()
        ]
    return found


def _fit_run_model(samples: DriftSamples, eyes: list[DriftSamples]) -> "_RunModel":
    """Fit one eye's mirror, pivot and slow drift."""
    knots = place_knots(eyes, KNOCK_PIECES)
    mirror = mirror_columns(samples.volts_v)
    motion = motion_columns(
        samples.angles_rad,
        samples.depth_m,
        turns=knots.basis(samples, knots.turns),
        rolls=knots.basis(samples, knots.rolls),
    )
    spans, weights, _ = np.linalg.svd(np.hstack([both_axes(mirror), motion]), full_matrices=False)
    spans = spans[:, weights > _RANK * weights[0]]
    values = samples.angles_rad.T.ravel()
    drive = np.linalg.lstsq(mirror, samples.angles_rad, rcond=None)[0]
    return _RunModel(
        samples=samples,
        spans=spans,
        left=values - spans @ (spans.T @ values),
        aside_rad=samples.angles_rad - mirror @ drive,
        repeats=_repeats(samples),
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _RunModel:
    """Model of one eye: its (2 n, k) orthonormal span, and the (2 n,) residuals `left` of ax, then ay.

    `aside_rad`: (n, 2) gazes minus a mirror model on a fixed mount. `repeats`: (m, 2) pairs of measurements
    of one node, in the order of time.
    """

    samples: DriftSamples
    spans: NDArray[np.float64]
    left: NDArray[np.float64]
    aside_rad: NDArray[np.float64]
    repeats: NDArray[np.int64]

    @property
    def free(self) -> int:
        """Degrees of freedom, with the unknowns of a turn counted."""
        return len(self.left) - int(self.spans.shape[1]) - TURNS

    @property
    def _aside(self) -> NDArray[np.float64]:
        """(n,) reductions of the sum of squares when one measurement is left out."""
        own = np.maximum(1.0 - np.sum(self.spans**2, axis=1), _RANK)
        shrink = (self.left**2 / own).reshape(2, -1).sum(axis=0)
        shrink[self.repeats.ravel()] = 0.0  # revisited nodes show knocks and are not left out
        return np.asarray(shrink)

    @property
    def wrong_gain(self) -> float:
        """Gain of leaving the worst measurement out."""
        return self._gain(float(self.left @ self.left) - float(self._aside.max()))

    def without_wrong(self) -> DriftSamples:
        """Return the measurements without the worst one."""
        eye, mask = self.samples, np.arange(len(self.samples.t_s)) != int(np.argmax(self._aside))
        return DriftSamples(**{field.name: getattr(eye, field.name)[mask] for field in fields(eye)})

    def fit_step(self, run: int, t_s: float) -> _KnockStep:
        """Fit a turn of the mount at a moment; the step has its most significant angle."""
        eye = self.samples
        after = _is_after(eye, run, t_s)
        member = after.astype(np.float64)[:, None]
        columns = motion_columns(eye.angles_rad, eye.depth_m, turns=member, rolls=member)[:, PIVOT_UNKNOWNS:]
        own = columns - self.spans @ (self.spans.T @ columns)
        solve = np.linalg.pinv(own, rcond=math.sqrt(_RANK))  # own.T @ own would keep half of the digits
        turn = solve @ self.left
        now = float(np.sum((self.left - own @ turn) ** 2))
        sigma = max(GAZE_NOISE_RAD, math.sqrt(now / self.free))
        sigmas = np.abs(turn[:2]) / np.maximum(sigma * np.linalg.norm(solve[:2], axis=1), _SMALLEST_RAD)
        surest = int(sigmas.argmax())
        return _KnockStep(
            run=run,
            t_s=t_s,
            gain=self._gain(now),
            turn_rad=abs(float(turn[surest])),
            sigmas=float(sigmas[surest]),
            unseen=self._unseen((columns @ turn).reshape(2, -1).T, after),
        )

    def _unseen(self, step_rad: NDArray[np.float64], after: NDArray[np.bool_]) -> float:
        """Return the share of a step (n, 2) that the nodes visited again soonest do not show."""
        across = self.repeats[~after[self.repeats[:, 0]] & after[self.repeats[:, 1]]]
        if not len(across):
            return math.inf
        while_s = np.diff(self.samples.t_s[across], axis=1)[:, 0]
        before, then = across[while_s <= REVISIT_FACTOR * while_s.min()].T
        step = step_rad[then].mean(axis=0)
        seen = (self.aside_rad[then] - self.aside_rad[before]).mean(axis=0)
        return float(np.linalg.norm(seen - step) / max(_SMALLEST_RAD, float(np.linalg.norm(step))))

    def _gain(self, now: float) -> float:
        """Return twice the increase of the log likelihood when the sum of squares falls to `now`."""
        before = float(self.left @ self.left)
        return len(self.left) * math.log((before + GAZE_NOISE_RAD**2) / (max(0.0, now) + GAZE_NOISE_RAD**2))


def _repeats(samples: DriftSamples) -> NDArray[np.int64]:
    """Return the (k, 2) pairs of measurements of one node at one station in one run, in the order of time."""
    order = np.argsort(samples.t_s, kind="stable")
    first, then = (order[pair] for pair in np.triu_indices(len(order), 1))
    same = (samples.group[first] == samples.group[then]) & (samples.run[first] == samples.run[then])
    same &= np.abs(samples.depth_m[then] / samples.depth_m[first] - 1.0) < SAME_DEPTH
    return np.asarray(np.column_stack([first, then])[same], dtype=np.int64)


def _combine_eyes(eyes: list[_KnockStep]) -> _KnockStep:
    """Combine both eyes' steps at one moment; a knock may have hit one of them alone."""
    surest = max(eyes, key=lambda eye: eye.sigmas)
    return replace(surest, gain=sum(eye.gain for eye in eyes))
