"""Fixations and targets as the server tells them, by how their distance is known."""

from typing import Any

Document = dict[str, Any]  # Any: a JSON document

SEES = {"sees_target": True, "reason": ""}
HIDDEN = {"sees_target": False, "reason": "hidden from the left eye by something nearer"}
NEAR = {
    "basis": "both_foveae",
    "distance_m": 1.937,
    "distance_sigma_m": 0.004,
    "point_rig_m": [0.1, 0.1, 1.93],
    "probability": 0.62,
}
FAR = {
    "basis": "fovea_and_wide",
    "distance_m": 2.729,
    "distance_sigma_m": 0.02,
    "point_rig_m": [0.15, 0.1, 2.72],
    "probability": 0.38,
}


def fixation(**more: object) -> Document:
    """Return a fixation without a distance, with `more` in its place."""
    return {
        "id": "fix-1",
        "job_id": "job-9",
        "created_utc": "2026-01-01T00:00:00.000Z",
        "request": {"pixel": {"x_px": 360.0, "y_px": 270.0}},
        "target": {"ax_deg": 1.0, "ay_deg": 2.0, "x_px": 360.0, "y_px": 270.0},
        "state": "lost",
        "reason": "why it is so.",
        "distance_m": None,
        "distance_sigma_m": None,
        "point_rig_m": None,
        "basis": None,
        "bound": None,
        "alternatives": [],
        "chosen_alternative": None,
        "left_view": None,
        "right_view": None,
        "residual_px": None,
        "score": None,
        "duration_ms": 900.0,
        "steps": [],
        "calibration_id": "a" * 32,
        "target_id": "tgt-1",
        "cloud_id": None,
        **more,
    }


def target(**more: object) -> Document:
    """Return the target of that fixation, with `more` in its place."""
    found = fixation(**more)
    answer = ("basis", "distance_m", "distance_sigma_m", "point_rig_m", "bound", "alternatives")
    return {
        "id": "tgt-1",
        "label": "Target 1",
        "fixation_id": "fix-1",
        **{key: found[key] for key in (*answer, "left_view", "right_view", "cloud_id", "created_utc")},
        **found["target"],
        "corrections": [],
    }
