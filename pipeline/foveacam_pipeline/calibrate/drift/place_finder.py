"""Looks that find one patch of the wide view in both foveae and measure it to a fraction of a pixel.

The eyes are steered by the calibration as it is. Nothing is assumed of the angle between them: a patch that
seems to lie beyond infinity is found as well.
"""

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Head, OutOfRange, Role, Sighting
from foveacam_pipeline.calibrate.drift.patches import DriftPatch
from foveacam_pipeline.calibrate.drift.values import DriftPlace, DriftSettings
from foveacam_pipeline.matching.correlation import UNSEEN, peak, score_map
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.verge.aim import Gazes, aim_at, gazes_under, reach_span, volts_for
from foveacam_pipeline.verge.matching.centre_fit import vicinity
from foveacam_pipeline.verge.matching.fine import FineMatch, MatchGuess, match_fine
from foveacam_pipeline.verge.matching.survey import ReducedEye, reduce_look
from foveacam_pipeline.verge.matching.wide_patch import WidePatch, follow

SEARCH_INVERSE_DEPTHS = (0.0, 0.2, 0.4, 0.6)
"""Inverse depths that are searched when nothing is known, 1/m: infinity to 1.7 m."""
SAME_SPAN = 0.09
"""Minimum difference of the inverse depths of two looks, 1/m: closer ones show the same."""
REACH_MARGIN_PER_M = 0.03
"""Margin to the nearest depth that the eyes reach, because they may have drifted, 1/m."""
EYES_AGREE_PX = 3.0
"""Maximum difference between the wide patch's offset in the eyes and their match to each other, survey px."""
EXPECTED_REACH_PX = 14.0
"""Search radius about the expected row once other places were found, survey px."""


@dataclass(slots=True)
class DriftExpectation:
    """Offsets of each eye, (2,) tangents, and inverse depths, 1/m, of the places found so far."""

    offsets: list[tuple[NDArray[np.float64], NDArray[np.float64]]] = field(default_factory=list)
    inverse_depths: list[float] = field(default_factory=list)

    def median_offsets(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the median offset of the left and of the right eye."""
        if not self.offsets:
            return np.zeros(2), np.zeros(2)
        left, right = np.median(np.array(self.offsets), axis=0)
        return left, right

    def depths(self) -> Iterator[float]:
        """Yield the inverse depths to look at, 1/m: those of the last two places, then the whole range."""
        tried: list[float] = []
        for inverse in (*reversed(self.inverse_depths[-2:]), *SEARCH_INVERSE_DEPTHS):
            if all(abs(inverse - other) > SAME_SPAN for other in tried):
                tried.append(inverse)
                yield inverse

    def add(self, offset: tuple[NDArray[np.float64], NDArray[np.float64]], inverse_depth: float) -> None:
        """Add a place; an offset that cannot be separated from depth counts as depth."""
        across = (offset[0][0] + offset[1][0]) / 2.0
        self.offsets.append((np.array([across, offset[0][1]]), np.array([across, offset[1][1]])))
        self.inverse_depths.append(inverse_depth)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _FoundPatch:
    """A look that shows the patch in both eyes: (2,) tangents from each gaze, and the match of both."""

    sighting: Sighting
    left: NDArray[np.float64]
    right: NDArray[np.float64]
    fine: FineMatch
    score: float


class DriftPlaceFinder:
    """Measures patches with the head and counts the looks."""

    def __init__(self, head: Head, calibration: Calibration, settings: DriftSettings) -> None:
        self._head = head
        self._calibration = calibration
        self._settings = settings
        self.looks = 0
        self.last: Sighting | None = None

    def measure(self, candidate: DriftPatch, expected: DriftExpectation) -> DriftPlace | None:
        """Return a patch as both eyes see it, or None when they do not both see it well."""
        for inverse in self._reachable_depths(candidate.template, expected):
            found = self._find(candidate.template, expected, inverse)
            if found is None:
                continue
            place = self._measure_centred(candidate, found) or self._measure_off_centre(candidate, found)
            if place is not None:
                self._update(expected, place)
            return place
        return None

    def _reachable_depths(self, template: WidePatch, expected: DriftExpectation) -> Iterator[float]:
        """Yield the inverse depths to look at, 1/m, clamped to the range that both eyes reach there."""
        span = reach_span(self._calibration, template.target, nearest=SEARCH_INVERSE_DEPTHS[-1])
        if span is None:
            return
        tried: list[float] = []
        for wanted in expected.depths():
            inverse = min(max(wanted, span[0]), span[1] - REACH_MARGIN_PER_M)
            if all(abs(inverse - other) > SAME_SPAN / 2.0 for other in tried):
                tried.append(inverse)
                yield inverse

    def _find(self, template: WidePatch, expected: DriftExpectation, inverse: float) -> _FoundPatch | None:
        """Look once, and return where each eye sees the patch, if left and right agree on it."""
        left, right = expected.median_offsets()
        gazes = aim_at(self._calibration, template.target, inverse).moved(left, right)
        sighting = self._look(gazes)
        if sighting is None:
            return None
        look = reduce_look(sighting, self._calibration, f_px=template.f_px)
        reach_px = EXPECTED_REACH_PX if expected.offsets else math.inf
        rows = [look.f_px * float(template.target[1] + offset[1]) for offset in (left, right)]
        at_left = _locate_patch(look.left, look.f_px, template, row_px=rows[0], reach_px=reach_px)
        at_right = _locate_patch(look.right, look.f_px, template, row_px=rows[1], reach_px=reach_px)
        score = min(at_left[1], at_right[1])
        if score < self._settings.score:
            return None
        fine = match_fine(sighting, self._calibration, MatchGuess(left=at_left[0], right=at_right[0]))
        if not self._matches_well(fine, apart=at_left[0] - at_right[0], f_px=look.f_px):
            return None
        return _FoundPatch(sighting=sighting, left=at_left[0], right=at_right[0], fine=fine, score=score)

    def _measure_centred(self, candidate: DriftPatch, found: _FoundPatch) -> DriftPlace | None:
        """Look with the patch at both image centres and measure it; None where an eye cannot turn so far."""
        gazes = gazes_under(self._calibration, found.sighting.volts).moved(found.left, found.right)
        sighting = self._look(gazes)
        template = candidate.template
        if sighting is None or not self._is_static(template, sighting):
            return None
        look = reduce_look(sighting, self._calibration, f_px=template.f_px)
        left, right, _ = vicinity(look, template, np.zeros(2)).peaks()
        fine = match_fine(sighting, self._calibration, MatchGuess(left=left, right=right))
        if not self._matches_well(fine, apart=left - right, f_px=look.f_px):
            return None
        residual = fine.residual_px / self._calibration.fovea_f_px
        mean = vicinity(look, template, np.zeros(2), slope=fine.slope).given(residual)
        if mean.score < self._settings.score:
            return None
        return self._place(candidate, sighting, centre=mean.centre, fine=fine, score=mean.score)

    def _measure_off_centre(self, candidate: DriftPatch, found: _FoundPatch) -> DriftPlace | None:
        """Measure the patch in the look that found it, beside the image centres."""
        if not self._is_static(candidate.template, found.sighting):
            return None
        centre = (found.left + found.right) / 2.0
        return self._place(candidate, found.sighting, centre=centre, fine=found.fine, score=found.score)

    def _place(
        self,
        candidate: DriftPatch,
        sighting: Sighting,
        *,
        centre: NDArray[np.float64],
        fine: FineMatch,
        score: float,
    ) -> DriftPlace:
        gazes = gazes_under(self._calibration, sighting.volts)
        half = fine.residual_px / (2.0 * self._calibration.fovea_f_px)
        seen = gazes.moved(centre + half, centre - half)
        placed = math.hypot(self._settings.placed_sigma_wide_px, candidate.template.sigma_px)
        f_px = self._calibration.fovea_f_px
        return DriftPlace(
            target=_pair(candidate.template.target),
            left=_pair(seen.left),
            right=_pair(seen.right),
            sigma=(
                placed / self._calibration.wide.fx_px,
                fine.sigma_x_px / f_px,
                min(fine.sigma_y_px, 10.0) / f_px,
            ),
            score=score,
            t_ns=sighting.left.t_ns,
            inverse_depth=candidate.known_inverse,
            inverse_sigma=candidate.known_sigma,
        )

    def _update(self, expected: DriftExpectation, place: DriftPlace) -> None:
        """Add the depth and the eye offsets of a place to what later looks expect."""
        apart = place.left[0] - place.right[0]
        inverse = apart / self._calibration.baseline_m
        true = aim_at(self._calibration, np.array(place.target), inverse)
        expected.add((place.seen(Role.LEFT) - true.left, place.seen(Role.RIGHT) - true.right), inverse)

    def _look(self, gazes: Gazes) -> Sighting | None:
        """Take a look, or return None where a gaze is out of range."""
        with suppress(OutOfRange):
            volts = volts_for(self._calibration, gazes)
            self.last = self._head.look(volts)
            self.looks += 1
            return self.last
        return None

    def _matches_well(self, fine: FineMatch, *, apart: NDArray[np.float64], f_px: float) -> bool:
        """Return whether left and right match well, and do so where the wide patch was found (`apart`)."""
        settings = self._settings
        differ_px = np.abs(apart - fine.residual_px / self._calibration.fovea_f_px).max() * f_px
        clear = fine.score >= settings.fine_score and fine.sigma_x_px <= settings.fine_sigma_px
        return bool(clear and differ_px <= EYES_AGREE_PX)

    def _is_static(self, template: WidePatch, sighting: Sighting) -> bool:
        """Return whether the patch has not moved in the wide picture of this look."""
        image = gray(to_uint8(sighting.wide))
        return follow(template, image, self._calibration.wide, elapsed_s=0.0) is template.target


def _locate_patch(
    eye: ReducedEye, f_px: float, template: WidePatch, *, row_px: float, reach_px: float
) -> tuple[NDArray[np.float64], float]:
    """Return the patch's (2,) tangents from an eye's gaze, and the correlation there.

    The whole field is searched, or the rows within `reach_px` of `row_px`, survey px of the plane.
    """
    height, width = template.patch.shape
    half_x, half_y = (width - 1) // 2, (height - 1) // 2
    scores = score_map(eye.image, template.patch)
    scores[eye.hidden(template.patch.shape)] = UNSEEN
    if math.isfinite(reach_px):
        v_px = np.arange(len(scores)) + eye.v0_px + half_y
        scores[np.abs(v_px - row_px) > reach_px] = UNSEEN
    x, y, score = peak(scores)
    at = np.array([eye.u0_px + half_x + x, eye.v0_px + half_y + y])
    return (at - eye.centre_px) / f_px, score


def _pair(values: NDArray[np.float64]) -> tuple[float, float]:
    x, y = values.tolist()
    return x, y
