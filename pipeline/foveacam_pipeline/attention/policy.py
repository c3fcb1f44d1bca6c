"""The policy: the look that is worth most per second, with both eyes on one point or each on its own.

A fovea and the wide camera measure what that fovea shows, at a tenth of the baseline's angle that both foveae
have; so the eyes cover twice the field apart, and see farther together. What a look is expected to measure
follows from the texture of the wide picture and from what earlier looks could not.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from foveacam_hardware.contract import Role
from foveacam_pipeline.attention.field import Bools, FieldState, Floats
from foveacam_pipeline.attention.looks import Candidates
from foveacam_pipeline.attention.losses import DepthRange, Weights, Worth, worth_of
from foveacam_pipeline.verge.aim import EYES, Gazes

CONTRASTS, CHANCES = (0.0, 0.1, 0.2, 0.3, 1.0, 1.5), (0.01, 0.03, 0.3, 0.7, 0.87, 0.9)
"""Slope of the wide picture, grey levels per px, and share of a cell that a look measures: of 1 600 cells of
the scenes bench, street and toy, at binning 2."""
GUESSED_FARTHER = 0.6
"""Factor on 1/Z for the expected error where it is a guess: what is farther is measured worse."""
FORGOTTEN = 0.35
"""Factor on the chance of a match for each look that left a cell as it was."""
VERGED_TRIED = 48
"""Directions at which both eyes are tried on one point: those that one eye's view promises most for."""
LEAST_WORTH = 0.5
"""Expected worth of a look, in cells, below which nothing is left to do."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Look:
    """A look: gazes of both eyes, tangents; the distance at which they meet, or None for eyes apart.

    `expected_per_m`: 1/Z that each eye is expected to see.
    `cells`: (n,) bool, those that either fovea shows; `likely`: (n,) those that it is expected to measure;
    `relative_sigma`: (n,) to which error. `depth_worth`: by how much the map's loss falls, in cells, if all
    goes as texture promises. `worth`: expected reduction of the whole loss; `reason`: a sentence for people.
    """

    gazes: Gazes
    meeting_m: float | None
    expected_per_m: Mapping[Role, float]
    cells: Bools
    likely: Bools
    relative_sigma: Floats
    worth: float
    reason: str
    depth_worth: float = 0.0


class Policy(Protocol):
    """Chooses looks."""

    def choose(self, state: FieldState) -> Look | None:
        """Return the next look; None where nothing is left to look at."""
        ...


@dataclass(slots=True)
class AttentionPolicy:
    """Chooses the look that is worth most.

    `forbidden`: (n,) bool, cells that no fovea may show. `least_worth`: expected worth, in cells, of a look
    that is still made.
    """

    candidates: Candidates
    weights: Weights
    depths: DepthRange = field(default_factory=DepthRange)
    forbidden: Bools | None = None
    least_worth: float = LEAST_WORTH

    def choose(self, state: FieldState) -> Look | None:
        """Return the look that is worth most; None where that is less than `least_worth`."""
        one, both = self._worths(state)
        found = [self._apart(state, one), self._verged(state, one, both)]
        best = max((look for look in found if look is not None), key=lambda look: look.worth, default=None)
        return best if best is not None and best.worth >= self.least_worth else None

    def plan(self, state: FieldState, count: int) -> list[Look]:
        """Return the next looks, as they follow from each other's expected results."""
        looks: list[Look] = []
        while len(looks) < count and (look := self.choose(state)) is not None:
            looks.append(look)
            state = state.after(look.cells, relative_sigma=look.relative_sigma, measured=look.likely)
        return looks

    def _worths(self, state: FieldState) -> tuple["_CellWorth", "_CellWorth"]:
        chance = match_chance(state)
        errors = self.candidates.errors
        each = []
        cautious = np.where(state.guessed, GUESSED_FARTHER, 1.0) * state.inverse_z_per_m
        for error_per_m in (errors.one_eye_per_m, errors.both_per_m):
            relative = error_per_m / np.maximum(cautious, 1e-6)
            worth = worth_of(state, self.weights, relative_sigma=relative, depths=self.depths)
            each.append(_CellWorth(worth=worth, chance=chance, relative_sigma=relative))
        return each[0], each[1]

    def _forbidden_cells(self) -> Floats | None:
        if self.forbidden is None or not self.forbidden.any():
            return None
        return self.forbidden.astype(np.float64)

    def _apart(self, state: FieldState, one: "_CellWorth") -> Look | None:
        """Return the best look of both eyes, each on its own."""
        total = one.total
        best: dict[Role, _EyeLook] | None = None
        for first, second in (EYES, EYES[::-1]):
            own = self._best_of_eye(first, state, total)
            if own is None:
                return None
            other = self._best_of_eye(second, state, np.where(own.shown, 0.0, total))
            if other is None:
                return None
            if best is None or own.worth + other.worth > sum(each.worth for each in best.values()):
                best = {first: own, second: other}
        if best is None:
            return None
        left, right = best[Role.LEFT], best[Role.RIGHT]
        cells = left.shown | right.shown
        return Look(
            gazes=Gazes(left=left.gaze, right=right.gaze),
            meeting_m=None,
            expected_per_m={role: each.expected_per_m for role, each in best.items()},
            cells=cells,
            likely=cells & (one.chance >= 0.5),
            relative_sigma=one.relative_sigma,
            worth=state.yields.apart * (left.worth + right.worth),
            reason=f"Each eye on its own: {reason_for(state, cells, one, self.weights)}",
            depth_worth=float((one.chance * one.worth.measured)[cells].sum()),
        )

    def _best_of_eye(self, role: Role, state: FieldState, total: Floats) -> "_EyeLook | None":
        """Return the gaze of one eye that is worth most; None where none is allowed."""
        grid, inverse_z = self.candidates.gazes[role], state.inverse_z_per_m
        allowed = grid.reached
        if (forbidden := self._forbidden_cells()) is not None:
            for q in (inverse_z, np.zeros_like(inverse_z)):
                allowed = allowed & (self.candidates.worths(role, q, forbidden, whole=True) == 0.0)
        if not allowed.any():
            return None
        worths = np.where(allowed, self.candidates.worths(role, inverse_z, total), -np.inf)
        index = int(np.argmax(worths))
        gaze = grid.gaze(index)
        shown = self.candidates.shows(role, gaze[None], inverse_z)[0]
        expected = weighted_medians(inverse_z, np.where(shown, total + 1e-9, 0.0)[None])
        return _EyeLook(
            gaze=gaze, worth=float(worths.ravel()[index]), shown=shown, expected_per_m=float(expected[0])
        )

    def _allowed(self, role: Role, gazes: Floats, state: FieldState) -> Bools:
        """Return (c,) bool: which gazes (c, 2) an eye's mirror reaches and that show nothing forbidden."""
        allowed = self.candidates.reaches(role, gazes)
        if self.forbidden is not None and self.forbidden.any():
            for q in (state.inverse_z_per_m, np.zeros_like(state.inverse_z_per_m)):
                shown = self.candidates.shows(role, gazes, q, whole=True)
                allowed &= ~shown[:, self.forbidden].any(axis=1)
        return allowed

    def _verged(self, state: FieldState, one: "_CellWorth", both: "_CellWorth") -> Look | None:
        """Return the best look of both eyes on one point."""
        directions, inverse_z = self._verging_places(state, both)
        if len(directions) == 0:
            return None
        gazes = self.candidates.verged(directions, inverse_z)
        allowed = self._allowed(Role.LEFT, gazes.left, state) & self._allowed(Role.RIGHT, gazes.right, state)
        if not allowed.any():
            return None
        gazes = Gazes(left=gazes.left[allowed], right=gazes.right[allowed])
        inverse_z = inverse_z[allowed]
        shown = self.candidates.shown_by(gazes, inverse_z, inverse_z_per_m=state.inverse_z_per_m)
        single = (shown.left | shown.right) & ~shown.both
        worths = shown.both @ both.total + single @ one.total
        at = int(np.argmax(worths))
        cells = shown.left[at] | shown.right[at]
        relative = np.where(shown.both[at], both.relative_sigma, one.relative_sigma)
        meeting_m = float(1.0 / max(inverse_z[at], 1e-6))
        reason = reason_for(state, cells, replace(one, relative_sigma=relative), self.weights)
        return Look(
            gazes=Gazes(left=gazes.left[at], right=gazes.right[at]),
            meeting_m=meeting_m,
            expected_per_m=dict.fromkeys(EYES, float(inverse_z[at])),
            cells=cells,
            likely=cells & (one.chance >= 0.5),
            relative_sigma=relative,
            worth=state.yields.verged * float(worths[at]),
            reason=f"Both eyes at {meeting_m:.1f} m: {reason}",
            depth_worth=float(
                (one.chance * np.where(shown.both[at], both.worth.measured, one.worth.measured))[cells].sum()
            ),
        )

    def _verging_places(self, state: FieldState, both: "_CellWorth") -> tuple[Floats, Floats]:
        """Return the directions, (c, 2), at which both eyes may gain most, and the 1/Z there, (c,)."""
        near = self.candidates.near_directions
        promised = near @ both.total.astype(np.float32)
        order = np.argsort(-promised)[:VERGED_TRIED]
        order = order[promised[order] > 0.0]
        weights = near[order].astype(np.float64) * np.maximum(both.total, 1e-9)
        return self.candidates.directions[order], weighted_medians(state.inverse_z_per_m, weights)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _EyeLook:
    """The gaze of one eye, its worth, (n,) the cells that it shows, and the 1/Z expected there."""

    gaze: Floats
    worth: float
    shown: Bools
    expected_per_m: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _CellWorth:
    """What a look at each cell is worth, the chance that it is measured, and the error then, (n,) each."""

    worth: Worth
    chance: Floats
    relative_sigma: Floats

    @property
    def total(self) -> Floats:
        """Expected worth."""
        return self.chance * self.worth.measured + self.worth.seen


def match_chance(state: FieldState) -> Floats:
    """Return (n,) the chance that a look measures a cell: by its texture, and by looks that did not."""
    chance = np.interp(state.contrast, CONTRASTS, CHANCES)
    return chance * FORGOTTEN ** np.minimum(state.tries, 12)


def weighted_medians(values: Floats, weights: Floats) -> Floats:
    """Return (c,) the median of (n,) values under each row of (c, n) weights."""
    order = np.argsort(values)
    summed = np.cumsum(weights[:, order], axis=1)
    middle = (summed >= summed[:, -1:] / 2.0).argmax(axis=1)
    return np.asarray(values[order][middle], dtype=np.float64)


def reason_for(state: FieldState, cells: Bools, worth: _CellWorth, weights: Weights) -> str:
    """Return why a look at some cells is worth it, its largest share first."""
    unknown = int(np.count_nonzero(cells & ~np.isfinite(state.relative_sigma).any(axis=1)))
    total = float(worth.total[cells].sum())
    shares: list[tuple[float, str]] = [
        (weights.targets * float(state.urgency[cells].sum()), "a followed target is due"),
        (
            weights.change * float(state.changed[cells].sum()),
            f"{np.count_nonzero(cells & (state.changed > 0.0))} cells changed",
        ),
        (weights.objects * float(state.interest[cells].sum()), "a detected object is not measured"),
    ]
    found = [words for share, words in sorted(shares, reverse=True) if share > 0.1 * total]
    if weights.map > 0.0 and unknown:
        found.append(f"{unknown} cells unknown")
    elif weights.map > 0.0 and float(worth.worth.measured[cells].sum()) > 0.0:
        found.append("depth not known well")
    if not found and weights.novelty > 0.0:
        found.append("not looked at for long")
    return ", ".join(found) or "nothing better"
