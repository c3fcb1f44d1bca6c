"""Fallback answers for targets on which the closed loop failed: the next best basis, never nothing.

Tried in this order: the loop again at a depth that single foveae suggest; one fovea against the wide camera;
the surface inferred from the surroundings; limits of the distance. The foveae look at the answer.
"""

import math

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge import verdict
from foveacam_pipeline.verge.aim import EYES
from foveacam_pipeline.verge.alternatives import (
    LISTED_CHANCE,
    doubted,
    refuted_eye,
    rivals,
    several,
)
from foveacam_pipeline.verge.answer import (
    LOOKS,
    SECONDS,
    Answer,
    LastLook,
    beyond_reach,
    both_foveae,
)
from foveacam_pipeline.verge.closed_loop import ClosedLoop, UnsupportedMatch, VergedTarget
from foveacam_pipeline.verge.distance import LocatedPoint
from foveacam_pipeline.verge.looking.fixation_head import FixationEnded, FixationHead, Observation
from foveacam_pipeline.verge.looking.motion import TargetMotion
from foveacam_pipeline.verge.matching.support import MatchSupport
from foveacam_pipeline.verge.resolved_target import ResolvedTarget
from foveacam_pipeline.verge.settings import VergeSettings
from foveacam_pipeline.verge.single_eye.eye_match import EyeMatch
from foveacam_pipeline.verge.single_eye.search import EyeSighting, OwnSide, SingleEyeSearch
from foveacam_pipeline.verge.single_eye.weighing import (
    agree,
    confirmed,
    plausible,
    slack_per_m,
    weighted,
)
from foveacam_pipeline.verge.surroundings.depth_samples import DepthContext, DepthSamples
from foveacam_pipeline.verge.surroundings.estimator import SurroundingDepth, SurroundingsEstimator
from foveacam_pipeline.verge.surroundings.infer import InferredDepth
from foveacam_pipeline.verge.surroundings.stated_depth import SURE_PROBABILITY, error_per_m
from foveacam_pipeline.verge.values import (
    Basis,
    DistanceBound,
    DistanceRange,
    FixationState,
)

SHOWN_SCORE = 0.5
"""Least correlation of either fovea with the wide view at the depth inferred for a textured target: of 6
inferences below it 5 were wrong, of 25 others 4."""


class FallbackEstimator:
    """Estimates the distance of one target on which the closed loop failed."""

    def __init__(
        self,
        fixation_head: FixationHead,
        calibration: Calibration,
        limits: VergeSettings,
        *,
        context: DepthContext | None,
        within: DistanceRange | None,
    ) -> None:
        self._fixation_head = fixation_head
        self._calibration = calibration
        self._limits = limits
        self._last_look = LastLook(fixation_head, calibration, limits)
        self._single = SingleEyeSearch(fixation_head, calibration, limits)
        anywhere = DistanceRange(nearest_m=limits.nearest_m, farthest_m=math.inf)
        self._span_per_m = (within or anywhere).span_per_m(nearest_m=limits.nearest_m)
        self._surroundings = SurroundingsEstimator(
            fixation_head, calibration, context=context, span_per_m=self._span_per_m
        )

    def answer(self, aim: ResolvedTarget, loop: ClosedLoop, ended: FixationEnded) -> Answer:
        """Return the best answer for a target whose loop has failed, and point the foveae at it."""
        if ended.target_offset is None and self._gone(loop):
            return self._once_passed(aim, loop)
        motion = loop.motion or TargetMotion(aim.tangents, self._fixation_head.next_ns)
        if not self._last_look.in_reach(motion):
            return beyond_reach(ended.reason)
        if ended.target_offset is not None:  # the mounts have moved: any distance would be wrong
            return self._bounded(DepthSamples.none(), motion, ended)
        self._fixation_head.watch(loop.covered)
        answer = self._answered(aim, loop, ended, motion)
        hidden = answer.verged is None and (self._fixation_head.covered or self._gone(loop))
        return self._once_passed(aim, loop) if hidden else answer

    def _once_passed(self, aim: ResolvedTarget, loop: ClosedLoop) -> Answer:
        """Return the answer after whatever hid the target has passed; limits if the target stays hidden.

        While the target is hidden its track is extrapolated, so the eyes look where it was clicked.
        """
        self._fixation_head.grant(looks=LOOKS, seconds=SECONDS)
        try:
            return both_foveae(self._within_span(loop.once_passed()))
        except FixationEnded as end:
            ended = end
        if loop.motion is not None and not self._gone(loop):
            answer = self._answered(aim, loop, ended, loop.motion)
            if answer.verged is not None or not self._gone(loop):
                return answer
        clicked = TargetMotion(aim.tangents, self._fixation_head.next_ns)
        return self._bounded(DepthSamples.none(), clicked, verdict.moved_away())

    def _within_span(self, verged: VergedTarget) -> VergedTarget:
        """Return a verged target, or raise UnsupportedMatch if its depth is outside the span to consider."""
        farthest, nearest = self._span_per_m
        if farthest <= 1.0 / verged.point.distance_m <= nearest:
            return verged
        raise UnsupportedMatch(verged)

    def _gone(self, loop: ClosedLoop) -> bool:
        """Return whether the wide view of the last look shows that the target has moved away."""
        last = self._fixation_head.last
        return last is not None and loop.gone(last.sighting.wide)

    def _answered(
        self, aim: ResolvedTarget, loop: ClosedLoop, ended: FixationEnded, motion: TargetMotion
    ) -> Answer:
        unconfirmed: list[EyeSighting] = []
        if loop.templates and loop.templates[0].sigma_px <= self._limits.no_texture_sigma_px:
            found, unconfirmed = self._from_single_eyes(loop, motion)
            if found is not None:
                return found
        self._fixation_head.grant(looks=LOOKS, seconds=SECONDS)
        beside = _beside(self._calibration, aim, ended)
        target = motion.at(self._fixation_head.next_ns)
        template = loop.templates[0] if loop.templates else None
        depth = self._surroundings.estimate(
            target, self._fixation_head.wide(), self._looks(loop), beside, template=template
        )
        stated = not depth.open and depth.stated is not None
        if unconfirmed and (not stated or plausible(unconfirmed[0].match, depth.inferred)):
            return self._one_eyed(unconfirmed, motion, depth.inferred, confirming=False)
        if depth.open or not depth.inferred:
            return self._bounded(depth.samples, motion, ended)
        verged = self._closed_in(depth, loop, ended)
        if verged is not None:
            return both_foveae(verged)
        return self._inferred(depth, loop, motion, ended, refuted=[one.match for one in unconfirmed])

    def _closed_in(
        self, depth: SurroundingDepth, loop: ClosedLoop, ended: FixationEnded
    ) -> VergedTarget | None:
        """Verge on a textured target from the depth of its surroundings; return None if that fails."""
        best = depth.inferred[0]
        hopeless = ended.state is FixationState.TIMED_OUT or isinstance(ended, UnsupportedMatch)
        if hopeless or not loop.textured or best.probability < SURE_PROBABILITY:
            return None
        self._fixation_head.grant(looks=LOOKS, seconds=SECONDS)
        verged = loop.close_at(best.inverse_z_per_m)
        if verged is None or verged.support.support is not MatchSupport.MATCHED:
            return None
        apart = abs(1.0 / verged.point.point_rig_m[2] - best.inverse_z_per_m)
        return verged if apart <= slack_per_m(best) else None

    def _from_single_eyes(
        self, loop: ClosedLoop, motion: TargetMotion
    ) -> tuple[Answer | None, list[EyeSighting]]:
        """Look where single foveae match the target; return the answer of both, of one, or None.

        Also returned: sightings that no surface about the target confirms or refutes, as none is known yet.
        """
        f_px = loop.templates[0].f_px
        try:
            self._fixation_head.grant(looks=LOOKS, seconds=SECONDS)
            matches = self._single.matches(loop.templates, motion, loop.looks, span_per_m=self._span_per_m)
            own = self._own_side(motion)
            if own is not None and not all(own.agrees(match) for match in matches):
                return self._of_own_side(own, loop, motion), []
            sighted = self._single.look_at(matches, motion, f_px)
            sound = [one for one in sighted if one.supported]
            if len(sound) == 2 and agree(sound[0].match, sound[1].match):
                verged = loop.close_at(weighted([one.match for one in sound])[0])
                if verged is not None:
                    return both_foveae(verged), []
            edges = [one for one in sound if any(_same_edge(one, other) for other in sound)]
            near = () if len(edges) == len(sound) else self._near(loop, motion)
            hidden = [one for one in sound if one not in edges and plausible(one.match, near)]
            if hidden and (near or own is not None):
                return self._one_eyed(hidden, motion, near, own_side=own is not None), []
            if hidden:
                return None, hidden
            behind = self._behind_edge(edges, loop, motion)
            beside = self._of_own_side(own, loop, motion) if behind is None and own is not None else behind
            return beside, []
        except FixationEnded:
            return None, []

    def _own_side(self, motion: TargetMotion) -> OwnSide | None:
        """Return the depth of the surface on the target's side of an edge beside it; uses earlier looks."""
        frame = self._fixation_head.wide()
        nearest = self._span_per_m[1]
        own = self._single.on_own_side(motion.at(frame.t_ns), frame, nearest_per_m=nearest)
        return own if own is not None and own.inverse_z_per_m >= self._span_per_m[0] else None

    def _of_own_side(self, own: OwnSide, loop: ClosedLoop, motion: TargetMotion) -> Answer:
        """Return the answer from the depth on the target's side of an edge; verge if both eyes show it."""
        if len(own.roles) == len(EYES):
            verged = loop.close_at(own.inverse_z_per_m)
            if verged is not None and own.shares(1.0 / verged.point.point_rig_m[2]):
                return both_foveae(verged)
        depth = own.inverse_z_per_m, own.sigma_per_m
        near = () if len(own.roles) == len(EYES) else self._near(loop, motion)
        sure = len(own.roles) == len(EYES) or confirmed(*depth, near)
        sigma = error_per_m(*depth, sure=sure)
        point = self._last_look.look(own.inverse_z_per_m, sigma, motion)
        views = self._last_look.views(own.inverse_z_per_m, motion, seeing=set(own.roles))
        return Answer(
            basis=Basis.FOVEA_AND_WIDE,
            reason=verdict.one_eyed(point, set(own.roles), views),
            left_view=views[Role.LEFT],
            right_view=views[Role.RIGHT],
            point=point,
            alternatives=() if sure else doubted(depth, near, self._target(motion)),
        )

    def _near(self, loop: ClosedLoop, motion: TargetMotion) -> tuple[InferredDepth, ...]:
        """Return the depths that the looks suggest around a target."""
        frame = self._fixation_head.wide()
        return self._surroundings.peek(motion.at(frame.t_ns), frame, self._looks(loop), loop.templates[0])

    def _looks(self, loop: ClosedLoop) -> tuple[Observation, ...]:
        """Return the looks made so far."""
        return self._single.looks or loop.looks

    def _behind_edge(self, edges: list[EyeSighting], loop: ClosedLoop, motion: TargetMotion) -> Answer | None:
        """Return the answer for a point beside the edge of something nearer."""
        if not edges:
            return None
        nearest = max(edges, key=lambda one: one.match.inverse_z_per_m)
        frame = self._fixation_head.wide()
        behind = self._single.beside_edge(nearest, motion.at(frame.t_ns), frame)
        if behind is None:
            return None
        depth = behind.inverse_z_per_m, behind.sigma_per_m
        sigma = error_per_m(*depth, sure=behind.by_both)
        point = self._last_look.look(behind.inverse_z_per_m, sigma, motion)
        views = self._last_look.views(behind.inverse_z_per_m, motion, seeing={nearest.match.role})
        return Answer(
            basis=Basis.FOVEA_AND_WIDE,
            reason=verdict.one_eyed(point, {nearest.match.role}, views),
            left_view=views[Role.LEFT],
            right_view=views[Role.RIGHT],
            point=point,
            alternatives=()
            if behind.by_both
            else doubted(depth, self._near(loop, motion), self._target(motion)),
            score=behind.score,
        )

    def _one_eyed(
        self,
        sighted: list[EyeSighting],
        motion: TargetMotion,
        near: tuple[InferredDepth, ...],
        *,
        confirming: bool = True,
        own_side: bool = False,
    ) -> Answer:
        """Return the answer of one fovea and the wide camera; the weighted mean of two that agree.

        `near`: depths around the target. If they disagree with an eye, it may show the edge of something
        nearer. `confirming`: whether they may confirm an eye's depth; those measured by looks that were made
        because of it may have the same error. `own_side`: whether the surface on the target's own side of an
        edge beside it has the same depth: so it was not taken from what lies beyond the edge.
        """
        best = max(sighted, key=lambda one: one.match.score)
        both = len(sighted) == 2 and agree(sighted[0].match, sighted[1].match)
        inverse_z, sigma = weighted([one.match for one in (sighted if both else [best])])
        sure = own_side or (confirming and all(_confirmed(one, near) for one in sighted))
        if len(sighted) == 2 and not both:
            alternatives = rivals(sighted, self._target(motion))
        else:
            alternatives = () if sure else doubted((inverse_z, sigma), near, self._target(motion))
        sigma = error_per_m(inverse_z, sigma, sure=sure)
        point = self._last_look.look(inverse_z, sigma, motion)
        roles = set(EYES) if both else {best.match.role}
        views = self._last_look.views(inverse_z, motion, seeing=roles)
        return Answer(
            basis=Basis.FOVEA_AND_WIDE,
            reason=verdict.one_eyed(point, roles, views),
            left_view=views[Role.LEFT],
            right_view=views[Role.RIGHT],
            point=point,
            alternatives=alternatives,
            score=best.match.score,
        )

    def _inferred(
        self,
        depth: SurroundingDepth,
        loop: ClosedLoop,
        motion: TargetMotion,
        ended: FixationEnded,
        *,
        refuted: list[EyeMatch],
    ) -> Answer:
        """Return the answer inferred from the surroundings, or limits if that is too uncertain.

        `refuted`: matches by one eye that the surroundings do not confirm; the first one is an alternative.
        """
        stated = depth.stated
        if stated is None:
            return self._bounded(depth.samples, motion, ended, inferred=depth.inferred)
        inverse_z, sigma = stated
        self._last_look.steer(inverse_z, motion)
        shown = depth.blank or self._shown(inverse_z, loop, motion)
        point = self._last_look.place(inverse_z, error_per_m(inverse_z, sigma, sure=shown), motion)
        chance = 1.0 if shown else LISTED_CHANCE
        target = self._target(motion)
        alternatives = (
            refuted_eye(refuted[0], depth.inferred, target, chance=chance)
            if refuted
            else several(depth.inferred, target, chance=chance)
        )
        views = self._last_look.views(inverse_z, motion, seeing=set(EYES))
        return Answer(
            basis=Basis.SURROUNDINGS,
            reason=verdict.inferred(point, samples=len(depth.samples), alternatives=len(alternatives)),
            left_view=views[Role.LEFT],
            right_view=views[Role.RIGHT],
            point=point,
            alternatives=alternatives,
        )

    def _shown(self, inverse_z_per_m: float, loop: ClosedLoop, motion: TargetMotion) -> bool:
        """Return whether the last look matches the target at the inferred depth."""
        last = self._fixation_head.last
        if last is None or not loop.templates:
            return False
        target = motion.at(last.sighting.left.t_ns)
        return self._single.best_score(last, loop.templates, target, inverse_z_per_m) >= SHOWN_SCORE

    def _target(self, motion: TargetMotion) -> NDArray[np.float64]:
        """Return the target's tangents (2,) at the next look."""
        return motion.at(self._fixation_head.next_ns)

    def _bounded(
        self,
        samples: DepthSamples,
        motion: TargetMotion,
        ended: FixationEnded,
        *,
        inferred: tuple[InferredDepth, ...] = (),
    ) -> Answer:
        """Return limits: farther than the nearest measured surface around the target, if there is one.

        `inferred`: depths too uncertain to be stated; the eyes look at the first one.
        """
        target = motion.at(self._fixation_head.next_ns)
        length = float(np.linalg.norm([*target, 1.0]))
        inverse_z = float(samples.inverse_z_per_m.max()) if len(samples) else 0.0
        nearest_m = length / inverse_z if inverse_z > 0.0 else self._limits.nearest_m
        bound = DistanceBound(nearest_m=0.97 * nearest_m, farthest_m=math.inf)
        level = inferred[0].inverse_z_per_m if inferred else 0.0
        views = self._last_look.views(level, motion, seeing=set(EYES))
        self._last_look.steer(level, motion)
        alternatives = several(inferred, self._target(motion))
        return Answer(
            basis=Basis.BOUND,
            reason=verdict.bounded(bound, ended, alternatives=len(alternatives)),
            left_view=views[Role.LEFT],
            right_view=views[Role.RIGHT],
            bound=bound,
            alternatives=alternatives,
        )


def _confirmed(one: EyeSighting, near: tuple[InferredDepth, ...]) -> bool:
    """Return whether the depths around a target confirm what one eye shows of it."""
    match, alone = one.match, one.between_score is None
    return confirmed(match.inverse_z_per_m, match.sigma_per_m, near, alone=alone)


def _same_edge(one: EyeSighting, other: EyeSighting) -> bool:
    """Return whether a sighting has the depth of one that is known to show an edge, or is that one."""
    return other.at_edge and (one is other or agree(one.match, other.match))


def _beside(
    calibration: Calibration, aim: ResolvedTarget, ended: FixationEnded
) -> tuple[np.ndarray[tuple[int], np.dtype[np.float64]], LocatedPoint] | None:
    """Return the direction and the point of a match beside the target; None if there was none."""
    if not isinstance(ended, UnsupportedMatch) or ended.verged.support.sectors == 0:
        return None
    offset = np.array(ended.verged.support.alike_offset_px) / calibration.fovea_f_px
    return aim.tangents + offset, ended.verged.point
