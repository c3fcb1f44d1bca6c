"""The closed loop of both foveae (Sec. 3.4): find the target in both, verge on it, confirm what is seen.

Every look is matched twice, against the wide view and left against right; both must agree before the loop
counts as verged, and the match must be of the point itself (`support`). If the target was lost while somebody
crossed the view, the search is repeated afterwards.
"""

from dataclasses import dataclass, replace

import numpy as np

from foveacam_hardware.contract import Frame, OutOfRange, Role
from foveacam_hardware.contract.spans import span
from foveacam_pipeline.matching.picture import WindowPlacement
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.verge import verdict
from foveacam_pipeline.verge.aim import Gazes, aim_at
from foveacam_pipeline.verge.distance import LocatedPoint, triangulate
from foveacam_pipeline.verge.looking.fixation_head import FixationEnded, FixationHead, Observation, StepResult
from foveacam_pipeline.verge.looking.motion import TargetMotion, TargetTracker
from foveacam_pipeline.verge.looking.passing_detector import PassingDetector
from foveacam_pipeline.verge.matching.centre_match import match_centres, shows_another
from foveacam_pipeline.verge.matching.fine import FineMatch, MatchGuess, eye_patch, guessed_depth_m
from foveacam_pipeline.verge.matching.support import (
    FOVEA_SCALE,
    SECTORS,
    MatchSupport,
    SupportReport,
    support_of,
)
from foveacam_pipeline.verge.matching.wide_patch import WidePatch
from foveacam_pipeline.verge.measure import Measurement, measure, point_sigma_px
from foveacam_pipeline.verge.resolved_target import ResolvedTarget, patches_for
from foveacam_pipeline.verge.search import FoundTarget, TargetSearch
from foveacam_pipeline.verge.settings import VergeSettings
from foveacam_pipeline.verge.values import Basis, FixationState, VergePhase

LAG_GAIN = 0.7
LAG_MAX_PX = 1.5
"""Integral gain that compensates the lag behind an approaching or receding target, and the largest residual
that is integrated, fovea px."""
CONVERGED_SIGMAS = 2.0
"""A residual within this many standard errors of its match cannot be reduced by another look."""
ROUGH_SIGMA_PX = 2.0
"""A match with a larger standard error is not used for steering, fovea px."""
SAME_LOOK_PX = 4.0
"""Looks whose gazes differ by less show the same, fovea px."""
SUPPORT_HALF_PX = 64
"""Half side of the pictures that are compared to judge the support of a match, fovea px."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VergedTarget:
    """Result of a loop that verged: where both lines of sight meet, the match, and its support."""

    point: LocatedPoint
    fine: FineMatch
    support: SupportReport


class UnsupportedMatch(FixationEnded):
    """Both foveae verged, but on something beside the point; `verged` is the match there."""

    def __init__(self, verged: VergedTarget) -> None:
        super().__init__(FixationState.LOST, verdict.UNSUPPORTED)
        self.verged = verged


class CoveredTarget(FixationEnded):
    """Both foveae verged, but on something that moved in front of the target after the click."""

    def __init__(self) -> None:
        moved = verdict.moved_away()
        super().__init__(moved.state, moved.reason)


class ClosedLoop:
    """Finds one target with both foveae and verges on it; keeps its looks and its track after a failure."""

    def __init__(
        self,
        fixation_head: FixationHead,
        calibration: Calibration,
        limits: VergeSettings,
        *,
        expected_per_m: float | None = None,
    ) -> None:
        """`expected_per_m`: 1/Z of the target if known beforehand; seeds the search."""
        self._expected_per_m = expected_per_m
        self._fixation_head = fixation_head
        self._calibration = calibration
        self._limits = limits
        self._search = TargetSearch(fixation_head, calibration, limits)
        self._f_px = calibration.fovea_f_px
        self._lag_px = np.zeros(2)
        self._tracker: TargetTracker | None = None
        self._hidden = False
        self.templates: tuple[WidePatch, ...] = ()
        """Patches of the wide image that represent the target, best first; empty before `run`."""

    @property
    def looks(self) -> tuple[Observation, ...]:
        """The looks of the search."""
        return self._search.looks

    @property
    def motion(self) -> TargetMotion | None:
        """The target's track; None before `run`."""
        return None if self._tracker is None else self._tracker.motion

    def gone(self, frame: Frame) -> bool:
        """Return whether a wide frame shows a textured target neither where it was nor on its track."""
        return self._tracker is not None and self._tracker.gone(frame)

    def covered(self, frame: Frame) -> bool:
        """Return whether a wide frame shows something in front of the target, which was not seen to move."""
        return self._tracker is not None and self._tracker.covered(frame)

    def run(self, aim: ResolvedTarget, *, clicked: Frame | None = None) -> VergedTarget:
        """Return the verged target, or raise FixationEnded.

        `clicked`: the wide frame on which the target was chosen, by default the newest one. A moving target
        is tracked from that frame on.
        """
        frame = self._fixation_head.wide() if clicked is None else clicked
        try:
            templates = patches_for(gray(to_uint8(frame)), aim, self._calibration.wide, self._limits)
        except OutOfRange as error:
            raise FixationEnded(FixationState.OUT_OF_RANGE, f"Out of the wide view: {error}.") from error
        self.templates = templates
        try:
            return self._attempt(templates, frame)
        except UnsupportedMatch:
            raise
        except CoveredTarget:
            return self.once_passed()
        except FixationEnded as end:
            if not self._crossed(end, templates[0], frame):
                raise
        return self.once_passed()

    def once_passed(self) -> VergedTarget:
        """Search the target of `run` again, when whatever crossed the view has passed.

        Raise FixationEnded, `verdict.moved_away` if the wide view shows a textured target neither where it
        was nor where its track predicts it; then further calls do not wait again.
        """
        if self._hidden or self._tracker is None:
            raise verdict.moved_away()
        self._fixation_head.wait_until_still(
            PassingDetector(self._calibration.wide, self.templates[0].target), shown=self._tracker.shown
        )
        frame = self._fixation_head.wide()
        self._hidden = self.gone(frame)
        if self._hidden:
            raise verdict.moved_away()
        place = self._tracker.place_in(frame)
        self.templates = tuple(replace(template, target=place) for template in self.templates)
        return self._attempt(self.templates, frame)

    @property
    def textured(self) -> bool:
        """Whether the target itself has texture: the patch of a blank one had to grow until it held some."""
        if not self.templates or max(self.templates[0].half_px) > self._limits.template_half_px:
            return False
        return self.templates[0].sigma_px <= self._limits.template_texture_sigma_px

    def close_at(self, inverse_z_per_m: float) -> VergedTarget | None:
        """Verge on the target of `run` from a depth known by other means; return None if that fails."""
        if self._tracker is None:
            return None
        self._lag_px = np.zeros(2)
        target = self._tracker.motion.at(self._fixation_head.next_ns)
        gazes = aim_at(self._calibration, target, inverse_z_per_m)
        found = FoundTarget(gazes=gazes, templates=self.templates, joint=1.0)
        try:
            return self._close(found, self._tracker)
        except FixationEnded:
            return None

    def _attempt(self, templates: tuple[WidePatch, ...], frame: Frame) -> VergedTarget:
        tracker = TargetTracker(templates[0], frame, self._calibration.wide, plain=not self.textured)
        tracker.follow(self._fixation_head.wide())  # newer than the frame that was clicked
        self._tracker = tracker
        self._lag_px = np.zeros(2)
        try:
            with span("search"):
                found = self._search.find(templates, tracker, expected_per_m=self._expected_per_m)
            return self._close(found, tracker)
        except (UnsupportedMatch, CoveredTarget):
            raise
        except FixationEnded as end:
            target_offset = (
                self._search.target_offset(templates, tracker.motion)
                if self._doubtful(end, templates[0])
                else None
            )
            if target_offset is None:
                raise
            raise verdict.elsewhere(target_offset) from end

    def _doubtful(self, end: FixationEnded, template: WidePatch) -> bool:
        """Return whether a failure may have a cause other than the target itself."""
        blank = template.sigma_px > self._limits.no_texture_sigma_px
        lost = end.state in {FixationState.LOST, FixationState.NO_TEXTURE} and end.missing is None
        return lost and not blank

    def _crossed(self, end: FixationEnded, template: WidePatch, frame: Frame) -> bool:
        """Return whether something that crossed the view since a frame may have caused a failure."""
        around = PassingDetector(self._calibration.wide, template.target)
        return self._doubtful(end, template) and around.differ(frame, self._fixation_head.wide())

    def _close(self, found: FoundTarget, tracker: TargetTracker) -> VergedTarget:
        """Verge until left and right agree to half a pixel and the wide view agrees with both."""
        target, phase, doubts = found.gazes, VergePhase.COARSE, 0
        while True:
            observation = self._fixation_head.look(self._led(target, tracker.motion), phase)
            phase = VergePhase.FINE
            tracker.follow(observation.sighting.wide)
            with span("match"):
                measurement = self._measure(observation, found, tracker.motion)
            doubt = verdict.doubt(measurement, self._limits)
            settled = doubt is None and self._settled(observation, measurement, tracker)
            if settled and abs(measurement.fine.residual_y_px) > self._rows_apart_px(
                moving=tracker.motion.moves
            ):
                doubt, settled = verdict.rows_differ(measurement), False
            other = self._another(observation, measurement, found, tracker.motion) if settled else None
            x_px, y_px = measurement.fine.residual_x_px, measurement.fine.residual_y_px
            self._fixation_head.record(
                observation, StepResult(score=measurement.fine.score, residual_x_px=x_px, residual_y_px=y_px)
            )
            if other is not None:
                raise other
            wide = observation.sighting.wide
            if settled and (tracker.covered(wide) or tracker.off_track(wide)):
                raise CoveredTarget
            if settled:
                return self._verged(observation, self._measured(observation, measurement), measurement.fine)
            if doubt is None:
                lines = self._measured(observation, measurement)
                self._fixation_head.report_estimate(Basis.BOTH_FOVEAE, self._located(lines, measurement.fine))
            doubts = 0 if doubt is None else doubts + 1
            if doubt is not None and doubts > self._limits.doubtful_looks:
                raise doubt
            before, target = target, self._next(observation, measurement, found, tracker) or target
            same = target.apart(before) * self._f_px <= SAME_LOOK_PX
            if doubt is not None and same and not tracker.motion.moves:
                raise doubt  # a further look would show the same

    def _led(self, target: Gazes, motion: TargetMotion) -> Gazes:
        """Return the gazes moved to where a moving target is predicted at the next look."""
        if not motion.moves:
            return target
        ahead = motion.at(self._fixation_head.next_ns) - (target.left + target.right) / 2.0
        return target.moved(ahead, ahead)

    def _measure(self, observation: Observation, found: FoundTarget, motion: TargetMotion) -> Measurement:
        return measure(
            observation,
            found.templates,
            motion.at(observation.sighting.left.t_ns),
            calibration=self._calibration,
            limits=self._limits,
        )

    def _another(
        self, observation: Observation, measurement: Measurement, found: FoundTarget, motion: TargetMotion
    ) -> FixationEnded | None:
        """Return the failure if both eyes see something else, or either a look-alike beside the target.

        A look-alike fits far better in one eye, or better in both. None where there is neither.
        """
        image = gray(to_uint8(observation.sighting.wide))
        target, half = (
            motion.at(observation.sighting.wide.t_ns),
            measurement.fine.residual_px / (2.0 * self._f_px),
        )
        left, right = measurement.centre + half, measurement.centre - half
        if shows_another(measurement.look, image, self._calibration.wide, target, left=left, right=right):
            return verdict.another(measurement)
        matches = match_centres(
            measurement.look,
            found.templates[0],
            image,
            self._calibration.wide,
            target,
            slope=measurement.fine.slope,
        )
        leads = [match.best - match.here for match in matches]
        alone = max(leads) <= self._limits.neighbour_lead or self._alike_all_around(observation, measurement)
        if alone and min(leads) <= self._limits.neighbour_lead_both:
            return None
        side, match = max(
            zip(("left", "right"), matches, strict=True), key=lambda sided: abs(sided[1].aside_wide_px)
        )
        return verdict.neighbour(side, aside_px=match.aside_wide_px)

    def _alike_all_around(self, observation: Observation, measurement: Measurement) -> bool:
        """Return whether the foveae show the same at the point and all around it.

        Then what one eye shows is what the other shows too, and the eye that fits the wide view better
        decides: 9 of 9 such matches with a look-alike in one eye were right.
        """
        report = self._support(observation, self._measured(observation, measurement), measurement.fine)
        return report.support is MatchSupport.MATCHED and report.sectors == SECTORS

    def _measured(self, observation: Observation, measurement: Measurement) -> Gazes:
        """Return the lines of sight to the target, as measured in a look."""
        half = measurement.fine.residual_px / (2.0 * self._f_px)
        return observation.gazes.moved(measurement.centre + half, measurement.centre - half)

    def _next(
        self, observation: Observation, measurement: Measurement, found: FoundTarget, tracker: TargetTracker
    ) -> Gazes | None:
        """Return the next gazes: at the measured target, else at another match in this look, else None."""
        if (
            measurement.fine.score >= self._limits.fine_score
            and measurement.fine.sigma_x_px <= ROUGH_SIGMA_PX
        ):
            if observation.phase is VergePhase.FINE and abs(measurement.fine.residual_x_px) < LAG_MAX_PX:
                self._lag_px += LAG_GAIN * measurement.fine.residual_px
            lag = self._lag_px / (2.0 * self._f_px)
            lines = self._measured(observation, measurement)
            onto = self._search.centred(lines, tracker, aside_lead=measurement.aside_lead)
            gazes: Gazes | None = onto.moved(lag, -lag)
        else:
            gazes = self._search.recover(observation, found, tracker)
        doubtful = measurement.quality(self._limits) < 0.0
        if gazes is not None and (tracker.motion.moves or doubtful):  # else only the wide view updates it
            tracker.add_direction((gazes.left + gazes.right) / 2.0, observation.sighting.left.t_ns)
        return gazes

    def _settled(self, observation: Observation, measurement: Measurement, tracker: TargetTracker) -> bool:
        moving = tracker.motion.moves
        fine = measurement.fine
        apart_px = abs(fine.residual_x_px)
        if fine.sigma_y_px <= self._limits.fine_sigma_px:  # otherwise the texture does not determine the row
            apart_px = max(apart_px, abs(fine.residual_y_px))
        centred_px = self._centred_wide_px(moving=moving)
        lines = self._measured(observation, measurement)
        there = self._search.centred(lines, tracker, aside_lead=measurement.aside_lead)
        aside = (there.left + there.right - observation.gazes.left - observation.gazes.right) / 2.0
        off_wide_px = float(np.abs(aside).max()) * self._calibration.wide.fx_px
        converged_px = self._limits.converged_moving_px if moving else self._limits.converged_px
        converged_px = max(converged_px, CONVERGED_SIGMAS * fine.sigma_x_px)
        return apart_px <= converged_px and off_wide_px <= centred_px

    def _rows_apart_px(self, *, moving: bool) -> float:
        """Return the largest row difference that a match may have, fovea px; true matches keep their row."""
        return self._limits.converged_moving_px if moving else self._limits.rows_apart_px

    def _centred_wide_px(self, *, moving: bool) -> float:
        """Return how far from the centres the target of this look may lie, wide px."""
        limits = self._limits
        if len(self._fixation_head.steps) < (
            limits.centring_moving_looks if moving else limits.centring_looks
        ):
            return limits.centred_soon_wide_px
        return limits.centred_moving_wide_px if moving else limits.centred_wide_px

    def _located(self, target: Gazes, fine: FineMatch) -> LocatedPoint | None:
        """Return the point where the lines of sight of a match meet; None if they diverge."""
        sigma_px = point_sigma_px(fine, self._calibration, self._limits)
        return triangulate(self._calibration, target, sigma_px=sigma_px)

    def _verged(self, observation: Observation, target: Gazes, fine: FineMatch) -> VergedTarget:
        point = self._located(target, fine)
        if point is None:
            raise FixationEnded(
                FixationState.LOST,
                "Left and right agree, but their lines of sight diverge: the calibration cannot resolve this "
                "distance; calibrate the mirrors again.",
            )
        verged = VergedTarget(point=point, fine=fine, support=self._support(observation, target, fine))
        if verged.support.support in {MatchSupport.DIFFERENT, MatchSupport.BESIDE}:
            raise UnsupportedMatch(verged)
        return verged

    def _support(self, observation: Observation, target: Gazes, fine: FineMatch) -> SupportReport:
        """Return the support of a look's match at the point itself."""
        guess = MatchGuess(
            left=target.left - observation.gazes.left, right=target.right - observation.gazes.right
        )
        z_m = guessed_depth_m(self._calibration, observation.sighting, guess)
        binning = observation.sighting.left.binning
        half = (SUPPORT_HALF_PX // binning, SUPPORT_HALF_PX // binning)
        left, right = (
            eye_patch(observation.sighting, self._calibration, role, z_m, self._f_px * offset, half)
            for role, offset in ((Role.LEFT, guess.left), (Role.RIGHT, guess.right))
        )
        leaning = right.cut(half, WindowPlacement(xx=fine.slope[0], xy=fine.slope[1]))
        report = support_of(left.image, leaning, scale=FOVEA_SCALE.binned(binning))
        x_px, y_px = report.alike_offset_px
        return replace(report, alike_offset_px=(binning * x_px, binning * y_px))
