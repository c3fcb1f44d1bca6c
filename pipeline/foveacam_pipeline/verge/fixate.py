"""One fixation: the closed loop of both foveae, and its fallback if that fails (Sec. 3.4)."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from foveacam_hardware.contract import Clock, Frame, Head
from foveacam_hardware.contract.spans import span
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.answer import Answer, both_foveae
from foveacam_pipeline.verge.closed_loop import ClosedLoop, UnsupportedMatch, VergedTarget
from foveacam_pipeline.verge.estimate import DistanceEstimate
from foveacam_pipeline.verge.fallback import FallbackEstimator
from foveacam_pipeline.verge.looking.fixation_head import FixationEnded, FixationHead
from foveacam_pipeline.verge.resolved_target import ResolvedTarget, resolve
from foveacam_pipeline.verge.settings import VergeSettings
from foveacam_pipeline.verge.surroundings.depth_samples import DepthContext
from foveacam_pipeline.verge.values import DistanceRange, Fixation, FixationState, Target, VergeStep

DEFAULT = VergeSettings()

EXPECTED_REACH_PX = 8.0
"""Radius within which an earlier depth seeds the search, wide px."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PriorKnowledge:
    """What is known before a fixation: measured surroundings, and the range of distances accepted."""

    context: DepthContext | None = None
    within: DistanceRange | None = None


def fixate(
    head: Head,
    calibration: Calibration,
    target: Target,
    *,
    clock: Clock,
    limits: VergeSettings = DEFAULT,
    known: PriorKnowledge = PriorKnowledge(),
    clicked: Frame | None = None,
    on_step: Callable[[VergeStep], None] | None = None,
    on_estimate: Callable[[DistanceEstimate], None] | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> Fixation:
    """Look at a target with both foveae; return its distance with its basis, or limits of it.

    `clicked`: the wide frame on which the target was chosen, if known: a moving target is tracked from there.
    `on_estimate`: called after each look that gave an estimate of the distance.

    Raise OutOfRange for a target outside the wide image, Cancelled when `cancelled()` returns True.
    """
    aim = resolve(target, calibration.wide, limits)
    fixation_head = FixationHead(
        head,
        calibration,
        clock=clock,
        limits=limits,
        on_step=on_step,
        on_estimate=on_estimate,
        cancelled=cancelled,
    )
    loop = ClosedLoop(
        fixation_head, calibration, limits, expected_per_m=_expected_per_m(known.context, aim, calibration)
    )
    ended: FixationEnded | None = None
    try:
        answer = both_foveae(_within(loop.run(aim, clicked=clicked), known.within))
    except FixationEnded as end:
        ended = end
        answering = FallbackEstimator(
            fixation_head, calibration, limits, context=known.context, within=known.within
        )
        with span("fallback"):
            answer = answering.answer(aim, loop, end)
    moved = loop.motion is not None and loop.motion.moves
    return _fixation(aim, fixation_head, answer, ended, moved=moved)


def _expected_per_m(
    context: DepthContext | None, aim: ResolvedTarget, calibration: Calibration
) -> float | None:
    """Return 1/Z of the earlier measurement nearest to a target; None if none is near."""
    if context is None:
        return None
    px_tan = 1.0 / calibration.wide.fx_px
    near = context.around(aim.tangents, reach_tan=EXPECTED_REACH_PX * px_tan)
    if len(near) == 0:
        return None
    nearest = int(np.argmin(np.hypot(*(near.tangents - aim.tangents).T)))
    return float(near.inverse_z_per_m[nearest])


def _within(verged: VergedTarget, span: DistanceRange | None) -> VergedTarget:
    """Return what the loop verged on, or raise FixationEnded if its distance is out of range."""
    if span is None or span.holds(verged.point.distance_m):
        return verged
    raise UnsupportedMatch(verged)


def _fixation(
    aim: ResolvedTarget,
    fixation_head: FixationHead,
    answer: Answer,
    ended: FixationEnded | None,
    *,
    moved: bool,
) -> Fixation:
    ax_rad, ay_rad = aim.angles_rad
    observation, point, verged = fixation_head.last, answer.point, answer.verged
    state = FixationState.VERGED if ended is None or verged is not None else ended.state
    return Fixation(
        state=state,
        reason=answer.reason,
        target_ax_rad=ax_rad,
        target_ay_rad=ay_rad,
        steps=fixation_head.steps,
        target_moved=moved,
        basis=answer.basis,
        bound=answer.bound,
        alternatives=answer.alternatives,
        left_view=answer.left_view,
        right_view=answer.right_view,
        distance_m=None if point is None else point.distance_m,
        distance_sigma_m=None if point is None else point.distance_sigma_m,
        distance_sigma_random_m=None if point is None else point.distance_sigma_random_m,
        point_rig_m=None if point is None else point.point_rig_m,
        residual_px=None if verged is None else float(np.hypot(*verged.fine.residual_px)),
        score=answer.score,
        volts=observation.sighting.volts if observation else None,
        sighting=observation.sighting if observation else None,
        duration_ms=fixation_head.elapsed_ms,
        target_offset=None if ended is None else ended.target_offset,
    )
