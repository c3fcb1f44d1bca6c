"""Target vergence (Sec. 3.4): look parallel, find the target in both foveae, verge on it in a closed loop.

Every look is measured twice, against the wide view and left against right; they must agree before a
fixation counts as verged. `looking` does the looks, `survey` and `fine` the matching.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from foveacam_hardware.contract import Clock, Head, OutOfRange, Sighting
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.verge import verdict
from foveacam_pipeline.verge.aim import Gazes, aim_at, nearest_reach, reaches
from foveacam_pipeline.verge.distance import Place, triangulate
from foveacam_pipeline.verge.fine import FineMatch
from foveacam_pipeline.verge.looking import Ended, Looker, Measured, Seen
from foveacam_pipeline.verge.measure import Measurement, measure
from foveacam_pipeline.verge.motion import Motion
from foveacam_pipeline.verge.settings import VergeSettings
from foveacam_pipeline.verge.sight import Aim, patches_for, resolve
from foveacam_pipeline.verge.survey import Registration, epipolar_looks, reduce_look, register
from foveacam_pipeline.verge.template import Template, follow
from foveacam_pipeline.verge.values import Fixation, FixationState, Phase, Target, VergeStep

DEFAULT = VergeSettings()
LEAST_STEP_PER_M = 0.02
"""A last look nearer by less than this shows nothing new, 1/m."""
FOLLOW_SCORE = 0.5
FOLLOW_LEAST_PX = 1.5
"""Smaller displacements between two wide frames are noise, survey px."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Found:
    """The gazes that bring the patch to both centres; the patches, the one that was found first."""

    gazes: Gazes
    templates: tuple[Template, ...]
    score: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Verged:
    place: Place
    fine: FineMatch


def fixate(
    head: Head,
    calibration: Calibration,
    target: Target,
    *,
    clock: Clock,
    limits: VergeSettings = DEFAULT,
    on_step: Callable[[VergeStep], None] | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> Fixation:
    """Verge both foveae on a target and return how it ended; raise Cancelled when `cancelled()` says so.

    A target outside the wide image raises OutOfRange; one that the eyes cannot reach ends as out_of_range.
    """
    aim = resolve(target, calibration.wide, limits)
    looker = Looker(head, calibration, clock=clock, limits=limits, on_step=on_step, cancelled=cancelled)
    verged: _Verged | None = None
    try:
        verged = _Loop(looker, calibration, limits).run(aim)
        state, reason = FixationState.VERGED, verdict.verged(verged.place, verged.fine)
    except Ended as end:
        state, reason = end.state, end.reason
    seen = looker.last
    ax_rad, ay_rad = aim.angles_rad
    answer = Fixation(
        state=state,
        reason=reason,
        target_ax_rad=ax_rad,
        target_ay_rad=ay_rad,
        steps=looker.steps,
        volts=seen.sighting.volts if seen else None,
        sighting=seen.sighting if seen else None,
        duration_ms=looker.elapsed_ms,
    )
    return answer if verged is None else _with_result(answer, verged)


def _with_result(answer: Fixation, verged: _Verged) -> Fixation:
    return replace(
        answer,
        distance_m=verged.place.distance_m,
        distance_sigma_m=verged.place.distance_sigma_m,
        point_rig_m=verged.place.point_rig_m,
        residual_px=math.hypot(verged.fine.residual_x_px, verged.fine.residual_y_px),
        score=verged.fine.score,
    )


class _Loop:
    """One fixation: the looks to do, and what the wide view shows of the target."""

    def __init__(self, looker: Looker, calibration: Calibration, limits: VergeSettings) -> None:
        self._looker = looker
        self._calibration = calibration
        self._limits = limits
        self._f_px = calibration.fovea_f_px
        self._wide_seq = -1

    def run(self, aim: Aim) -> _Verged:
        """Return the verged fixation, or raise Ended."""
        frame = self._looker.wide()
        self._wide_seq = frame.seq
        try:
            templates = patches_for(gray(to_uint8(frame)), aim, self._calibration.wide, self._limits)
        except OutOfRange as error:
            raise Ended(FixationState.OUT_OF_RANGE, f"Out of the wide view: {error}.") from error
        return self._close(self._find(templates))

    def _find(self, templates: tuple[Template, ...]) -> _Found:
        """Look parallel, then farther in along the epipolar line, until both foveae see the patch."""
        best: _Found | None = None
        blank = templates[0].sigma_px > self._limits.no_texture_sigma_px
        inverse_z = 0.0
        for inverse_z in self._search_depths(templates[-1]):
            gazes = aim_at(self._calibration, templates[0].target, inverse_z)
            seen = self._looker.look(gazes, Phase.EPIPOLAR if inverse_z else Phase.PARALLEL)
            templates = self._followed(templates, seen.sighting)
            found, template = self._register(seen, templates)
            self._looker.record(seen, self._survey_step(found))
            if blank:
                raise verdict.blank_patch()
            if found is None or not self._plausible(found):
                continue
            if best is None or found.score > best.score:
                centred = seen.gazes.moved(found.left, found.right)
                others = tuple(other for other in templates if other is not template)
                best = _Found(gazes=centred, templates=(template, *others), score=found.score)
            if found.score >= self._limits.sure_score:
                break
        if best is None:
            raise verdict.not_found(self._limits, nearest_m=1.0 / inverse_z if inverse_z else math.inf)
        return best

    def _register(self, seen: Seen, templates: tuple[Template, ...]) -> tuple[Registration | None, Template]:
        """Search one look for the patches; return the first that is plausible and sure, else the best."""
        look = reduce_look(seen.sighting, self._calibration, f_px=templates[0].f_px)
        best: tuple[Registration | None, Template] = (None, templates[0])
        for template in templates:
            found = register(look, template)
            if found is None:
                continue
            if best[0] is None or (self._plausible(found), found.score) > (
                self._plausible(best[0]),
                best[0].score,
            ):
                best = (found, template)
            if self._plausible(found) and found.score >= self._limits.sure_score:
                break
        return best

    def _search_depths(self, template: Template) -> Iterator[float]:
        """Yield 1/Z, 1/m, of the looks of a search, the last one as near as both eyes can turn in."""
        reached = 0.0
        for inverse_z in epipolar_looks(self._calibration, template, self._limits.nearest_m):
            if inverse_z and not reaches(
                self._calibration, aim_at(self._calibration, template.target, inverse_z)
            ):
                nearest = nearest_reach(self._calibration, template.target, reached=reached, wanted=inverse_z)
                if nearest > reached + LEAST_STEP_PER_M:
                    yield nearest
                return
            yield inverse_z
            reached = inverse_z

    def _close(self, found: _Found) -> _Verged:
        """Verge until left and right agree to half a pixel and the wide view agrees with both."""
        motion = Motion()
        gazes, phase, doubts = found.gazes, Phase.COARSE, 0
        while True:
            seen = self._looker.look(gazes, phase)
            phase = Phase.FINE
            now = measure(seen, found.templates, self._calibration, self._limits)
            self._looker.record(
                seen,
                Measured(
                    score=now.fine.score,
                    residual_x_px=now.fine.residual_x_px,
                    residual_y_px=now.fine.residual_y_px,
                ),
            )
            half = now.fine.residual_px / (2.0 * self._f_px)
            target = seen.gazes.moved(now.centre + half, now.centre - half)
            doubt = verdict.doubt(now, self._limits)
            if doubt is None and self._settled(now):
                return self._verged(target, now.fine)
            doubts = 0 if doubt is None else doubts + 1
            if doubt is not None and doubts > self._limits.doubtful_looks:
                raise doubt
            if doubt is None:
                ahead = motion.step((target.left + target.right) / 2.0, seen.sighting.left.t_ns)
                gazes = target.moved(ahead, ahead)

    def _settled(self, now: Measurement) -> bool:
        apart_px = abs(now.fine.residual_x_px)
        if now.fine.sigma_y_px <= self._limits.fine_sigma_px:  # else the texture cannot tell the rows apart
            apart_px = max(apart_px, abs(now.fine.residual_y_px))
        off_wide_px = float(np.abs(now.centre).max()) * self._calibration.wide.fx_px
        return apart_px <= self._limits.converged_px and off_wide_px <= self._limits.centred_wide_px

    def _verged(self, target: Gazes, fine: FineMatch) -> _Verged:
        place = triangulate(self._calibration, target, sigma_px=fine.sigma_x_px)
        if place is None:
            raise Ended(
                FixationState.LOST,
                "Left and right agree, but their lines of sight part: farther than the calibration can tell; "
                "calibrate the mirrors anew.",
            )
        return _Verged(place=place, fine=fine)

    def _followed(self, templates: tuple[Template, ...], sighting: Sighting) -> tuple[Template, ...]:
        """Return the patches where a newer wide frame shows them."""
        if sighting.wide.seq == self._wide_seq:
            return templates
        self._wide_seq = sighting.wide.seq
        first = templates[0]
        target, score = follow(first, gray(to_uint8(sighting.wide)), self._calibration.wide)
        moved_px = float(np.abs(target - first.target).max()) * first.f_px
        if score < FOLLOW_SCORE or moved_px < FOLLOW_LEAST_PX:
            return templates
        return tuple(replace(template, target=target) for template in templates)

    def _plausible(self, found: Registration) -> bool:
        limits = self._limits
        return (
            found.score >= limits.register_score
            and found.lead >= limits.register_lead
            and found.rows_apart_px <= limits.rows_apart_survey_px
        )

    def _survey_step(self, found: Registration | None) -> Measured:
        if found is None:
            return Measured(score=0.0)
        apart = (found.left - found.right) * self._f_px
        return Measured(score=found.score, residual_x_px=float(apart[0]), residual_y_px=float(apart[1]))
