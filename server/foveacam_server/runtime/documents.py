"""Pipeline values as JSON: degrees, metres and pixels at the edge, rounded to what they mean."""

import math

from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.values import Alternative, EyeView, Fixation, VergeStep
from foveacam_server.runtime.names import age_s
from foveacam_server.runtime.store import Document


def deg(angle_rad: float) -> float:
    """Return degrees to 1e-5 (a fortieth of a fovea pixel)."""
    return round(math.degrees(angle_rad), 5)


def rounded(value: float | None, digits: int) -> float | None:
    """Return `value` to so many digits; None when there is none, or none that JSON can carry."""
    return None if value is None or not math.isfinite(value) else round(value, digits)


def step_document(step: VergeStep) -> Document:
    """Return one step of the vergence loop."""
    return {
        "index": step.index,
        "phase": step.phase.value,
        "left_ax_deg": deg(step.left_ax_rad),
        "left_ay_deg": deg(step.left_ay_rad),
        "right_ax_deg": deg(step.right_ax_rad),
        "right_ay_deg": deg(step.right_ay_rad),
        "residual_x_px": rounded(step.residual_x_px, 3),
        "residual_y_px": rounded(step.residual_y_px, 3),
        "score": rounded(step.score, 4),
        "compute_ms": rounded(step.compute_ms, 2),
    }


def fixation_document(fixation: Fixation, *, calibration: Calibration) -> Document:
    """Return the measured part of a fixation; ids and the request are added by who keeps it."""
    direction = (fixation.target_ax_rad, fixation.target_ay_rad)
    x_px, y_px = calibration.wide.pixels([direction])[0].tolist()
    point = fixation.point_rig_m
    return {
        "target": {
            "ax_deg": deg(direction[0]),
            "ay_deg": deg(direction[1]),
            "x_px": rounded(x_px, 3),
            "y_px": rounded(y_px, 3),
        },
        "state": fixation.state.value,
        "reason": fixation.reason,
        "distance_m": rounded(fixation.distance_m, 6),
        "distance_sigma_m": rounded(fixation.distance_sigma_m, 6),
        "point_rig_m": None if point is None else [round(value, 6) for value in point],
        "basis": None if fixation.basis is None else fixation.basis.value,
        "bound": _bound_document(fixation),
        "alternatives": [_alternative_document(other) for other in fixation.alternatives],
        "left_view": _eye_view_document(fixation.left_view),
        "right_view": _eye_view_document(fixation.right_view),
        "residual_px": rounded(fixation.residual_px, 3),
        "score": rounded(fixation.score, 4),
        "duration_ms": rounded(fixation.duration_ms, 1),
        "steps": [step_document(step) for step in fixation.steps],
        "calibration_id": calibration.id,
    }


def _bound_document(fixation: Fixation) -> Document | None:
    bound = fixation.bound
    if bound is None:
        return None
    return {"nearest_m": rounded(bound.nearest_m, 6), "farthest_m": rounded(bound.farthest_m, 6)}


def _alternative_document(alternative: Alternative) -> Document:
    return {
        "basis": alternative.basis.value,
        "distance_m": rounded(alternative.distance_m, 6),
        "distance_sigma_m": rounded(alternative.distance_sigma_m, 6),
        "point_rig_m": [round(value, 6) for value in alternative.point_rig_m],
        "probability": rounded(alternative.probability, 4),
    }


def _eye_view_document(view: EyeView | None) -> Document | None:
    return None if view is None else {"sees_target": view.sees_target, "reason": view.reason}


def calibration_document(
    calibration: Calibration, *, kept: bool, current: bool = False, health: Document | None = None
) -> Document:
    """Return what the operator needs to know of a calibration; `health` is known of the one in force.

    `kept`: whether it is one of one's own, a file of the data directory.
    """
    eyes = (calibration.left, calibration.right)
    return {
        "id": calibration.id,
        "label": calibration.label,
        "origin": calibration.origin,
        "rig_id": calibration.rig_id,
        "created_utc": calibration.created_utc,
        "age_s": round(age_s(calibration.created_utc), 1),
        "baseline_m": calibration.baseline_m,
        "mirror_sigma_deg": deg(max(max(eye.mirror.sigma_rad) for eye in eyes)),
        "rectify_sigma_px": rounded(max(eye.homography.loo_px for eye in eyes), 3),
        "wide": _wide_lens(calibration),
        "current": current,
        "kept": kept,
        "parent_id": calibration.parent_id,
        "session_id": calibration.session_id,
        "health": health,
    }


def _wide_lens(calibration: Calibration) -> Document:
    """Return the wide lens, by which the page turns pixels into directions."""
    wide = calibration.wide
    return {
        "width": wide.width,
        "height": wide.height,
        "fx_px": wide.fx_px,
        "fy_px": wide.fy_px,
        "cx_px": wide.cx_px,
        "cy_px": wide.cy_px,
        "distortion": list(wide.distortion),
    }


def told(fixation: Fixation) -> str:
    """Return the outcome as one line for the event log."""
    if fixation.basis is None:
        return f"{fixation.state.value.replace('_', ' ')}: {fixation.reason}"
    answer: Document = {
        "distance_m": fixation.distance_m,
        "distance_sigma_m": fixation.distance_sigma_m,
        "basis": fixation.basis.value,
        "bound": _bound_document(fixation),
    }
    return f"{told_distance(answer)}, in {len(fixation.steps)} steps"


BASIS_WORDS = {
    "both_foveae": "by both foveae",
    "fovea_and_wide": "by one fovea and the wide camera",
    "surroundings": "from its surroundings",
}


def told_distance(answer: Document) -> str:
    """Return distance, standard error and basis of a fixation's or target's document, or its limits."""
    if answer["distance_m"] is not None:
        basis = BASIS_WORDS.get(answer["basis"], "")
        digits = _digits(answer["distance_sigma_m"])
        known = f"{answer['distance_m']:.{digits}f} ± {answer['distance_sigma_m']:.{digits}f} m"
        return f"at {known} {basis}".rstrip()
    bound = answer.get("bound")
    return "at no known distance" if bound is None else told_bound(bound)


def _digits(sigma_m: float) -> int:
    """Return the decimals that show two digits of a standard error, 0 to 5."""
    return 3 if sigma_m <= 0.0 else min(5, max(0, 1 - math.floor(math.log10(sigma_m))))


def told_bound(bound: Document) -> str:
    """Return the limits of a distance in words."""
    farthest_m = bound["farthest_m"]
    nearest = f"farther than {bound['nearest_m']:.1f} m"
    return nearest if farthest_m is None else f"{nearest}, nearer than {farthest_m:.1f} m"
