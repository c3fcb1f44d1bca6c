"""The answer to one target, before it becomes a fixation, and the last look at it.

Both eyes are pointed at the answer, each as near as it can turn, and it is described what each sees there.
"""

import math
from dataclasses import dataclass

import numpy as np

from foveacam_hardware.contract import Role
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge import verdict
from foveacam_pipeline.verge.aim import EYES, Gazes, aim_at, clamp_gazes, reachable_eyes
from foveacam_pipeline.verge.closed_loop import VergedTarget
from foveacam_pipeline.verge.distance import LocatedPoint, place_on_ray
from foveacam_pipeline.verge.looking.fixation_head import FixationHead, StepResult
from foveacam_pipeline.verge.looking.motion import TargetMotion
from foveacam_pipeline.verge.settings import VergeSettings
from foveacam_pipeline.verge.values import Alternative, Basis, DistanceBound, EyeView, VergePhase

LOOKS, SECONDS = 24, 4.0
"""Allowed to the search by single foveae, and to the last looks at an answer."""
THERE_PX = 2.0
"""The eyes look at an answer when they are so near to it, fovea px."""
REACH_LEVELS = 9
"""So many distances are tried when it is asked whether an eye can look somewhere."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """How a distance is known, and the distance or its limits; `basis` None: no eye can look there."""

    basis: Basis | None
    reason: str
    left_view: EyeView
    right_view: EyeView
    point: LocatedPoint | None = None
    bound: DistanceBound | None = None
    alternatives: tuple[Alternative, ...] = ()
    score: float | None = None
    verged: VergedTarget | None = None


def both_foveae(verged: VergedTarget) -> Answer:
    """Return the answer of a loop that verged."""
    return Answer(
        basis=Basis.BOTH_FOVEAE,
        reason=verdict.verged(verged.point, verged.fine),
        left_view=EyeView(sees_target=True),
        right_view=EyeView(sees_target=True),
        point=verged.point,
        score=verged.fine.score,
        verged=verged,
    )


def beyond_reach(reason: str) -> Answer:
    """Return the answer where no eye can look."""
    out = EyeView(sees_target=False, reason=verdict.CANNOT_TURN)
    return Answer(basis=None, reason=reason, left_view=out, right_view=out)


def alternative(basis: Basis, point: LocatedPoint, probability: float) -> Alternative:
    """Return one of several answers to choose from."""
    return Alternative(
        basis=basis,
        distance_m=point.distance_m,
        distance_sigma_m=point.distance_sigma_m,
        point_rig_m=point.point_rig_m,
        probability=probability,
    )


class LastLook:
    """Looks at answers. Depths are 1/Z, 1/m, 0 at infinity; Z along the rig's axis."""

    def __init__(self, fixation_head: FixationHead, calibration: Calibration, limits: VergeSettings) -> None:
        self._fixation_head = fixation_head
        self._calibration = calibration
        self._limits = limits

    def in_reach(self, motion: TargetMotion) -> bool:
        """Return whether any eye can look at the target, at whatever distance."""
        levels = np.linspace(0.0, 1.0 / self._limits.nearest_m, REACH_LEVELS)
        return any(reachable_eyes(self._calibration, self._gazes(level, motion)) for level in levels)

    def look(self, inverse_z_per_m: float, sigma_per_m: float, motion: TargetMotion) -> LocatedPoint:
        """Look at the answer; return the place."""
        self.steer(inverse_z_per_m, motion)
        return self.place(inverse_z_per_m, sigma_per_m, motion)

    def place(self, inverse_z_per_m: float, sigma_per_m: float, motion: TargetMotion) -> LocatedPoint:
        """Return the place of an answer at the time of the last look."""
        last = self._fixation_head.last
        t_ns = self._fixation_head.next_ns if last is None else last.sighting.left.t_ns
        return place_on_ray(motion.at(t_ns), inverse_z_per_m, sigma_per_m)

    def steer(self, inverse_z_per_m: float, motion: TargetMotion) -> None:
        """Look once with both eyes, each as near as it can turn, unless the last look was just there."""
        gazes = clamp_gazes(self._calibration, self._gazes(inverse_z_per_m, motion))
        last = self._fixation_head.last
        apart_px = math.inf if last is None else gazes.apart(last.gazes) * self._calibration.fovea_f_px
        if apart_px <= THERE_PX and not motion.moves:
            return
        self._fixation_head.grant(looks=LOOKS, seconds=SECONDS)
        observation = self._fixation_head.look(gazes, VergePhase.FINE)
        self._fixation_head.record(observation, StepResult(score=0.0))

    def views(
        self, inverse_z_per_m: float, motion: TargetMotion, *, seeing: set[Role]
    ) -> dict[Role, EyeView]:
        """Return what each eye shows of the target; `seeing`: the eyes that nothing hides it from."""
        reaching = reachable_eyes(self._calibration, self._gazes(inverse_z_per_m, motion))
        return {role: self._view(role, reached=role in reaching, hidden=role not in seeing) for role in EYES}

    def _view(self, role: Role, *, reached: bool, hidden: bool) -> EyeView:
        if role is self._fixation_head.missing:
            return EyeView(sees_target=False, reason=verdict.NO_CAMERA)
        if not reached:
            return EyeView(sees_target=False, reason=verdict.CANNOT_TURN)
        return EyeView(sees_target=False, reason=verdict.HIDDEN) if hidden else EyeView(sees_target=True)

    def _gazes(self, inverse_z_per_m: float, motion: TargetMotion) -> Gazes:
        return aim_at(self._calibration, motion.at(self._fixation_head.next_ns), inverse_z_per_m)
