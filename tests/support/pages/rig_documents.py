"""What a server would say of a rig: cameras with their settings, trigger, controller, rail. Pure data."""

import copy
from typing import Any

from tests.support.pages.calibration_results import UTC

Document = dict[str, Any]  # Any: JSON, written out below

NUMBERS = ("exposure_ms", "gain_db", "black_level", "frame_rate_hz")
MODES = ("exposure_auto", "frame_rate_auto")
FOUND_MS = 12.5
"""What the foveae find to be a good exposure."""


def camera(role: str) -> Document:
    return {
        "role": role,
        "vendor": "FLIR",
        "model": "Blackfly S BFS-U3-16S2C",
        "serial": {"wide": "24044020", "left": "22071833", "right": "22071834"}[role],
        "version": "1704.0.0.1",
        "connected": True,
        "width": 1440,
        "height": 1080,
        "px_per_deg": 55.07 if role == "wide" else 502.4,
        "exposure_ms": 8.0,
        "frame_rate_hz": 20.0,
        "frame_age_ms": 12.0,
        "delivered": 1234567,
        "skipped": 52_100,
        "dropped": 3,
        "incomplete": 0,
        "late": 0,
        "underrun": 0,
        "settings": {
            "exposure_ms": 8.0,
            "exposure_auto": "off",
            "gain_db": 0.0,
            "black_level": 0.0,
            "frame_rate_hz": 30.0,
            "frame_rate_auto": False,
            "pixel_format": "BayerRG8",
            "binning": 1,
            "trigger": "none" if role == "wide" else "hardware",
            "kept": False,
        },
        "ranges": {
            "exposure_ms": {"low": 0.03, "high": 1000.0},
            "exposure_auto": ["off", "once", "continuous"] if role == "wide" else ["off", "once"],
            "gain_db": {"low": 0.0, "high": 24.0},
            "black_level": {"low": 0.0, "high": 12.0},
            "frame_rate_hz": {"low": 1.0, "high": 226.0},
            "frame_rate_auto": True,
            "pixel_formats": ["Mono8", "BayerRG8", "BayerRG12p"],
        },
        "link": {"phase": "streaming", "reason": "", "since_s": 312.4, "epoch": 1},
    }


def lost(role: str, reason: str) -> Document:
    """A camera that was there and is gone."""
    link = {"phase": "backoff", "reason": reason, "since_s": 12.3, "epoch": 2}
    return camera(role) | {"connected": False, "frame_rate_hz": 0.0, "frame_age_ms": 12_300.0, "link": link}


def trigger() -> Document:
    return {
        "settle_us": 14_000,
        "settle_source": "measured 2026-03-02",
        "interval_ms": 22.5,
        "rate_hz": 44.44,
    }


def trigger_test(left: str = "untested", right: str = "untested") -> Document:
    def eye(name: str, verdict: str) -> Document:
        software_ms = 31.0 if verdict.startswith("ok") or verdict == "wiring" else None
        hardware_ms = 22.0 if verdict == "ok" else None
        detail = "not tested yet" if verdict == "untested" else f"found: {verdict}"
        return {
            "eye": name,
            "verdict": verdict,
            "detail": detail,
            "software_ms": software_ms,
            "hardware_ms": hardware_ms,
        }

    tested = left != "untested"
    return {
        "id": "trg-1" if tested else "",
        "created_utc": UTC if tested else "",
        "eyes": [eye("left", left), eye("right", right)],
    }


def controller_link() -> Document:
    stream = {"left_x_v": 12.5, "left_y_v": -3.25, "right_x_v": -11.0, "right_y_v": 2.0}
    return {
        "tx_bytes": 8422,
        "rx_bytes": 16383,
        "tx_packets": 677,
        "rx_packets": 825,
        "bad_packets": 1,
        "crc": True,
        "crc_errors": 1,
        "lost_answers": 0,
        "tx_bytes_per_s": 512.0,
        "rx_bytes_per_s": 700.0,
        "tx_packets_per_s": 41.0,
        "rx_packets_per_s": 48.0,
        "queued_bytes": 96,
        "rtt_p50_ms": 0.9,
        "rtt_p95_ms": 2.1,
        "rtt_p99_ms": 2.4,
        "rtt_max_ms": 7.5,
        "update_limit_hz": 985.0,
        "clock_offset_ms": 0.5,
        "clock_drift_ppm": -12.25,
        "streams": [{"stream": 0, "updates_per_s": 240.0, **stream}],
    }


def mirrors_more() -> Document:
    """What the document of the mirrors says of their controller."""
    return {
        "guarded": True,
        "rail_wanted": True,
        "controller": {
            "vendor": "FoveaCam",
            "model": "mirror controller",
            "serial": "11820340",
            "version": "2.1.0",
            "port": "/dev/ttyACM0",
        },
        "link": controller_link(),
    }


def rail() -> Document:
    places = [("far left", -300.0), ("left", -100.0), ("centre", 0.0), ("right", 100.0), ("far right", 300.0)]
    return {
        "present": True,
        "info": {"vendor": "Grbl", "model": "rail", "serial": "rail", "version": "1.1h"},
        "moves_itself": True,
        "wanted_mm": None,
        "connected": True,
        "homed": True,
        "awaits_zero": False,
        "moving": False,
        "position_mm": 0.0,
        "fault": None,
        "limits": {"min_mm": -305.0, "max_mm": 305.0},
        "places": [{"name": name, "position_mm": position_mm} for name, position_mm in places],
    }


def changed(rig: Document, role: str, body: Document | None) -> tuple[Document, Document]:
    """Return the rig and the answer after a change, or after a reset where there is no body.

    Exposures are taken in whole 0.01 ms, as a camera with lines would. Foveae that are asked for one exposure
    have found it at once.
    """
    if body is not None and body["linked"] and body.get("exposure_auto") == "once":
        body = body | {"exposure_auto": "off", "exposure_ms": FOUND_MS}
    rig = copy.deepcopy(rig)
    roles = ("left", "right") if body is not None and body["linked"] else (role,)
    for found in rig["cameras"]:
        if found["role"] in roles:
            wish = camera(role)["settings"] if body is None else body | {"kept": True}
            for name in (*NUMBERS, *MODES, "pixel_format", "kept"):
                if name in wish:
                    value = wish[name]
                    found["settings"][name] = round(value, 2) if name == "exposure_ms" else value
    rig["divergence"] = divergence(rig)
    answer = {
        "cameras": [found for found in rig["cameras"] if found["role"] in roles],
        "divergence": rig["divergence"],
    }
    return rig, answer


def divergence(rig: Document) -> list[Document]:
    """Return in what the foveae differ at all."""
    left, right = (
        next(found["settings"] for found in rig["cameras"] if found["role"] == eye)
        for eye in ("left", "right")
    )
    names = ("exposure_ms", "exposure_auto", "gain_db", "black_level", "pixel_format")
    return [
        {"setting": name, "left": left[name], "right": right[name]}
        for name in names
        if left[name] != right[name]
    ]


def start(**states: str) -> Document:
    """Return the steps of a start; all are done but those that `states` names."""
    devices = ("rig", "calibration", "mirrors", "wide", "left", "right", "pan_tilt", "rail")
    return {
        "steps": [
            {"device": device, "state": states.get(device, "done"), "detail": "", "remedy": ""}
            for device in devices
        ]
    }
