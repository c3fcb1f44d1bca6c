"""`foveacam recording info`: describe a recording, as a document and as a table."""

from pathlib import Path
from typing import Any

from rich.console import Group
from rich.table import Table
from rich.text import Text

from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.capture.recording.session import SESSION


def information(file: Path) -> dict[str, object]:
    """Return the document of a recording file; raise `InvalidInput` for another file."""
    with Recording(file) as recording:
        return {"file": str(file), "bytes": file.stat().st_size, **information_of(recording)}


def information_of(recording: Recording) -> dict[str, Any]:  # Any: a JSON document
    """Return the document of an open recording."""
    first_ns, last_ns = recording.span_ns
    return {
        "recorded": recording.metadata.get(SESSION, {}).get("timestamp"),
        "app": recording.metadata.get(SESSION, {}).get("app"),
        "duration_s": (last_ns - first_ns) / 1e9,
        "finalized": recording.finalized,
        "truncated": _truncation(recording),
        "rig": _rig(recording),
        "slots": list(recording.slots),
        "streams": {
            name: {
                "role": None if stream.role is None else stream.role.value,
                "frames": len(stream),
                "fps": round(stream.fps, 3),
                "width": stream.form.width,
                "height": stream.form.height,
                "pixel_format": stream.form.pixel_format,
                "bits": stream.form.bits,
                "packed": stream.form.packed,
                "compressed": stream.form.compressed,
            }
            for name, stream in recording.streams.items()
        },
    }


def _truncation(recording: Recording) -> dict[str, object] | None:
    found = recording.truncation
    if found is None:
        return None
    return {
        "at_byte": found.at_byte,
        "lost_bytes": found.lost_bytes,
        "lost": found.lost,
        "reason": found.reason,
    }


def _rig(recording: Recording) -> dict[str, object] | None:
    rig = recording.rig
    if rig is None:
        return None
    return {
        "rig_id": rig.rig_id,
        "name": rig.name,
        "baseline_m": rig.baseline_m,
        "calibration_id": None if rig.calibration is None else rig.calibration.id,
        "calibration_problem": rig.problem,
    }


def information_shown(found: dict[str, object]) -> Group:
    """Return the document as a table."""
    end = "ended as meant" if found["finalized"] else "not ended as meant"
    lost = found["truncated"]
    if isinstance(lost, dict):
        held = f", among them {lost['lost']}" if lost["lost"] else ""
        end = f"cut off: {lost['reason']}; {lost['lost_bytes']} bytes lost{held}"
    rig = found["rig"]
    whose = f"rig {rig['rig_id']}, calibration {rig['calibration_id']}" if isinstance(rig, dict) else "no rig"
    title = f"{found['file']}: {float(str(found['duration_s'])):.2f} s, {end}; {whose}"
    table = Table()
    for name in ("stream", "role", "frames", "fps", "size", "format"):
        table.add_column(name, justify="right" if name in ("frames", "fps") else "left")
    streams = found["streams"]
    for stream, facts in (streams if isinstance(streams, dict) else {}).items():
        form = f"{facts['pixel_format']}{', zlib' if facts['compressed'] else ''}, {facts['bits']} bit"
        size = f"{facts['width']} x {facts['height']}"
        table.add_row(stream, facts["role"] or "", str(facts["frames"]), f"{facts['fps']:.2f}", size, form)
    return Group(Text(title), table)
