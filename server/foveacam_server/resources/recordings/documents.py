"""REST documents of recordings."""

from collections.abc import Mapping

from foveacam_pipeline.capture.recording.bounds import EndCause
from foveacam_pipeline.capture.recording.values import STREAM_OF_ROLE, role_of
from foveacam_server.foundation.store import Document
from foveacam_server.resources.recordings.collection import StoredRecording
from foveacam_server.resources.recordings.live import LiveRecording

URL = "/api/v1/recordings"
_COUNTS = ("published", "written", "dropped", "missing", "losses", "bytes")


def recording_document(stored: StoredRecording) -> Document:
    """Return a recording on the disk as a document."""
    held, notes = stored.contents, stored.notes
    rig = (held or {}).get("rig") or {}
    counted = (held or {}).get("statistics") or notes.statistics
    streams = (held or {}).get("streams", {})
    state, why = _state(stored)
    return {
        **_named(notes.id, stored.name, notes.label, notes.created_utc),
        "file": stored.path.name,
        "state": state,
        "ended": notes.ended,
        "why": why,
        "removed": stored.removed,
        "duration_s": round((held or {}).get("duration_s", 0.0), 3),
        "size_bytes": stored.size_bytes,
        "rig_id": rig.get("rig_id"),
        "calibration_id": rig.get("calibration_id"),
        "calibration_problem": rig.get("calibration_problem"),
        "truncated": (held or {}).get("truncated"),
        "streams": [_stream(name, facts, counted.get(name)) for name, facts in streams.items()],
        "playable": any(facts["frames"] > 0 for facts in streams.values()),
        "asked_s": None,
        "left_s": None,
        "room_s": None,
        "room_bytes": None,
        "job_id": None,
    }


def live_document(live: LiveRecording, *, elapsed_s: float) -> Document:
    """Return the recording in progress as a document."""
    counted = {name: found.document() for name, found in live.statistics.items()}
    waiting = {name: found.waiting for name, found in live.statistics.items()}
    nothing: Document = dict.fromkeys((*_COUNTS, "fps"), 0) | {"losses": {}}
    streams = []
    for role in live.roles:
        name = STREAM_OF_ROLE[role]
        counts = counted.get(name, nothing)
        facts = {"role": role.value, "frames": counts["written"], "fps": counts["fps"]}
        streams.append(_stream(name, facts, counts) | {"waiting": waiting.get(name, 0)})
    return {
        **_named(live.id, live.name, live.label, live.created_utc),
        "file": live.path.name,
        "state": live.state,
        "ended": None,
        "why": "",
        "removed": False,
        "duration_s": round(elapsed_s, 3),
        "size_bytes": live.size_bytes,
        "rig_id": live.rig.rig_id,
        "calibration_id": None if live.rig.calibration is None else live.rig.calibration.id,
        "calibration_problem": None,
        "truncated": None,
        "streams": streams,
        "playable": False,
        "asked_s": live.bounds.longest_s,
        "left_s": round(max(0.0, live.bounds.longest_s - elapsed_s), 3),
        **_room(live, elapsed_s=elapsed_s),
        "job_id": live.job_id,
    }


def _room(live: LiveRecording, *, elapsed_s: float) -> Document:
    """Return the bytes it may still write, and for how long at the present rate; None without a rate."""
    room_bytes, rate = live.bounds.remaining_bytes(), live.size_bytes / max(elapsed_s, 1.0)
    return {"room_bytes": room_bytes, "room_s": round(room_bytes / rate, 1) if rate > 0.0 else None}


def _named(recording_id: str, name: str, label: str, created_utc: str) -> Document:
    return {
        "id": recording_id,
        "name": name,
        "label": label,
        "created_utc": created_utc or None,
        "url": f"{URL}/{recording_id}",
    }


def _stream(name: str, facts: Mapping[str, object], counted: Mapping[str, object] | None) -> Document:
    """Return one stream as a document; counts are None when there are none."""
    role = role_of(name)
    counts = {key: (counted or {}).get(key) for key in _COUNTS}
    return {
        "name": name,
        "role": None if role is None else role.value,
        "frames": facts["frames"],
        "fps": facts["fps"],
        "width": facts.get("width"),
        "height": facts.get("height"),
        "pixel_format": facts.get("pixel_format"),
        "bits": facts.get("bits"),
        "waiting": 0,
        **counts,
        "losses": counts["losses"] or {},
    }


def _state(stored: StoredRecording) -> tuple[str, str]:
    """Return the state of a file, and why it is not complete."""
    held = stored.contents
    if held is None:
        return "damaged", stored.trouble
    if held["truncated"] is not None:
        lost = held["truncated"]
        return (
            "truncated",
            stored.notes.why or f"{lost['reason']}; {lost['lost_bytes'] / 1e6:.1f} MB are lost",
        )
    if held["finalized"]:
        return "complete", stored.notes.why if stored.notes.ended is EndCause.DISK_RESERVE else ""
    return "partial", stored.notes.why or "its program did not end it as meant; what it holds is whole"
