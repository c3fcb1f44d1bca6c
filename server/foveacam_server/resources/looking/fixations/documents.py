"""Turns pipeline values into REST's schemas: degrees, metres and pixels, rounded to their accuracy."""

from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.estimate import DistanceEstimate
from foveacam_pipeline.verge.values import Alternative, Basis, DistanceBound, EyeView, Fixation, VergeStep
from foveacam_server.foundation.names import utc_now
from foveacam_server.foundation.quantities import deg, rounded
from foveacam_server.resources.looking.clouds.shapes import BoundedLook, StoredLook
from foveacam_server.resources.looking.fixations.schema import (
    AlternativeDocument,
    BoundDocument,
    EyeViewDocument,
    FixationDocument,
    FixationEstimate,
    FixationOrder,
    StepDocument,
    TargetDocument,
    TargetPlace,
)
from foveacam_server.resources.looking.fixations.table import FixatedTarget
from foveacam_web.scene_values import FixationDrawing, LimitsDrawing


def describe_step(step: VergeStep) -> StepDocument:
    """Return one step of the vergence loop."""
    return StepDocument(
        index=step.index,
        phase=step.phase.value,
        left_ax_deg=deg(step.left_ax_rad),
        left_ay_deg=deg(step.left_ay_rad),
        right_ax_deg=deg(step.right_ax_rad),
        right_ay_deg=deg(step.right_ay_rad),
        residual_x_px=rounded(step.residual_x_px, 3),
        residual_y_px=rounded(step.residual_y_px, 3),
        score=rounded(step.score, 4),
        compute_ms=rounded(step.compute_ms, 2),
    )


def describe_fixation(
    fixation: Fixation, *, calibration: Calibration, fixation_id: str, job_id: str, order: FixationOrder
) -> FixationDocument:
    """Return the document of a fixation that ends now, without target and cloud."""
    direction = (fixation.target_ax_rad, fixation.target_ay_rad)
    x_px, y_px = calibration.wide.pixels([direction])[0].tolist()
    return FixationDocument(
        id=fixation_id,
        job_id=job_id,
        created_utc=utc_now(),
        request=order.model_dump(mode="json", exclude={"target_id"}, exclude_unset=True),
        target=TargetPlace(
            ax_deg=deg(direction[0]), ay_deg=deg(direction[1]), x_px=round(x_px, 3), y_px=round(y_px, 3)
        ),
        state=fixation.state.value,
        reason=fixation.reason,
        distance_m=rounded(fixation.distance_m, 6),
        distance_sigma_m=rounded(fixation.distance_sigma_m, 6),
        distance_sigma_random_m=rounded(fixation.distance_sigma_random_m, 6),
        point_rig_m=None if fixation.point_rig_m is None else _point(fixation.point_rig_m),
        basis=None if fixation.basis is None else fixation.basis.value,
        bound=None if fixation.bound is None else _bound(fixation.bound),
        alternatives=[_alternative(other) for other in fixation.alternatives],
        left_view=_eye_view(fixation.left_view),
        right_view=_eye_view(fixation.right_view),
        residual_px=rounded(fixation.residual_px, 3),
        score=rounded(fixation.score, 4),
        duration_ms=rounded(fixation.duration_ms, 1),
        steps=[describe_step(step) for step in fixation.steps],
        calibration_id=calibration.id,
        target_id=None,
        cloud_id=None,
    )


def describe_target(target: FixatedTarget) -> TargetDocument:
    """Return the document of a target with the answer of its fixation."""
    answer = target.fixation.answer
    return TargetDocument(
        id=target.id,
        label=target.label,
        fixation_id=answer.id,
        distance_m=answer.distance_m,
        distance_sigma_m=answer.distance_sigma_m,
        distance_sigma_random_m=answer.distance_sigma_random_m,
        point_rig_m=answer.point_rig_m,
        basis=answer.basis or "both_foveae",
        bound=answer.bound,
        alternatives=answer.alternatives,
        left_view=answer.left_view,
        right_view=answer.right_view,
        corrections=list(target.corrections),
        **dict(answer.target),
        cloud_id=answer.cloud_id,
        created_utc=target.created_utc,
    )


def describe_estimate(
    estimate: DistanceEstimate, *, fixation_id: str, job_id: str, elapsed_ms: float
) -> FixationEstimate:
    """Return the document of an estimate of a running fixation."""
    return FixationEstimate(
        fixation_id=fixation_id,
        job_id=job_id,
        step=estimate.looks,
        elapsed_ms=round(elapsed_ms, 1),
        basis=estimate.basis.value,
        distance_m=round(estimate.point.distance_m, 6),
        distance_sigma_m=round(estimate.point.distance_sigma_m, 6),
        distance_sigma_random_m=rounded(estimate.point.distance_sigma_random_m, 6),
        point_rig_m=_point(estimate.point.point_rig_m),
    )


def last_estimate(fixation: FixationDocument) -> FixationEstimate:
    """Return the answer of an ended fixation as its last estimate."""
    return FixationEstimate(
        fixation_id=fixation.id,
        job_id=fixation.job_id,
        step=len(fixation.steps),
        elapsed_ms=fixation.duration_ms or 0.0,
        basis=fixation.basis,
        distance_m=fixation.distance_m,
        distance_sigma_m=fixation.distance_sigma_m,
        distance_sigma_random_m=fixation.distance_sigma_random_m,
        point_rig_m=fixation.point_rig_m,
        bound=fixation.bound,
    )


def _point(point_m: tuple[float, float, float]) -> tuple[float, float, float]:
    x_m, y_m, z_m = point_m
    return round(x_m, 6), round(y_m, 6), round(z_m, 6)


def _bound(bound: DistanceBound) -> BoundDocument:
    return BoundDocument(nearest_m=round(bound.nearest_m, 6), farthest_m=rounded(bound.farthest_m, 6))


def _alternative(alternative: Alternative) -> AlternativeDocument:
    return AlternativeDocument(
        basis=alternative.basis.value,
        distance_m=round(alternative.distance_m, 6),
        distance_sigma_m=round(alternative.distance_sigma_m, 6),
        point_rig_m=_point(alternative.point_rig_m),
        probability=round(alternative.probability, 4),
    )


def _eye_view(view: EyeView | None) -> EyeViewDocument | None:
    return None if view is None else EyeViewDocument(sees_target=view.sees_target, reason=view.reason)


def drawing_of(fixation: Fixation | FixationDocument, *, label: str) -> FixationDrawing | None:
    """Return a fixation's drawing in the 3D pane; None where its distance is unknown."""
    distance_m, sigma_m, point = fixation.distance_m, fixation.distance_sigma_m, fixation.point_rig_m
    if distance_m is None or sigma_m is None or point is None:
        return None
    return FixationDrawing(
        label=label,
        point_rig_m=point,
        distance_m=distance_m,
        distance_sigma_m=sigma_m,
        basis=Basis(fixation.basis or Basis.BOTH_FOVEAE),
    )


def stored_look(target: FixatedTarget) -> StoredLook | BoundedLook | None:
    """Return a stored target's drawing in the 3D pane; None without a distance and without limits."""
    answer = target.fixation.answer
    drawing = drawing_of(answer, label=target.label)
    if drawing is not None:
        return StoredLook(fixation_id=answer.id, drawing=drawing, cloud_id=answer.cloud_id)
    return bounded_look(answer, label=target.label)


def bounded_look(fixation: FixationDocument, *, label: str) -> BoundedLook | None:
    """Return the drawing of a distance's limits in the 3D pane; None without limits."""
    if fixation.bound is None:
        return None
    direction_deg = (fixation.target.ax_deg, fixation.target.ay_deg)
    drawing = LimitsDrawing(label=label, direction_deg=direction_deg, **dict(fixation.bound))
    return BoundedLook(fixation_id=fixation.id, drawing=drawing)
