"""Finds when a mount was knocked in the middle of a run: a step in time that no slow drift explains.

All measurements of a run share one model of the mirror and one drift in short straight pieces. What these
leave is compared with a turn of the mount at each moment between two measurements. A run that was knocked is
two runs, and `mount_moves` and `mount_drift_fit` take out how the mount stands in each.

What the model of the mirror lacks goes with the row, and so with time: a step counts only where nodes that
were visited shortly before and after it jumped as well, whatever the drift may do in between. It takes two
stations: of one alone the mirror's model, row after row, bends to the knock.
"""

import logging
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.fit.mount_drift import LEAST_KNOCK_RAD
from foveacam_pipeline.calibrate.fit.mount_drift_fit import (
    GAZE_NOISE_RAD,
    PIVOT_UNKNOWNS,
    DriftSamples,
    motion_columns,
    place_knots,
)
from foveacam_pipeline.calibrate.fit.mount_moves import TURNS, both_axes, mirror_columns

KNOCK_SIGMAS = 6.0
"""Hundreds of moments are tried."""
ROWS_AN_OUTLIER = 10
"""Of so many measurements one may be left out as wrong."""
KNOCK_PIECES = 3
"""More of them can bend the drift to the shape of a knock."""
MIN_ROWS_ASIDE = 3
"""So many measurements of a run lie on either side: one that went wrong is no knock."""
MIN_FREEDOM = 12
"""A sweep of few poses has none to spare."""
MAX_KNOCKS = 4
MAX_UNSEEN = 0.35
"""Knocks leave 0.01 to 0.15 of themselves unseen, what goes with the row more than this."""
SAME_DEPTH = 0.02
"""By how much the depth of a node may differ from visit to visit; that of another station differs more."""
REVISIT_FACTOR = 1.5
"""Nodes count that were visited again within so many times the shortest such while."""
_RANK = 1e-9
_SMALLEST_RAD = 1e-12

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class _KnockStep:
    """A turn at a moment of a run: how much better it explains the measurements, and its size in sigmas.

    `unseen`: which share of it the nodes that were visited shortly before and after do not show.
    """

    run: int
    t_s: float
    gain: float
    turn_rad: float
    sigmas: float
    unseen: float


def split_at_knocks(samples: Mapping[Role, DriftSamples]) -> dict[Role, DriftSamples]:
    """Return the same measurements with each run that was knocked as two, in the order of time."""
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
    """Return the step that explains most of what both eyes' models leave; None where these bend at will.

    Measurements that went wrong are left out: those of which one alone explains more than any step.
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
        yield _combine_eyes([model.turned(run, t_s) for model in models])


def _moments(eyes: list[DriftSamples]) -> list[tuple[int, float]]:
    """Return each run and each moment between two of its measurements, but for its first and last ones."""
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
        turns=knots.hats(samples, knots.turns),
        rolls=knots.hats(samples, knots.rolls),
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
    """One eye: (2 n, k) what the model spans, orthonormal, and (2 n,) what it leaves of ax, then ay.

    `aside_rad`: (n, 2) gazes beside what a mirror would do on a mount that stands still. `repeats`: (m, 2)
    measurements of one node, in the order of time.
    """

    samples: DriftSamples
    spans: NDArray[np.float64]
    left: NDArray[np.float64]
    aside_rad: NDArray[np.float64]
    repeats: NDArray[np.int64]

    @property
    def free(self) -> int:
        """How many more measurements there are than unknowns, those of a turn among them."""
        return len(self.left) - int(self.spans.shape[1]) - TURNS

    @property
    def _aside(self) -> NDArray[np.float64]:
        """(n,) squares by which the residuals shrink where one measurement is left out."""
        own = np.maximum(1.0 - np.sum(self.spans**2, axis=1), _RANK)
        shrink = (self.left**2 / own).reshape(2, -1).sum(axis=0)
        shrink[self.repeats.ravel()] = 0.0  # what tells of a knock is not left out
        return np.asarray(shrink)

    @property
    def wrong_gain(self) -> float:
        """What leaving the worst measurement out explains."""
        return self._gain(float(self.left @ self.left) - float(self._aside.max()))

    def without_wrong(self) -> DriftSamples:
        """Return the measurements but for the worst one."""
        eye, kept = self.samples, np.arange(len(self.samples.t_s)) != int(np.argmax(self._aside))
        return DriftSamples(**{field.name: getattr(eye, field.name)[kept] for field in fields(eye)})

    def turned(self, run: int, t_s: float) -> _KnockStep:
        """Fit a turn of the mount at a moment; told is its surest angle."""
        eye = self.samples
        after = _is_after(eye, run, t_s)
        member = after.astype(np.float64)[:, None]
        columns = motion_columns(eye.angles_rad, eye.depth_m, turns=member, rolls=member)[:, PIVOT_UNKNOWNS:]
        own = columns - self.spans @ (self.spans.T @ columns)
        inverse = np.linalg.pinv(own.T @ own, rcond=_RANK)
        turn = inverse @ (own.T @ self.left)
        now = float(np.sum((self.left - own @ turn) ** 2))
        sigma = max(GAZE_NOISE_RAD, math.sqrt(now / self.free))
        sigmas = np.abs(turn[:2]) / np.maximum(sigma * np.sqrt(np.diag(inverse)[:2]), _SMALLEST_RAD)
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
        """Return which share of a step (n, 2) the nodes do not show that were visited again soonest."""
        across = self.repeats[~after[self.repeats[:, 0]] & after[self.repeats[:, 1]]]
        if not len(across):
            return math.inf
        while_s = np.diff(self.samples.t_s[across], axis=1)[:, 0]
        before, then = across[while_s <= REVISIT_FACTOR * while_s.min()].T
        told = step_rad[then].mean(axis=0)
        seen = (self.aside_rad[then] - self.aside_rad[before]).mean(axis=0)
        return float(np.linalg.norm(seen - told) / max(_SMALLEST_RAD, float(np.linalg.norm(told))))

    def _gain(self, now: float) -> float:
        """Return twice the logarithm by which the measurements become likelier with so many squares left."""
        before = float(self.left @ self.left)
        return len(self.left) * math.log((before + GAZE_NOISE_RAD**2) / (max(0.0, now) + GAZE_NOISE_RAD**2))


def _repeats(samples: DriftSamples) -> NDArray[np.int64]:
    """Return (k, 2) pairs of measurements of one node at one station in one run, in the order of time."""
    order = np.argsort(samples.t_s, kind="stable")
    first, then = (order[pair] for pair in np.triu_indices(len(order), 1))
    same = (samples.group[first] == samples.group[then]) & (samples.run[first] == samples.run[then])
    same &= np.abs(samples.depth_m[then] / samples.depth_m[first] - 1.0) < SAME_DEPTH
    return np.asarray(np.column_stack([first, then])[same], dtype=np.int64)


def _combine_eyes(eyes: list[_KnockStep]) -> _KnockStep:
    """Put both eyes' turns at one moment together: a knock may have hit one of them alone."""
    surest = max(eyes, key=lambda eye: eye.sigmas)
    return replace(surest, gain=sum(eye.gain for eye in eyes))
