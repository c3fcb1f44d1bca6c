"""A calibration session as the server shows it, complete; and a picture."""

import io
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from foveacam_server.resources.calibrating.drift_checks.schema import DriftCheckDocument
from foveacam_server.resources.calibrating.sessions.schema import SessionDocument

Document = dict[str, Any]  # Any: JSON that tests take parts out of

LENS: Document = {
    "model": "five",
    "rms_px": 0.061,
    "fov_x_deg": 25.61,
    "fov_y_deg": 19.4,
    "fx_px": 3155.1,
    "fy_px": 3155.3,
    "cx_px": 719.8,
    "cy_px": 540.2,
    "distortion": [-0.1, 0.05, 0.0, 0.0, 0.0],
    "accuracy_deg": 0.0004,
}


BOARD: Document = {"kind": "charuco", "columns": 9, "rows": 6, "square_mm": 30.0, "marker_mm": 22.0}


def sample(index: int) -> Document:
    figures = {"rms_px": 0.05, "tilt_deg": 12.0, "centre_px": [700.0, 500.0], "corners": 54}
    return figures | {"id": f"view-{index}"}


FOVEA_LENS: Document = {
    "camera": "left",
    "board": BOARD,
    "samples": [sample(index) for index in range(18)],
    "coverage_fraction": 0.9,
    "tilts_covered": 4,
    "fit": LENS
    | {
        "fov_x_deg": 2.8686,
        "fov_y_deg": 2.1517,
        "rms_px": 0.031,
        "parameters": [
            {"name": "fx_px", "value": 28758.91, "sigma": 2.13, "assumed": False},
            {"name": "k2", "value": 0.0, "sigma": 1e-6, "assumed": True},
        ],
    },
    "reason": "the views determine fx_px; assumed: k2",
}


def node(index: int, ax_deg: float, ay_deg: float, *, left: str = "centred") -> Document:
    reason = "blurred: 3.1 px, 2 px is the limit" if left == "refused" else None
    return {
        "index": index,
        "ax_deg": ax_deg,
        "ay_deg": ay_deg,
        "left": left,
        "right": "rim",
        "left_reason": reason,
        "right_reason": None,
    }


def axis(eye: str, name: str, *, slower_ms: float = 0.0) -> Document:
    return {
        "eye": eye,
        "axis": name,
        "settle_ms": 10.0 + slower_ms,
        "settle_1pct_ms": 5.7 + slower_ms,
        "resonance_hz": 2100.0,
        "quality": 48.0,
        "response_ms": 3.1 + slower_ms,
    }


def mount_drift() -> Document:
    figures = {"px_per_minute": 0.4, "moved_px": 1.2, "sigma_px": 0.1, "minutes": 3.1}
    return figures | {"pieces": 2, "visits": 12}


def step(name: str, error_px: float) -> Document:
    return {
        "name": name,
        "pointing_rms_px": error_px,
        "rectification_rms_px": error_px,
        "epipolar_rms_px": error_px / 2.0,
    }


def session_document(**changes: object) -> Document:
    models = [
        {
            "name": "polynomial",
            "order": order,
            "eye": eye,
            "loo_deg": [0.04 / order, 0.05 / order],
            "chosen": order == 7,
        }
        for eye in ("left", "right")
        for order in (3, 7)
    ]
    nodes = [node(0, -9.0, -8.0), node(1, 0.0, 0.0), node(2, 9.0, 8.0, left="refused")]
    document: Document = {
        "id": "ses-1",
        "label": "before <b>lunch</b> & after",
        "rig_id": "sim-rig120",
        "created_utc": "2026-03-01T10:00:00+00:00",
        "bytes": 12,
        "board": BOARD,
        "lenses": [FOVEA_LENS],
        "wide": {
            "samples": [sample(index) for index in range(38)],
            "coverage_fraction": 0.93,
            "tilts_covered": 4,
            "reason": "",
            "fit": LENS,
            "other_model": None,
        },
        "sweeps": [{"station": "markers", "distance_m": 5.0, "nodes": 3, "done": 3, "poses": nodes}],
        "fit": {
            "calibration_id": "x",
            "models": models,
            "fields": [],
            "volts_roundtrip_max_lsb": 0.25,
            "drift": {eye: mount_drift() for eye in ("left", "right")},
            "paper": {
                "station": "markers",
                "loo_deg": {"left": [0.0171, 0.0201], "right": [0.0172, 0.0202]},
                "rectify_loo_px": {"left": 0.052, "right": 0.053},
                "volts_roundtrip_max_lsb": 422.35,
                "steps": [step("paper", 13.4), step("ours", 0.22), step("ours, but one distance", 2.26)],
            },
            "parallax": {
                "markers": {
                    "print_m": 5.0002,
                    "tape_m": 5.0,
                    "rms_deg": 0.0071,
                    "largest_deg": 0.0134,
                    "corrected": True,
                    "words": "the parallax was taken out",
                }
            },
        },
        "settle": {"axes": [axis("left", "x"), axis("right", "y", slower_ms=0.5)]},
        "check": {
            "calibration_id": "x",
            "epipolar_rms_px": 0.21,
            "epipolar_p95_px": 0.44,
            "pointing_rms_px": 1.3,
            "pointing_sigma_px": 0.2,
            "poses": 40,
        },
        "pictures": [],
        "calibrations": [],
        "running": None,
        "problems": ["sweep x: line 7 is damaged"],
    }
    return document | changes


def session(**changes: object) -> SessionDocument:
    return SessionDocument.model_validate(session_document(**changes))


def drift_check(day: int, *, shift_deg: float, applied: bool = False) -> DriftCheckDocument:
    eyes = [
        {
            "eye": eye,
            "shift_x_deg": shift_deg,
            "shift_y_deg": -shift_deg / 2.0,
            "rotation_deg": 0.0,
            "scale": 1.0,
            "sigma_deg": 0.002,
            "significant": shift_deg > 0.01,
        }
        for eye in ("left", "right")
    ]
    document = {
        "id": f"drf-{day}",
        "created_utc": f"2026-03-{day:02d}T10:00:00+00:00",
        "calibration_id": "x",
        "looks": 5,
        "applied": applied,
        "eyes": eyes,
        "new_calibration_id": None,
        "vergence_known": False,
        "locked": True,
        "residual_px": 0.3,
        "duration_s": 2.0,
        "detail": "",
    }
    return DriftCheckDocument.model_validate(document)


def picture(width_in: float = 4.0) -> bytes:
    figure = Figure(figsize=(width_in, 3.0))
    figure.subplots().imshow(np.arange(12.0).reshape(3, 4))
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    return buffer.getvalue()
