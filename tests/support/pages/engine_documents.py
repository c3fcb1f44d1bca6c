"""What a server would say of the load of its parts. Pure data."""

from typing import Any

from tests.support.pages.calibration_results import UTC

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
    return {
        "view": name,
        "rate_hz": 20.0,
        "expected_hz": None if name == "wide_depth" else 20.0,
        "slow_reason": None,
        "published": 900,
        "repeated": 2,
        "sent": 850,
        "dropped": 12,
    }


def part(name: str, kind: str, *, busy: float | None = None) -> Document:
    waiting = 2 if name == "foveacam-hardware" else None
    return {"name": name, "kind": kind, "busy_share": busy, "waiting": waiting, "flagged": False}


def edge(source: str, target: str, items: str, rate_hz: float, *, dropped: int = 0) -> Document:
    return {
        "source": source,
        "target": target,
        "items": items,
        "rate_hz": rate_hz,
        "dropped_hz": dropped / 10.0,
        "mb_per_s": 15.5 if items == "pictures" else None,
        "count": 1200,
        "dropped": dropped,
        "flagged": dropped > 0,
    }


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
        "flow_window_s": 10.0,
        "parts": [
            part("camera left", "camera"),
            part("camera wide", "camera"),
            part("encoder", "thread", busy=0.22),
            part("event loop", "thread", busy=0.08),
            part("foveacam-hardware", "thread", busy=0.41),
            part("foveacam-jobs", "thread", busy=0.0),
            part("mirrors", "device"),
            part("view left", "view"),
            part("view wide", "view"),
            part("viewers", "clients"),
        ],
        "edges": [
            edge("camera left", "foveacam-hardware", "frames", 12.0),
            edge("camera wide", "foveacam-hardware", "frames", 20.0),
            edge("encoder", "viewers", "pictures", 30.0),
            edge("event loop", "foveacam-jobs", "jobs", 0.0),
            edge("foveacam-hardware", "mirrors", "moves", 12.0),
            edge("foveacam-hardware", "view left", "pictures", 12.0),
            edge("foveacam-hardware", "view wide", "pictures", 20.0),
            edge("foveacam-jobs", "foveacam-hardware", "commands", 0.4),
            edge("view left", "encoder", "pictures", 12.0),
            edge("view wide", "encoder", "pictures", 20.0),
        ],
    }
