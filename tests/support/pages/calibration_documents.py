"""What a server would say of calibrating: a rig in the middle of it, and parts to change. Pure data."""

import math
from typing import Any

from tests.support.pages import rig_documents
from tests.support.pages.calibration_results import UTC, fit, settle_axis

Document = dict[str, Any]  # Any: JSON, written out below

SESSION_ID = "ses-1f0a"
SETTLE_US = 11_200
LENS = {"width": 1440, "height": 1080, "fx_px": 3160.0, "fy_px": 3160.0, "cx_px": 719.5, "cy_px": 539.5}
NODES_DEG = [
    round(9.3 * x, 2) for x in (-1.0, -0.92, -0.71, -0.38, 0.0, 0.38, 0.71, 0.92, 1.0)
]  # denser near the rim
PICTURES = {
    "coverage": "Where the board was seen, and how it was tilted",
    "wide_residuals": "What the lens model leaves",
    "quiver_left": "Left eye: residual of every pose",
    "quiver_right": "Right eye: residual of every pose",
    "loo": "Leave-one-out error by model",
    "anaglyph_before": "Both eyes before rectification",
    "anaglyph_after": "Both eyes after rectification",
    "overlay": "The foveae laid over the wide view",
    "epipolar": "Vertical epipolar error over the field",
    "settle": "How the mirrors settle",
}


def rig() -> Document:
    return {
        "name": "Simulated rig",
        "rig_id": "sim-paper",
        "simulated": True,
        "scene": "calibration",
        "state": "ready",
        "problems": [],
        "baseline_m": 0.2,
        "steering": {"ax_min_deg": -9.3, "ax_max_deg": 9.3, "ay_min_deg": -8.2, "ay_max_deg": 8.2},
        "cameras": [rig_documents.camera(role) for role in ("wide", "left", "right")],
        "divergence": [],
        "mirrors": {
            "connected": True,
            "enabled": True,
            "left": {"x_v": 1.0, "y_v": 2.0, "ax_deg": 0.1, "ay_deg": 0.2},
            "right": {"x_v": 1.0, "y_v": 2.0, "ax_deg": 0.1, "ay_deg": 0.2},
            "fault": None,
            "rtt_p50_ms": 0.9,
            "rtt_p99_ms": 2.4,
            "tx_packets": 12,
            "rx_packets": 12,
            "bad_packets": 0,
            "clock_offset_ms": 0.5,
            **rig_documents.mirrors_more(),
        },
        "trigger": rig_documents.trigger(),
        "calibration": record("a" * 32, "Bench, spring", current=True),
        "calibration_problem": None,
        "clock": {"t_ns": 1, "utc": UTC},
    }


def record(
    calibration_id: str,
    label: str,
    *,
    current: bool = False,
    kept: bool = True,
    origin: str = "measured",
    age_s: float = 11520.0,
) -> Document:
    return {
        "id": calibration_id,
        "label": label,
        "origin": origin,
        "rig_id": "sim-paper",
        "created_utc": UTC,
        "age_s": age_s,
        "baseline_m": 0.2001,
        "mirror_sigma_deg": 0.0031,
        "rectify_sigma_px": 0.21,
        "wide": {**LENS, "distortion": [-0.09, 0.12, 0.0, 0.0, 0.0]},
        "current": current,
        "kept": kept,
        "parent_id": None,
        "session_id": SESSION_ID,
        "health": None,
    }


def health(verdict: str = "good") -> Document:
    words = {
        "good": "The rows of both eyes agree as well as on the day it was measured",
        "recalibrate": "The rows of both eyes lie 2.4 px apart, 8 times what the calibration promises",
        "unknown": "Nothing was fixated since it came into use",
    }
    return {
        "score": None if verdict == "unknown" else 0.8 if verdict == "good" else 8.1,
        "verdict": verdict,
        "fixations": 0 if verdict == "unknown" else 34,
        "vertical_px": 0.2,
        "horizontal_px": 0.6,
        "detail": words[verdict],
    }


def pan_tilt() -> Document:
    return {
        "present": True,
        "info": {"vendor": "Simulated", "model": "GRBL 1.1h"},
        "moves_itself": True,
        "connected": True,
        "homed": True,
        "awaits_zero": False,
        "moving": False,
        "pan_deg": 0.0,
        "tilt_deg": 0.0,
        "fault": None,
        "limits": {"pan_min_deg": -90.0, "pan_max_deg": 90.0, "tilt_min_deg": -30.0, "tilt_max_deg": 30.0},
        "stations": [
            _station("board", "board", pan_deg=45.0, distance_m=None),
            _station("markers", "markers", pan_deg=0.0, distance_m=5.0),
            {
                "name": "markers near",
                "target": "markers",
                "pan_deg": -45.0,
                "tilt_deg": 0.0,
                "distance_m": 2.5,
            },
        ],
    }


def _station(name: str, target: str, *, pan_deg: float, distance_m: float | None) -> Document:
    return {"name": name, "target": target, "pan_deg": pan_deg, "tilt_deg": 0.0, "distance_m": distance_m}


def empty_session(session_id: str = SESSION_ID, label: str = "Bench, spring") -> Document:
    return {
        "id": session_id,
        "label": label,
        "rig_id": "sim-paper",
        "created_utc": UTC,
        "bytes": 12_400_000,
        "board": {"kind": "charuco", "columns": 9, "rows": 6, "square_mm": 30.0, "marker_mm": 22.0},
        "wide": None,
        "lenses": [],
        "sweeps": [],
        "fit": None,
        "settle": None,
        "check": None,
        "pictures": [],
        "calibrations": [],
        "running": None,
        "problems": [],
    }


def full_session() -> Document:
    """A session in which every step was done, with a refusal and a rim pose here and there."""
    return empty_session() | {
        "wide": wide(28),
        "sweeps": [sweep("markers", 5.0, done=81), sweep("markers near", 2.5, done=40)],
        "fit": fit(),
        "settle": {
            "axes": [settle_axis(eye, axis) for eye in ("left", "right") for axis in ("x", "y")],
            "settle_us": SETTLE_US,
        },
        "check": {
            "calibration_id": "a" * 32,
            "epipolar_rms_px": 0.21,
            "epipolar_p95_px": 0.91,
            "pointing_rms_px": 1.42,
            "poses": 40,
        },
        "pictures": [
            {"name": name, "title": title, "url": f"{_url()}/pictures/{name}.png?v=1"}
            for name, title in PICTURES.items()
        ],
        "calibrations": ["a" * 32],
    }


def _url() -> str:
    return f"/api/v1/calibration_sessions/{SESSION_ID}"


def wide(views: int) -> Document:
    return {
        "samples": [_sample(index) for index in range(views)],
        "coverage_fraction": 0.83,
        "tilts_covered": 5,
        "reason": "five: it predicts views left out as well as the larger model",
        "fit": _lens("five", 0.061),
        "other_model": _lens("rational", 0.06),
    }


def _sample(index: int) -> Document:
    return {
        "id": f"view{index}",
        "thumbnail_url": f"{_url()}/wide_samples/view{index}.jpg",
        "rms_px": 0.31 if index == 5 else 0.05 + 0.002 * index,
        "tilt_deg": 5.0 + (index * 7) % 32,
        "centre_px": [720.0 + 560.0 * math.sin(index * 2.4), 540.0 + 400.0 * math.cos(index * 1.7)],
        "corners": 54,
    }


def fovea_lens(camera: str = "left", *, views: int = 6, determined: bool = True) -> Document:
    """The lens of a fovea; `determined`: by enough views."""
    parameters = [
        ("fx_px", 28758.91, 2.13, False),
        ("fy_px", 28758.87, 1.97, False),
        ("cx_px", 719.5, 71.2, True),
        ("cy_px", 541.09, 1.91, False),
        ("k1", -0.00638, 0.00332, False),
        *((name, 0.0, 1e-6, True) for name in ("k2", "p1", "p2", "k3")),
    ]
    fit = _lens("telephoto", 0.031) | {"fov_x_deg": 2.8686, "fov_y_deg": 2.1517}
    fit |= {"fx_px": 28758.91, "fy_px": 28758.87, "cx_px": 719.5, "cy_px": 541.09}
    fit["parameters"] = [
        dict(zip(("name", "value", "sigma", "assumed"), each, strict=True)) for each in parameters
    ]
    refusal = f"{camera} calibration: {views} views of the board, at least 3 are needed; take more"
    return {
        "camera": camera,
        "board": {"kind": "charuco", "columns": 9, "rows": 6, "square_mm": 12.0, "marker_mm": 9.0},
        "samples": [
            _sample(index) | {"thumbnail_url": f"{_url()}/lenses/{camera}/samples/view{index}.jpg"}
            for index in range(views)
        ],
        "coverage_fraction": 0.68,
        "tilts_covered": 5,
        "fit": fit if determined else None,
        "reason": "the views determine fx_px, fy_px, cy_px, k1; assumed: cx_px, k2, p1, p2, k3"
        if determined
        else refusal,
    }


def _lens(model: str, rms_px: float) -> Document:
    return {
        "model": model,
        "rms_px": rms_px,
        "fov_x_deg": 25.62,
        "fov_y_deg": 19.41,
        "fx_px": 3160.21,
        "fy_px": 3160.48,
        "cx_px": 721.1,
        "cy_px": 541.7,
        "distortion": [-0.0912, 0.1213, 0.0002, -0.0001, 0.0],
        "accuracy_deg": 0.0004,
    }


def sweep(station: str, distance_m: float, *, done: int) -> Document:
    places = [(ax, ay) for ay in NODES_DEG for ax in NODES_DEG]
    return {
        "station": station,
        "distance_m": distance_m,
        "nodes": len(places),
        "done": done,
        "poses": [_node(index, *place, done=index < done) for index, place in enumerate(places)],
    }


def _node(index: int, ax_deg: float, ay_deg: float, *, done: bool) -> Document:
    corner = abs(ax_deg) > 9 and abs(ay_deg) > 9
    right = "waiting" if not done else "refused" if index == 12 else "rim" if corner else "centred"
    return {
        "index": index,
        "ax_deg": ax_deg,
        "ay_deg": round(ay_deg * 8.2 / 9.3, 2),
        "left": "waiting" if not done else "rim" if corner else "centred",
        "right": right,
        "left_reason": None,
        "right_reason": "its marker is only partly in the picture: 7 of 12 corners" if index == 12 else None,
    }


def job(
    job_id: str, *, state: str = "running", kind: str = "calibration.mirrors", changes: Document | None = None
) -> Document:
    over = state in {"succeeded", "failed", "cancelled"}
    return {
        "id": job_id,
        "kind": kind,
        "state": state,
        "created_utc": UTC,
        "started_utc": UTC,
        "ended_utc": UTC if over else None,
        "progress": {"done": 34, "total": 81, "eta_s": 92.0, "note": "markers: node 35 at +3.5°, -8.2°"},
        "result_url": None,
        "problem": None,
    } | (changes or {})


def reach() -> Document:
    """Return where each eye can look: boxes that overlap in the middle of a picture of 720 x 540 px."""
    left = [[100, 45], [540, 45], [540, 495], [100, 495]]
    right = [[190, 45], [620, 45], [620, 495], [190, 495]]
    return {"calibration_id": "a" * 32, "distance_m": None, "left_px": left, "right_px": right}
