"""What a server would say of the load of its parts. Pure data."""

from typing import Any

from .calibration_results import UTC

Document = dict[str, Any]  # Any: JSON, written out below


def thread(name: str, share: float, *, count: int = 1) -> Document:
    return {
        "name": name,
        "count": count,
        "cpu_share": share,
        "busiest_share": share,
        "flagged": share >= 0.9,
    }


def camera(role: str, *, lost: int = 0) -> Document:
    return {
        "role": role,
        "connected": True,
        "rate_hz": 20.0,
        "worst_gap_ms": 61.5,
        "delivered": 1234567,
        "skipped": 52_100,
        "dropped": lost,
        "incomplete": 0,
        "late": 0,
        "underrun": 0,
        "lost_last_minute": lost,
        "flagged": lost > 0,
    }


def stage(name: str, *, count: int = 60) -> Document:
    known = count > 0
    return {
        "stage": name,
        "window_s": 60.0,
        "count": count,
        "rate_hz": count / 60.0,
        "median_ms": 12.5 if known else None,
        "p99_ms": 99.0 if known else None,
    }


def view(name: str) -> Document:
    return {"view": name, "rate_hz": 20.0, "published": 900, "repeated": 2, "sent": 850, "dropped": 12}


def engine() -> Document:
    """Return the load of a server that keeps up."""
    devices = ("rig", "mirrors", "wide", "left", "right", "pan_tilt")
    return {
        "utc": UTC,
        "version": "0.1.0",
        "window_s": 2.0,
        "process": {
            "began_utc": UTC,
            "up_s": 4000.0,
            "services_opened_s": 2.3,
            "cores": 8,
            "cpu_share": 0.61,
            "memory_mb": 812.0,
            "open_files": 64,
            "open_files_limit": 20_000,
            "database_mb": 1.2,
        },
        "hardware": {"queue_length": 0, "queue_limit": 32, "busy_share": 0.41, "flagged": False},
        "event_loop": {"worst_lag_ms": 8.4, "window_s": 10.0, "flagged": False},
        "threads": [
            thread("foveacam-hardware", 0.31),
            thread("encoder", 0.22, count=2),
            thread("event loop", 0.08),
            thread("foveacam-jobs", 0.0),
        ],
        "stages": [stage("queue"), stage("look"), stage("verge", count=0), stage("request")],
        "cameras": [camera(role) for role in ("wide", "left", "right")],
        "views": [view(name) for name in ("wide", "left", "right", "wide_depth")],
        "start": [
            {"device": device, "state": "done", "after_s": 2.3 + at / 10.0, "duration_s": 0.1}
            for at, device in enumerate(devices)
        ],
    }
