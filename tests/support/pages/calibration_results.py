"""What a server would say that fits, drift checks and settling have found. Pure data."""

from typing import Any

Document = dict[str, Any]  # Any: JSON, written out below

UTC = "2026-03-14T09:12:00.000Z"


def fit() -> Document:
    scores = {
        "paper cubic": (3, 0.0172, 0.0191),
        "order 7": (7, 0.0009, 0.0011),
        "physics": (None, 0.0021, 0.0024),
    }
    return {
        "calibration_id": "a" * 32,
        "models": [
            {"name": name, "order": order, "eye": eye, "loo_deg": [x, y], "chosen": name == "order 7"}
            for name, (order, x, y) in scores.items()
            for eye in ("left", "right")
        ],
        "fields": [
            {
                "name": f"order {order}",
                "order": order,
                "eye": eye,
                "loo_px": 2.0 / order,
                "chosen": order == 6,
            }
            for order in (2, 4, 6)
            for eye in ("left", "right")
        ],
        "volts_roundtrip_max_lsb": 0.42,
        "paper": {
            "station": "markers",
            "loo_deg": {"left": [0.0172, 0.0191], "right": [0.0174, 0.0188]},
            "volts_roundtrip_max_lsb": 61.2,
            "steps": [_variant("paper's plain model", 8.6), _variant("with the pupil's walk", 0.4)],
        },
        "parallax": {"markers": _parallax(5.0, 0.0041), "markers near": _parallax(2.5, 0.0163)},
        "drift": {"left": _mount_drift(158.86, [158.66, 4.1]), "right": _mount_drift(0.9, [])},
    }


def _mount_drift(moved_px: float, knocks_px: list[float]) -> Document:
    still = {"px_per_minute": 0.3, "sigma_px": 0.03, "minutes": 2.8, "pieces": 3, "visits": 16}
    return {**still, "moved_px": moved_px, "knocks_px": knocks_px}


def _variant(name: str, error_px: float) -> Document:
    return {"name": name} | {f"{what}_rms_px": error_px for what in ("pointing", "rectification", "epipolar")}


def _parallax(distance_m: float, largest_deg: float) -> Document:
    return {
        "distance_m": distance_m,
        "tape_m": distance_m,
        "largest_deg": largest_deg,
        "corrected": True,
        "words": f"the target is {distance_m} m away by its print; the parallax of Eq. 1 was taken out",
    }


def settle_axis(eye: str, axis: str) -> Document:
    return {
        "eye": eye,
        "axis": axis,
        "settle_ms": 9.8 if axis == "x" else 10.4,
        "settle_1pct_ms": 5.7,
        "resonance_hz": 1204.0,
        "quality": 21.5,
    }


def settle_time(settle_us: int | None = None, *, session_id: str = "ses-1f0a") -> Document:
    """Return the wait after a move: as measured, or as the rig's file says."""
    measured = None
    if settle_us is not None:
        measured = {
            "settle_us": settle_us,
            "measured_utc": UTC,
            "session_id": session_id,
            "low_pass_hz": 120,
        }
    return {
        "settle_us": settle_us or 14_000,
        "source": "rig file" if measured is None else "measured 2026-03-14",
        "rig_file_us": 14_000,
        "measured": measured,
    }


def drift_check(check_id: str = "dft-1", *, applied: bool = False) -> Document:
    return {
        "id": check_id,
        "created_utc": UTC,
        "calibration_id": "a" * 32,
        "looks": 9,
        "applied": applied,
        "new_calibration_id": "c" * 32 if applied else None,
        "eyes": [
            {
                "eye": eye,
                "shift_x_deg": sign * 0.0312,
                "shift_y_deg": -0.0101,
                "rotation_deg": 0.012,
                "scale": 1.0,
                "sigma_deg": 0.0024,
                "significant": True,
            }
            for eye, sign in (("left", 1), ("right", -1))
        ],
        "vergence_known": False,
        "detail": "9 places were compared with the wide view; both eyes agree",
    }
