"""Answer to one target, before it becomes a `Fixation`, and the last look at it.

The last look points each eye at the answer, as near as it can turn, and reports what it sees there.
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
"""Budget granted to the search by single foveae, and to the last look at an answer."""
THERE_PX = 2.0
"""Gazes within this distance of the answer count as pointed at it, fovea px."""
REACH_LEVELS = 9
"""Number of depths tried to decide whether an eye can look at a target."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """Distance or its limits, and how it is known; `basis` is None if no eye can look at the target."""

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
    """Return the answer of a closed loop that verged."""
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
    """Return the answer for a target that no eye can look at."""
    out = EyeView(sees_target=False, reason=verdict.CANNOT_TURN)
    return Answer(basis=None, reason=reason, left_view=out, right_view=out)


def alternative(basis: Basis, point: LocatedPoint, probability: float) -> Alternative:
    """Return one of several possible distances, with its probability."""
    return Alternative(
        basis=basis,
        distance_m=point.distance_m,
        distance_sigma_m=point.distance_sigma_m,
        point_rig_m=point.point_rig_m,
        probability=probability,
    )


class LastLook:
    """Points both eyes at answers. Depths are 1/Z, 1/m, 0 at infinity; Z along the rig's axis."""

    def __init__(self, fixation_head: FixationHead, calibration: Calibration, limits: VergeSettings) -> None:
        self._fixation_head = fixation_head
        self._calibration = calibration
        self._limits = limits

    def in_reach(self, motion: TargetMotion) -> bool:
        """Return whether either eye can look at the target at any depth."""
        levels = np.linspace(0.0, 1.0 / self._limits.nearest_m, REACH_LEVELS)
        return any(reachable_eyes(self._calibration, self._gazes(level, motion)) for level in levels)

    def look(self, inverse_z_per_m: float, sigma_per_m: float, motion: TargetMotion) -> LocatedPoint:
        """Look at the answer; return its point at the time of that look."""
        self.steer(inverse_z_per_m, motion)
        return self.place(inverse_z_per_m, sigma_per_m, motion)

    def place(self, inverse_z_per_m: float, sigma_per_m: float, motion: TargetMotion) -> LocatedPoint:
        """Return the point of an answer at the time of the last look."""
        last = self._fixation_head.last
        t_ns = self._fixation_head.next_ns if last is None else last.sighting.left.t_ns
        return place_on_ray(motion.at(t_ns), inverse_z_per_m, sigma_per_m)

    def steer(self, inverse_z_per_m: float, motion: TargetMotion) -> None:
        """Look with both eyes, each as near as it can turn, unless the last look was already there."""
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
        """Return what each eye shows of the target; `seeing`: the eyes from which it is not hidden."""
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
