"""Search for a target in single foveae: looks along the epipolar line, then at the matches found."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame, Role
from foveacam_pipeline.matching.correlation import UNSEEN
from foveacam_pipeline.matching.picture import InterpolatedPicture, WindowPlacement
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.verge.aim import EYES, Gazes, aim_at, clamp_gazes, reaches
from foveacam_pipeline.verge.looking.fixation_head import FixationHead, Observation, StepResult
from foveacam_pipeline.verge.looking.motion import TargetMotion
from foveacam_pipeline.verge.matching.fine import MatchGuess, match_fine
from foveacam_pipeline.verge.matching.support import SURVEY_SCALE, MatchSupport, support_of
from foveacam_pipeline.verge.matching.survey import (
    ReducedEye,
    epipolar_looks,
    reduce_eye,
)
from foveacam_pipeline.verge.matching.texture import noise_level
from foveacam_pipeline.verge.matching.wide_patch import WidePatch, cut_view, survey_f_px
from foveacam_pipeline.verge.settings import VergeSettings
from foveacam_pipeline.verge.single_eye.eye_match import (
    CorrelationProfile,
    EyeMatch,
    profile_of,
    register_eye,
    side_of,
    view_half_px,
)
from foveacam_pipeline.verge.single_eye.weighing import (
    AGREE_SIGMAS,
    agree,
    only_sure,
    outdone,
    sound,
    weighted,
)
from foveacam_pipeline.verge.surroundings.blank_region import on_edge, side_of_edge
from foveacam_pipeline.verge.surroundings.border_depth import BorderDepth, BorderPlace, border_patch
from foveacam_pipeline.verge.values import VergePhase

STEP_PX = 0.5
"""Step of the profiles along the line, survey px."""
ROW_PX = 4.0
"""Largest offset from the expected row, survey px."""
CENTRED_PX = 0.4
"""Displacement below which a look needs no further one to centre the target, survey px."""
THERE_STEPS = 3
"""Steps about a depth within which the target must be matched to count as shown there."""
ROUNDS = 3
HALF_SHOWN_SCORE = 0.6
"""Least correlation of the foveae with each other at which they show something in common."""
SIDE_DEEPER_SHARE = 0.97
"""Largest 1/Z of what lies beside an edge, as a share of the edge's: it is farther than the edge."""
SAME_GAZE = 0.006
"""Looks whose gazes differ by less show the same, tangents."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EyeSighting:
    """A target that one fovea has looked at: the match, and whether it is of the point itself.

    `between_score`: correlation of the foveae with each other there; None where the other cannot turn.
    """

    match: EyeMatch
    support: MatchSupport
    between_score: float | None

    @property
    def supported(self) -> bool:
        """Return whether the match is of the point itself."""
        return self.support in {MatchSupport.MATCHED, MatchSupport.ENCLOSED}

    @property
    def at_edge(self) -> bool:
        """Return whether the other eye shows part of it: then it is the edge of something beside the target.

        What is hidden from an eye does not appear in it at all.
        """
        return self.between_score is not None and self.between_score >= HALF_SHOWN_SCORE


@dataclass(frozen=True, slots=True, kw_only=True)
class OwnSide:
    """The depth of a target's own side of an edge: the eyes that show it, 1/Z and its standard error."""

    roles: frozenset[Role]
    inverse_z_per_m: float
    sigma_per_m: float

    def shares(self, inverse_z_per_m: float) -> bool:
        """Return whether the surface has this 1/Z, within its error."""
        return abs(self.inverse_z_per_m - inverse_z_per_m) <= AGREE_SIGMAS * self.sigma_per_m

    def agrees(self, match: EyeMatch) -> bool:
        """Return whether the match of one eye has this surface's depth, within both errors."""
        apart = abs(self.inverse_z_per_m - match.inverse_z_per_m)
        return apart <= AGREE_SIGMAS * math.hypot(self.sigma_per_m, match.sigma_per_m)


class SingleEyeSearch:
    """Finds a target in either fovea by the wide view alone."""

    def __init__(self, fixation_head: FixationHead, calibration: Calibration, limits: VergeSettings) -> None:
        self._fixation_head = fixation_head
        self._calibration = calibration
        self._limits = limits
        self._looks: list[Observation] = []

    @property
    def looks(self) -> tuple[Observation, ...]:
        """Looks of the last search, earlier ones included."""
        return tuple(self._looks)

    def matches(
        self,
        templates: tuple[WidePatch, ...],
        motion: TargetMotion,
        earlier: tuple[Observation, ...],
        *,
        span_per_m: tuple[float, float],
    ) -> list[EyeMatch]:
        """Return the matches of the target in either fovea, best first: at most one an eye.

        `earlier`: looks already made. `span_per_m`: least and largest 1/Z to consider.
        """
        looks = self._looks = self._survey(templates[-1], motion, earlier)
        f_px = templates[0].f_px
        step = STEP_PX / (f_px * 0.5 * self._calibration.baseline_m)
        grid = np.arange(max(span_per_m[0], -step), span_per_m[1] + step, step)
        reduced = [observation.reduced(self._calibration, f_px=f_px) for observation in looks]
        places = []
        for role in EYES:
            eyes = [look.left if role is Role.LEFT else look.right for look in reduced]
            places.append(self._registered(role, eyes, looks, templates, motion, grid))
        sure = [only_sure(own) for own in places]
        found = [
            match
            for match, other, others in zip(sure, reversed(sure), reversed(places), strict=True)
            if match is not None and (other is not None or not outdone(match, others))
        ]
        return sorted(found, key=lambda match: -match.score)

    def look_at(self, matches: list[EyeMatch], motion: TargetMotion, f_px: float) -> list[EyeSighting]:
        """Look with both eyes at a target that single eyes show; return what is confirmed there.

        Matches of both eyes that agree are looked at together, others one after the other.
        """
        if len(matches) == 2 and agree(*matches):
            return self._look_at(matches, motion, f_px)
        return [sighted for match in matches for sighted in self._look_at([match], motion, f_px)]

    def _look_at(self, matches: list[EyeMatch], motion: TargetMotion, f_px: float) -> list[EyeSighting]:
        """Look at matches of one depth until it stays where it is."""
        inverse_z = weighted(matches)[0]
        for _ in range(ROUNDS):
            gazes = aim_at(self._calibration, motion.at(self._fixation_head.next_ns), max(inverse_z, 0.0))
            observation = self._fixation_head.look_clamped(gazes, VergePhase.FINE)
            view = self._wide_view(observation.sighting.wide, motion, f_px)
            target = motion.at(observation.sighting.left.t_ns)
            shown = [
                self._registered_in(observation, match.role, view, target, inverse_z, f_px=f_px)
                for match in matches
            ]
            scores = [better.score for _, better in shown if better is not None]
            self._fixation_head.record(observation, StepResult(score=max(scores, default=0.0)))
            found = [(eye, better) for eye, better in shown if better is not None and sound(better)]
            if not found:
                return []
            before, inverse_z = inverse_z, weighted([better for _, better in found])[0]
            if abs(inverse_z - before) * f_px * 0.5 * self._calibration.baseline_m <= CENTRED_PX:
                between_score = self._between(observation, gazes)
                return [
                    EyeSighting(
                        match=better,
                        support=self._support(eye, view, target, better, f_px),
                        between_score=between_score,
                    )
                    for eye, better in found
                ]
        return []

    def _registered_in(
        self,
        observation: Observation,
        role: Role,
        view: NDArray[np.float32],
        target: NDArray[np.float64],
        inverse_z_per_m: float,
        *,
        f_px: float,
    ) -> tuple[ReducedEye, EyeMatch | None]:
        """Return one eye's picture in a look, and the match of the target in it."""
        eye = self._eye(observation, role, inverse_z_per_m, f_px)
        match = register_eye(
            eye, role, view, target, inverse_z_per_m, calibration=self._calibration, f_px=f_px
        )
        return eye, match

    def best_score(
        self,
        observation: Observation,
        templates: tuple[WidePatch, ...],
        target: NDArray[np.float64],
        inverse_z_per_m: float,
    ) -> float:
        """Return a look's best correlation with the target at one depth, of any patch in either eye.

        `target`: (2,) tangents at the time of the look.
        """
        f_px, baseline_m = templates[0].f_px, self._calibration.baseline_m
        step = STEP_PX / (f_px * 0.5 * baseline_m)
        reach = THERE_STEPS * step
        about = np.linspace(inverse_z_per_m - reach, inverse_z_per_m + reach, 2 * THERE_STEPS + 1)
        scores = [UNSEEN]
        for role in EYES:
            eye = self._eye(observation, role, inverse_z_per_m, f_px)
            for template in templates:
                profile = profile_of(
                    eye, role, template, target, inverse_z_per_m=about, baseline_m=baseline_m
                )
                scores.append(float(profile.scores.max()))
        return max(scores)

    def beside_edge(self, edge: EyeSighting, target: NDArray[np.float64], frame: Frame) -> BorderDepth | None:
        """Return the depth behind an edge on the target's side of it; None where nothing is matched.

        Only the part of the wide view on the target's side is compared. `target`: (2,) tangents.
        """
        nearest = SIDE_DEEPER_SHARE * edge.match.inverse_z_per_m
        image, at_px, side = self._side(target, frame)
        return self._place_on(side, image, target, at_px, nearest).depth()

    def on_own_side(
        self, target: NDArray[np.float64], frame: Frame, *, nearest_per_m: float
    ) -> OwnSide | None:
        """Return the depth on the target's own side of the edge beside it; None where that is not certain.

        Each eye is compared with that side alone, not with what lies beyond the edge. A target on the edge
        itself may be on either side. `target`: (2,) tangents.
        """
        image, at_px, side = self._side(target, frame)
        if on_edge(side, at_px, binning=frame.binning):
            return None
        found = self._place_on(side, image, target, at_px, nearest_per_m).sure_of_each()
        if not found:
            return None
        depths, sigmas = np.array(list(found.values())).T
        if float(np.ptp(depths)) > AGREE_SIGMAS * float(np.hypot.reduce(sigmas)):
            return None
        weights = sigmas**-2.0
        return OwnSide(
            roles=frozenset(found),
            inverse_z_per_m=float(weights @ depths / weights.sum()),
            sigma_per_m=float(weights.sum() ** -0.5),
        )

    def _side(
        self, target: NDArray[np.float64], frame: Frame
    ) -> tuple[NDArray[np.uint8], NDArray[np.float64], NDArray[np.uint8]]:
        """Return the wide image, the target's pixel (2,) of it, and the mask of its side of an edge."""
        picture, wide = to_uint8(frame), self._calibration.wide.binned(frame.binning)
        at_px = wide.pixels(np.arctan(target)[None])[0]
        return gray(picture), at_px, side_of_edge(picture, at_px, binning=frame.binning)

    def _place_on(
        self,
        side: NDArray[np.uint8],
        image: NDArray[np.uint8],
        target: NDArray[np.float64],
        at_px: NDArray[np.float64],
        nearest_per_m: float,
    ) -> BorderPlace:
        """Return the fit of the looks to the part of the wide view on the target's side of an edge."""
        wide, f_px = self._calibration.wide, survey_f_px(self._calibration.wide)
        noise = noise_level(image, at_px=at_px)
        patch = border_patch(image, side, wide, target, f_px=f_px, rim_px=0, noise=noise)
        step = STEP_PX / (f_px * 0.5 * self._calibration.baseline_m)
        grid = np.arange(0.0, nearest_per_m, step)
        place = BorderPlace(patch, inverse_z_per_m=grid, baseline_m=self._calibration.baseline_m, f_px=f_px)
        for observation in self._looks:
            place.add(observation.rows(self._calibration, f_px=f_px))
        return place

    def _between(self, observation: Observation, wanted: Gazes) -> float | None:
        """Return the foveae's correlation where both are meant to look; None if one cannot."""
        if self._fixation_head.missing is not None or not reaches(self._calibration, wanted):
            return None
        offsets = MatchGuess(
            left=wanted.left - observation.gazes.left, right=wanted.right - observation.gazes.right
        )
        return match_fine(observation.sighting, self._calibration, offsets).score

    def _survey(
        self, template: WidePatch, motion: TargetMotion, earlier: tuple[Observation, ...]
    ) -> list[Observation]:
        """Return looks that together cover every depth, those made earlier included."""
        looks = list(earlier)
        for inverse_z in epipolar_looks(self._calibration, template, self._limits.nearest_m):
            gazes = aim_at(self._calibration, motion.at(self._fixation_head.next_ns), inverse_z)
            gazes = clamp_gazes(self._calibration, gazes)
            if any(observation.gazes.apart(gazes) < SAME_GAZE for observation in looks):
                continue
            observation = self._fixation_head.look(
                gazes, VergePhase.EPIPOLAR if inverse_z else VergePhase.PARALLEL
            )
            self._fixation_head.record(observation, StepResult(score=0.0))
            looks.append(observation)
        return looks

    def _registered(
        self,
        role: Role,
        eyes: list[ReducedEye],
        looks: list[Observation],
        templates: tuple[WidePatch, ...],
        motion: TargetMotion,
        grid: NDArray[np.float64],
    ) -> list[EyeMatch]:
        """Return the registrations of all peaks in all looks of one eye, except those in another row."""
        f_px = templates[0].f_px
        views: dict[int, NDArray[np.float32]] = {}
        found: list[EyeMatch] = []
        for template in templates:
            profiles = [
                profile_of(
                    eye,
                    role,
                    template,
                    motion.at(observation.sighting.left.t_ns),
                    inverse_z_per_m=grid,
                    baseline_m=self._calibration.baseline_m,
                )
                for eye, observation in zip(eyes, looks, strict=True)
            ]
            scores = np.array([profile.scores for profile in profiles])
            which = scores.argmax(axis=0)
            best = CorrelationProfile(inverse_z_per_m=grid, scores=scores.max(axis=0))
            for inverse_z, _ in best.peaks(step_px=STEP_PX):
                k = int(which[np.argmin(np.abs(grid - inverse_z))])
                wide = looks[k].sighting.wide
                if wide.seq not in views:
                    views[wide.seq] = self._wide_view(wide, motion, f_px)
                target = motion.at(looks[k].sighting.left.t_ns)
                match = register_eye(
                    eyes[k],
                    role,
                    views[wide.seq],
                    target,
                    inverse_z,
                    calibration=self._calibration,
                    f_px=f_px,
                )
                if match is not None and abs(match.row_px) <= ROW_PX:
                    found.append(match)
        return found

    def _wide_view(self, wide: Frame, motion: TargetMotion, f_px: float) -> NDArray[np.float32]:
        image, target = gray(to_uint8(wide)), motion.at(wide.t_ns)
        return cut_view(image, self._calibration.wide, target, f_px=f_px, half=view_half_px())

    def _eye(self, observation: Observation, role: Role, inverse_z_per_m: float, f_px: float) -> ReducedEye:
        depth_m = 1.0 / inverse_z_per_m if inverse_z_per_m > 0.0 else math.inf
        return reduce_eye(observation.sighting, self._calibration, role, f_px=f_px, depth_m=depth_m)

    def _support(
        self,
        eye: ReducedEye,
        view: NDArray[np.float32],
        target: NDArray[np.float64],
        match: EyeMatch,
        f_px: float,
    ) -> MatchSupport:
        """Return whether wide view and fovea match at the point itself."""
        half = int(SURVEY_SCALE.around_px) + 4
        offset = side_of(match.role) * 0.5 * self._calibration.baseline_m * match.inverse_z_per_m
        shift_x = f_px * (float(target[0]) + offset) - float(eye.centre_px[0])
        shift_y = f_px * float(target[1]) + match.row_px - float(eye.centre_px[1])
        one = InterpolatedPicture.of(view).cut((half, half))
        other = InterpolatedPicture.of(eye.image).cut(
            (half, half), WindowPlacement(x_px=shift_x, y_px=shift_y)
        )
        return support_of(one, other, scale=SURVEY_SCALE).support
