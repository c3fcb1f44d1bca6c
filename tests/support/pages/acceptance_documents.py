"""What a server would say of acceptance runs: accepted, with faults, ended early. Pure data."""

from typing import Any

Document = dict[str, Any]  # Any: JSON, written out below

UTC = "2026-03-14T09:12:00.000Z"
NO_STATION = "the rig file names no station with markers; add one"
TRIGGER_FAULT = {
    "fault": "late_strobe",
    "subject": "left",
    "detail": "left: the strobe comes 2.1 ms after the trigger",
    "remedy": "remove the strobe's delay in the camera's settings, or check its opto-coupler",
}


def figure(
    name: str,
    value: float,
    unit: str = "",
    *,
    low: float | None = None,
    high: float | None = None,
) -> Document:
    within = (low is None or value >= low) and (high is None or value <= high)
    return {"name": name, "value": value, "unit": unit, "low": low, "high": high, "within": within}


def check(name: str, title: str, verdict: str = "passed", **more: object) -> Document:
    found = {"name": name, "title": title, "verdict": verdict, "figures": [], "findings": []}
    return found | {"note": "", "picture": None} | more


def run(acceptance_id: str = "accept-1", *, checks: list[Document], **more: object) -> Document:
    found = {
        "id": acceptance_id,
        "created_utc": UTC,
        "rig_id": "sim-paper",
        "calibration_id": "a" * 16,
        "duration_s": 612.4,
        "complete": True,
        "accepted": all(each["verdict"] == "passed" for each in checks),
        "checks": checks,
    }
    return found | more


def passed(acceptance_id: str = "accept-1", **more: object) -> Document:
    """A run in which every check passed."""
    return run(acceptance_id, checks=[_devices(), _triggers(0.15), _returns()], **more)


def failed(acceptance_id: str = "accept-1", **more: object) -> Document:
    """A run that found a late strobe, so that the returns were not measured."""
    triggers = _triggers(2.1) | {"verdict": "failed", "findings": [TRIGGER_FAULT]}
    waiting = check("returns", _returns()["title"], "not_done", note="waits for: Trigger and strobe lines")
    return run(acceptance_id, checks=[_devices(), triggers, waiting], **more)


def ended_early(acceptance_id: str = "accept-1", **more: object) -> Document:
    """A run that was cancelled after two checks."""
    checks = [_devices(), _triggers(0.15)]
    return run(acceptance_id, checks=checks, complete=False, accepted=False, **more)


def without_markers(acceptance_id: str = "accept-1", **more: object) -> Document:
    """A run of a rig whose file names no station with markers."""
    waiting = check("pictures", "Pictures: which camera, which way up, alive", "not_done", note=NO_STATION)
    return run(acceptance_id, checks=[_devices(), _triggers(0.15), waiting], **more)


def _devices() -> Document:
    return check("devices", "Devices: all there")


def _triggers(left_ms: float) -> Document:
    figures = [
        figure(f"{eye} strobe after the trigger", value, "ms", high=0.45)
        for eye, value in (("left", left_ms), ("right", 0.15))
    ]
    return check("triggers", "Trigger and strobe lines", figures=figures)


def _returns() -> Document:
    title = "Return: the mirrors come back to the same angle"
    scatter = figure("scatter of the returns", 0.00002, "°", high=0.016)
    return check("returns", title, figures=[scatter], picture="returns")
