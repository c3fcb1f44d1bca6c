"""The policy: the look that is worth most, with both eyes on one point or each on its own.

One fovea and the wide camera measure what that fovea shows, at half the baseline and the resolution of the
wide camera. So the eyes cover twice the field apart, and measure what is farther together. What a look is
expected to measure follows from the texture of the wide picture and from what earlier looks could not.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from foveacam_hardware.contract import Role
from foveacam_pipeline.attention.field import Bools, FieldState, Floats
from foveacam_pipeline.attention.looks import Candidates
from foveacam_pipeline.attention.losses import DepthRange, worth_of
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

    `expected_per_m`: 1/Z that each eye is expected to see. `cells`: (n,) bool, those that either
    fovea shows. `promised`: by how much the loss falls if all goes as texture promises, cells; `worth`: the
    same by what such looks brought lately. `reason`: a sentence for people.
    """

    gazes: Gazes
    meeting_m: float | None
    expected_per_m: Mapping[Role, float]
    cells: Bools
    promised: float
    worth: float
    reason: str


class Policy(Protocol):
    """Chooses looks."""

    def choose(self, state: FieldState) -> Look | None:
        """Return the next look; None where nothing is left to look at."""
        ...


@dataclass(slots=True)
class AttentionPolicy:
    """Chooses the look that is worth most, if that is `least_worth` cells or more."""

    candidates: Candidates
    depths: DepthRange = field(default_factory=DepthRange)
    least_worth: float = LEAST_WORTH

    def choose(self, state: FieldState) -> Look | None:
        """Return the look that is worth most; None where that is less than `least_worth`."""
        one, both = self._worths(state)
        found = [self._apart(state, one), self._verged(state, one, both)]
        best = max((look for look in found if look is not None), key=lambda look: look.worth, default=None)
        return best if best is not None and best.worth >= self.least_worth else None

    def _worths(self, state: FieldState) -> tuple[Floats, Floats]:
        """Return (n,) what each cell is worth that one fovea shows, and that both show."""
        chance = match_chance(state)
        errors = self.candidates.errors
        each = []
        cautious = np.where(state.guessed, GUESSED_FARTHER, 1.0) * state.inverse_z_per_m
        for error_per_m in (errors.one_eye_per_m, errors.both_per_m):
            relative = error_per_m / np.maximum(cautious, 1e-6)
            each.append(chance * worth_of(state, self.depths, relative_sigma=relative))
        return each[0], each[1]

    def _apart(self, state: FieldState, one: Floats) -> Look | None:
        """Return the best look of both eyes, each on its own."""
        best: dict[Role, _EyeLook] | None = None
        for first, second in (EYES, EYES[::-1]):
            own = self._best_of_eye(first, state, one)
            other = self._best_of_eye(second, state, np.where(own.shown, 0.0, one))
            if best is None or own.worth + other.worth > sum(each.worth for each in best.values()):
                best = {first: own, second: other}
        if best is None:
            return None
        left, right = best[Role.LEFT], best[Role.RIGHT]
        cells, promised = left.shown | right.shown, left.worth + right.worth
        return Look(
            gazes=Gazes(left=left.gaze, right=right.gaze),
            meeting_m=None,
            expected_per_m={role: each.expected_per_m for role, each in best.items()},
            cells=cells,
            promised=promised,
            worth=state.yields.apart * promised,
            reason=f"Each eye on its own: {reason_for(state, cells)}",
        )

    def _best_of_eye(self, role: Role, state: FieldState, total: Floats) -> "_EyeLook":
        """Return the gaze of one eye that is worth most."""
        grid, inverse_z = self.candidates.gazes[role], state.inverse_z_per_m
        worths = np.where(grid.reached, self.candidates.worths(role, inverse_z, total), -np.inf)
        index = int(np.argmax(worths))
        gaze = grid.gaze(index)
        shown = self.candidates.shows(role, gaze[None], inverse_z)[0]
        expected = weighted_medians(inverse_z, np.where(shown, total + 1e-9, 0.0)[None])
        return _EyeLook(
            gaze=gaze, worth=float(worths.ravel()[index]), shown=shown, expected_per_m=float(expected[0])
        )

    def _verged(self, state: FieldState, one: Floats, both: Floats) -> Look | None:
        """Return the best look of both eyes on one point."""
        directions, inverse_z = self._verging_places(state, both)
        if len(directions) == 0:
            return None
        gazes = self.candidates.verged(directions, inverse_z)
        reached = self.candidates.reaches(Role.LEFT, gazes.left) & self.candidates.reaches(
            Role.RIGHT, gazes.right
        )
        if not reached.any():
            return None
        gazes = Gazes(left=gazes.left[reached], right=gazes.right[reached])
        inverse_z = inverse_z[reached]
        shown = self.candidates.shown_by(gazes, inverse_z, inverse_z_per_m=state.inverse_z_per_m)
        single = (shown.left | shown.right) & ~shown.both
        worths = shown.both @ both + single @ one
        at = int(np.argmax(worths))
        cells = shown.left[at] | shown.right[at]
        meeting_m = float(1.0 / max(inverse_z[at], 1e-6))
        return Look(
            gazes=Gazes(left=gazes.left[at], right=gazes.right[at]),
            meeting_m=meeting_m,
            expected_per_m=dict.fromkeys(EYES, float(inverse_z[at])),
            cells=cells,
            promised=float(worths[at]),
            worth=state.yields.verged * float(worths[at]),
            reason=f"Both eyes at {meeting_m:.1f} m: {reason_for(state, cells)}",
        )

    def _verging_places(self, state: FieldState, both: Floats) -> tuple[Floats, Floats]:
        """Return the directions, (c, 2), at which both eyes may gain most, and the 1/Z there, (c,)."""
        near = self.candidates.near_directions
        promised = near @ both.astype(np.float32)
        order = np.argsort(-promised)[:VERGED_TRIED]
        order = order[promised[order] > 0.0]
        weights = near[order].astype(np.float64) * np.maximum(both, 1e-9)
        return self.candidates.directions[order], weighted_medians(state.inverse_z_per_m, weights)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _EyeLook:
    """The gaze of one eye, its worth, (n,) the cells that it shows, and the 1/Z expected there."""

    gaze: Floats
    worth: float
    shown: Bools
    expected_per_m: float


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


def reason_for(state: FieldState, cells: Bools) -> str:
    """Return why a look at some cells, (n,) bool, is worth it."""
    unknown = int(np.count_nonzero(cells & ~np.isfinite(state.relative_sigma).any(axis=1)))
    return f"{unknown} cells unknown" if unknown else "depth not known well"
