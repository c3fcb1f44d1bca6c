"""Search for the target in both foveae: a parallel look first, then nearer ones along the epipolar line.

A candidate counts as found when left and right agree on it at full resolution: then it is a surface on the
target's line of sight, whatever the wide view alone suggests.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.verge import verdict
from foveacam_pipeline.verge.aim import Gazes, aim_at, centred_on_ray, reach_span
from foveacam_pipeline.verge.distance import triangulate
from foveacam_pipeline.verge.looking.fixation_head import FixationHead, Observation, StepResult
from foveacam_pipeline.verge.looking.motion import TargetMotion, TargetTracker
from foveacam_pipeline.verge.matching.fine import FineMatch, MatchGuess, match_fine
from foveacam_pipeline.verge.matching.register import MOVING_SLACK_PX, SLACK_PX, MatchCandidate, candidates
from foveacam_pipeline.verge.matching.survey import epipolar_looks
from foveacam_pipeline.verge.matching.target_offset import TargetOffset, find_target_offset, stands_alone
from foveacam_pipeline.verge.matching.wide_patch import WidePatch
from foveacam_pipeline.verge.measure import point_sigma_px
from foveacam_pipeline.verge.settings import VergeSettings
from foveacam_pipeline.verge.values import Basis, VergePhase

ALIKE = 0.08
"""Candidates whose correlations differ by less fit equally well."""
ASTRAY_SLACK_PX = 24
"""Search range along the row about the predicted place when a target is searched for again, survey px."""
SAME_PX = 3.0
"""Candidates closer to each other than this are the same, survey px."""
SAME_FINE_PX = 12.0
"""Left-right matches whose disparities differ by less are of one surface, fovea px."""
LEAST_STEP_PER_M = 0.02
"""A last look that is nearer by less than this is left out: it shows nothing new, 1/m."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FoundTarget:
    """Gazes that centre the target in both eyes; its patches, that by which it was found first."""

    gazes: Gazes
    templates: tuple[WidePatch, ...]
    joint: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Sure:
    """Outcome of one look: a candidate, the patch it was found with, and its left-right match if good."""

    candidate: MatchCandidate
    template: WidePatch
    fine: FineMatch | None


class TargetSearch:
    """Searches for a target in both foveae."""

    def __init__(self, fixation_head: FixationHead, calibration: Calibration, limits: VergeSettings) -> None:
        self._fixation_head = fixation_head
        self._calibration = calibration
        self._limits = limits
        self._looks: list[Observation] = []

    @property
    def looks(self) -> tuple[Observation, ...]:
        """The looks of the last search."""
        return tuple(self._looks)

    def find(
        self, templates: tuple[WidePatch, ...], tracker: TargetTracker, *, expected_per_m: float | None = None
    ) -> FoundTarget:
        """Return the target, or raise FixationEnded; look first at the expected 1/Z, if there is one."""
        best: FoundTarget | None = None
        blank = templates[0].sigma_px > self._limits.no_texture_sigma_px
        self._looks = []
        inverse_z = 0.0
        for inverse_z in self._depths(templates[-1], expected_per_m):
            gazes = aim_at(self._calibration, tracker.motion.at(self._fixation_head.next_ns), inverse_z)
            observation = self._fixation_head.look(
                gazes, VergePhase.EPIPOLAR if inverse_z else VergePhase.PARALLEL
            )
            self._looks.append(observation)
            tracker.follow(observation.sighting.wide)
            slack_px = MOVING_SLACK_PX if tracker.motion.moves else SLACK_PX
            outcome = self._examine(observation, templates, tracker.motion, slack_px=slack_px)
            self._fixation_head.record(observation, self._step(outcome))
            if observation.sighting.missing is not None:
                raise verdict.camera_gone(observation.sighting.missing)
            if blank:
                raise verdict.blank_patch()
            if outcome is None:
                continue
            found = self._found(observation, outcome, templates, tracker)
            if outcome.fine is not None:
                self._report_distance(found.gazes, outcome.fine)
                return found
            if best is None or found.joint > best.joint:
                best = found
        if best is None or best.joint < self._limits.register_joint:
            raise verdict.not_found(self._limits, nearest_m=1.0 / inverse_z if inverse_z else math.inf)
        return best

    def _report_distance(self, lines: Gazes, fine: FineMatch) -> None:
        """Report the distance on which left and right agree."""
        sigma_px = point_sigma_px(fine, self._calibration, self._limits)
        self._fixation_head.report_estimate(
            Basis.BOTH_FOVEAE, triangulate(self._calibration, lines, sigma_px=sigma_px)
        )

    def recover(self, observation: Observation, found: FoundTarget, tracker: TargetTracker) -> Gazes | None:
        """Return gazes to another place of a doubtful look where left and right agree on the patch."""
        outcome = self._examine(observation, found.templates, tracker.motion, slack_px=ASTRAY_SLACK_PX)
        if outcome is None or outcome.fine is None or outcome.candidate.score < self._limits.offset_score:
            return None
        return self._found(observation, outcome, found.templates, tracker).gazes

    def target_offset(self, templates: tuple[WidePatch, ...], motion: TargetMotion) -> TargetOffset | None:
        """Return the offset from its place at which a failed search shows a stationary target, or None."""
        for observation in () if motion.moves else self._looks:
            look = observation.reduced(self._calibration, f_px=templates[0].f_px)
            target = motion.at(observation.sighting.left.t_ns)
            for template in templates:
                target_offset = find_target_offset(
                    look,
                    template,
                    target,
                    f_px=self._calibration.fovea_f_px,
                    rows_apart_px=self._limits.rows_apart_survey_px,
                )
                if target_offset is not None and self._alone(observation, template, target):
                    return target_offset
        return None

    def _alone(self, observation: Observation, template: WidePatch, target: NDArray[np.float64]) -> bool:
        return stands_alone(
            gray(to_uint8(observation.sighting.wide)), self._calibration.wide, template, target
        )

    def _examine(
        self,
        observation: Observation,
        templates: tuple[WidePatch, ...],
        motion: TargetMotion,
        *,
        slack_px: int,
    ) -> _Sure | None:
        """Return the candidate on which left and right agree, or else the best unconfirmed one.

        Raise FixationEnded when they agree on several that fit the wide view equally well, with every patch.
        """
        look = observation.reduced(self._calibration, f_px=templates[0].f_px)
        target = motion.at(observation.sighting.left.t_ns)
        tried: list[_Sure] = []
        alike: list[_Sure] = []
        for template in templates:
            if alike and template.half_px < alike[0].template.half_px:
                continue  # a smaller patch of a pattern is as ambiguous
            places = candidates(look, template, target, slack_px=slack_px)
            proven = self._proven(observation, template, places, tried)
            if len(proven) == 1:
                return proven[0]
            alike = max(alike, proven, key=len)
            if not alike and len(tried) >= self._limits.candidates_tried:
                break
        if alike:
            raise verdict.many_alike(len(alike))
        return max(tried, key=lambda outcome: outcome.candidate.joint, default=None)

    def _proven(
        self,
        observation: Observation,
        template: WidePatch,
        places: tuple[MatchCandidate, ...],
        tried: list[_Sure],
    ) -> list[_Sure]:
        """Return the candidates on which left and right agree and that fit the wide view equally well.

        `tried`: all places of this look that were matched before, for any patch; new ones are added.
        """
        proven: list[_Sure] = []
        for candidate in filter(self._worth_trying, places):
            if proven and candidate.joint < proven[0].candidate.joint - ALIKE:
                break
            outcome = _Sure(candidate=candidate, template=template, fine=None)
            before = next((other for other in tried if _same(outcome, other)), None)
            if before is None:
                outcome = replace(outcome, fine=self._prove(observation, candidate))
                tried.append(outcome)
            else:
                outcome = replace(outcome, fine=before.fine)
            if outcome.fine is not None and not any(_one_surface(outcome, other) for other in proven):
                proven.append(outcome)
        return proven

    def _prove(self, observation: Observation, candidate: MatchCandidate) -> FineMatch | None:
        """Return the left-right match of a candidate if it is good, else None."""
        guess = MatchGuess(left=candidate.left, right=candidate.right)
        fine = match_fine(observation.sighting, self._calibration, guess)
        precise = fine.sigma_x_px <= self._limits.largest_sigma_px(fine.score)
        good = precise and fine.score >= self._limits.fine_score
        return fine if good else None

    def _worth_trying(self, candidate: MatchCandidate) -> bool:
        limits = self._limits
        return (
            candidate.score >= limits.register_score
            and candidate.rows_apart_px <= limits.rows_apart_survey_px
        )

    def centred(self, lines: Gazes, tracker: TargetTracker, *, aside_lead: float = math.inf) -> Gazes:
        """Return the lines of sight to a target, moved onto its ray if it is stationary and close to them.

        `aside_lead`: how much better its patch fits on these lines than on its ray.
        """
        if not tracker.stands:
            return lines
        clear = aside_lead > self._limits.aside_lead
        within_px = self._limits.centred_wide_px if clear else self._limits.aside_wide_px
        within_tan = within_px / self._calibration.wide.fx_px
        target = tracker.motion.at(tracker.motion.seen_ns)
        return centred_on_ray(self._calibration, lines, target, within_tan=within_tan)

    def _found(
        self,
        observation: Observation,
        outcome: _Sure,
        templates: tuple[WidePatch, ...],
        tracker: TargetTracker,
    ) -> FoundTarget:
        left, right = outcome.candidate.left, outcome.candidate.right
        if outcome.fine is not None:
            centre = (left + right) / 2.0
            half = outcome.fine.residual_px / (2.0 * self._calibration.fovea_f_px)
            left, right = centre + half, centre - half
        others = tuple(other for other in templates if other is not outcome.template)
        return FoundTarget(
            gazes=self.centred(observation.gazes.moved(left, right), tracker),
            templates=(outcome.template, *others),
            joint=outcome.candidate.joint,
        )

    def _step(self, outcome: _Sure | None) -> StepResult:
        if outcome is None:
            return StepResult(score=0.0)
        if outcome.fine is not None:
            x, y = outcome.fine.residual_x_px, outcome.fine.residual_y_px
            return StepResult(score=outcome.fine.score, residual_x_px=x, residual_y_px=y)
        apart: NDArray[np.float64] = outcome.candidate.left - outcome.candidate.right
        x, y = (apart * self._calibration.fovea_f_px).tolist()
        return StepResult(score=outcome.candidate.score, residual_x_px=x, residual_y_px=y)

    def _depths(self, template: WidePatch, expected_per_m: float | None) -> Iterator[float]:
        """Yield 1/Z, 1/m, of a search's looks, from parallel (Sec. 3.4) to the nearest that both eyes reach.

        The expected depth comes first. If an eye cannot look parallel, the farthest depth that both reach
        replaces it.
        """
        wanted = list(epipolar_looks(self._calibration, template, self._limits.nearest_m))
        span = reach_span(self._calibration, template.target, nearest=wanted[-1])
        if span is None:
            yield 0.0  # the look raises the error, which names the eye
            return
        if expected_per_m is not None:
            yield min(max(expected_per_m, span[0]), span[1])
        last = -math.inf
        for inverse_z in wanted:
            inverse_z = min(max(inverse_z, span[0]), span[1])
            if inverse_z > last + LEAST_STEP_PER_M:
                yield inverse_z
                last = inverse_z


def _same(one: _Sure, other: _Sure) -> bool:
    """Return whether two candidates are the same place."""
    gaps = [
        one.candidate.left - other.candidate.left,
        one.candidate.right - other.candidate.right,
    ]
    return float(np.abs(gaps).max()) * one.template.f_px <= SAME_PX


def _one_surface(one: _Sure, other: _Sure) -> bool:
    """Return whether left and right agree on one disparity for both candidates."""
    if one.fine is None or other.fine is None:
        return False
    apart_px = abs(one.fine.residual_x_px - other.fine.residual_x_px)
    return apart_px <= SAME_FINE_PX
