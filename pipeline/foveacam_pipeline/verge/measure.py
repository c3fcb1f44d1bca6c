"""Measurement of the target in one look, against the wide view and left against right.

The two must agree. If they do not at first, other patches and a wider search are tried before the look is
rejected.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.looking.fixation_head import Observation
from foveacam_pipeline.verge.matching.centre_fit import vicinity
from foveacam_pipeline.verge.matching.fine import FAR_REACH_PX, FineMatch, MatchGuess, match_fine
from foveacam_pipeline.verge.matching.survey import ReducedLook
from foveacam_pipeline.verge.matching.wide_patch import WidePatch
from foveacam_pipeline.verge.settings import VergeSettings

ROWS_SHARE = 0.2
"""Least gradient energy of a patch across the rows, as a share of that along them: vertical lines reach 0.11
by noise, paint 1.2."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Measurement:
    """Measurement of the target in one look.

    `centre`: (2,) tangents from the mean gaze to the target. `fine`: left against right. `wide_score`:
    correlation of the wide patch at the place that both give; `wide_peak`: its best correlation near there.
    `aside_lead`: how much more it correlates there than where the calibration expects it. `look`: the foveae
    at survey scale.
    """

    centre: NDArray[np.float64]
    fine: FineMatch
    wide_score: float
    wide_peak: float
    aside_lead: float
    look: ReducedLook

    def quality(self, limits: VergeSettings) -> float:
        """Return the smallest margin to the thresholds; negative when any is missed."""
        stray = self.aside_lead > limits.stray_lead
        return min(
            self.fine.score - limits.fine_score,
            limits.largest_sigma_px(self.fine.score) - self.fine.sigma_x_px,
            self.wide_score - (limits.stray_score if stray else limits.confirm_score),
            self.wide_score - limits.confirm_share * self.wide_peak,
        )


def measure(
    observation: Observation,
    templates: tuple[WidePatch, ...],
    target: NDArray[np.float64],
    *,
    calibration: Calibration,
    limits: VergeSettings,
) -> Measurement:
    """Return the first measurement that passes all thresholds, or else the best one.

    `templates`: best first. `target`: (2,) tangents from the rig's origin at the time of the look.
    """
    f_px = calibration.fovea_f_px
    look = observation.reduced(calibration, f_px=templates[0].f_px)
    expected = target - (observation.gazes.left + observation.gazes.right) / 2.0
    best: Measurement | None = None
    for template, guess in _guesses(look, templates, expected):
        fine = match_fine(observation.sighting, calibration, guess)
        leaning = vicinity(look, template, expected, slope=fine.slope)
        mean = leaning.given(fine.residual_px / f_px)
        found = Measurement(
            centre=mean.centre,
            fine=fine,
            wide_score=mean.score,
            wide_peak=leaning.peaks()[2],
            aside_lead=mean.lead,
            look=look,
        )
        if best is None or found.quality(limits) > best.quality(limits):
            best = found
        if best.quality(limits) >= 0.0:
            return best
    if best is None:
        raise ValueError("measure: no template was given; pass at least one")
    return best


def point_sigma_px(fine: FineMatch, calibration: Calibration, limits: VergeSettings) -> float:
    """Return the standard error of disparity at a point, fovea px, placement on a slope included."""
    beside_px = limits.placed_sigma_wide_px * calibration.fovea_f_px / calibration.wide.fx_px
    return math.hypot(fine.sigma_x_px, math.hypot(*fine.slope) * beside_px)


def _guesses(
    look: ReducedLook, templates: tuple[WidePatch, ...], expected: NDArray[np.float64]
) -> Iterator[tuple[WidePatch, MatchGuess]]:
    """Yield guesses: the first patch at each eye's place, then at the mean; others; a wider search."""
    first = templates[0]
    left, right = _peaks(look, first, expected)
    centre = (left + right) / 2.0
    yield first, MatchGuess(left=left, right=right)
    yield first, MatchGuess(left=centre, right=centre)
    for other in templates[1:]:
        left, right = _peaks(look, other, expected)
        yield other, MatchGuess(left=left, right=right)
    yield first, MatchGuess(left=centre, right=centre, reach_px=FAR_REACH_PX)


def _peaks(
    look: ReducedLook, patch: WidePatch, expected: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return each eye's place of a patch, (2,) tangents from its gaze; one row for vertical lines."""
    left, right, _ = vicinity(look, patch, expected).peaks()
    if _varies_by_row(patch.patch):
        return left, right
    row = (left[1] + right[1]) / 2.0
    return np.array([left[0], row]), np.array([right[0], row])


def _varies_by_row(patch: NDArray[np.float32]) -> bool:
    """Return whether a patch varies from row to row; vertical lines fit anywhere along themselves."""
    down, along = np.gradient(patch)
    return float((down**2).sum()) >= ROWS_SHARE * float((along**2).sum())
