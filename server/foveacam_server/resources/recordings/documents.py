"""REST documents of recordings."""

from foveacam_pipeline.capture.recording.bounds import EndCause
from foveacam_pipeline.capture.recording.reader import archive_record_path
from foveacam_pipeline.capture.recording.statistics import StreamStatistics
from foveacam_pipeline.capture.recording.values import STREAM_OF_ROLE, role_of
from foveacam_server.datasets.archived import archived_document
from foveacam_server.resources.recordings.collection import StoredRecording
from foveacam_server.resources.recordings.live import LiveRecording
from foveacam_server.resources.recordings.schema import (
    RecordedStreamDocument,
    RecordingDocument,
    RecordingState,
    StreamCounts,
    StreamFacts,
)

URL = "/api/v1/recordings"


def recording_document(stored: StoredRecording) -> RecordingDocument:
    """Return a recording on the disk as a document."""
    held, notes = stored.contents, stored.notes
    rig = None if held is None else held.rig
    counts = stored.counts or notes.statistics
    streams = {} if held is None else held.streams
    state, why = _state(stored)
    return RecordingDocument(
        id=notes.id,
        name=stored.name,
        file=stored.path.name,
        label=notes.label,
        created_utc=notes.created_utc or None,
        state=state,
        ended=notes.ended,
        why=why,
        removed=stored.removed,
        duration_s=0.0 if held is None else round(held.duration_s, 3),
        asked_s=None,
        left_s=None,
        room_s=None,
        room_bytes=None,
        size_bytes=stored.size_bytes,
        rig_id=None if rig is None else rig.rig_id,
        calibration_id=None if rig is None else rig.calibration_id,
        calibration_problem=None if rig is None else rig.calibration_problem,
        truncated=None if held is None else held.truncated,
        streams=[_stored_stream(name, facts, counts.get(name)) for name, facts in streams.items()],
        playable=any(facts.frames > 0 for facts in streams.values()),
        job_id=None,
        archived=archived_document(archive_record_path(stored.path), sample=stored.path),
        url=f"{URL}/{notes.id}",
    )


def live_document(live: LiveRecording, *, elapsed_s: float) -> RecordingDocument:
    """Return the recording in progress as a document."""
    calibration, counted = live.rig.calibration, live.statistics
    room_bytes, rate = live.bounds.remaining_bytes(), live.size_bytes / max(elapsed_s, 1.0)
    names = [STREAM_OF_ROLE[role] for role in live.roles]
    return RecordingDocument(
        id=live.id,
        name=live.name,
        file=live.path.name,
        label=live.label,
        created_utc=live.created_utc or None,
        state=live.state,
        ended=None,
        why="",
        removed=False,
        duration_s=round(elapsed_s, 3),
        asked_s=live.bounds.longest_s,
        left_s=round(max(0.0, live.bounds.longest_s - elapsed_s), 3),
        room_s=round(room_bytes / rate, 1) if rate > 0.0 else None,
        room_bytes=room_bytes,
        size_bytes=live.size_bytes,
        rig_id=live.rig.rig_id,
        calibration_id=None if calibration is None else calibration.id,
        calibration_problem=None,
        truncated=None,
        streams=[_live_stream(name, counted.get(name, StreamStatistics())) for name in names],
        playable=False,
        job_id=live.job_id,
        archived=None,
        url=f"{URL}/{live.id}",
    )


def _stored_stream(name: str, facts: StreamFacts, counts: StreamCounts | None) -> RecordedStreamDocument:
    counted = (counts or StreamCounts()).model_dump(exclude={"fps"})
    form = facts.model_dump(exclude={"packed", "compressed"})
    return RecordedStreamDocument(name=name, waiting=0, **form, **counted)


def _live_stream(name: str, found: StreamStatistics) -> RecordedStreamDocument:
    role = role_of(name)
    return RecordedStreamDocument(
        name=name,
        role=None if role is None else role.value,
        frames=found.written,
        width=None,
        height=None,
        pixel_format=None,
        bits=None,
        waiting=found.waiting,
        **counts_of(found).model_dump(),
    )


def counts_of(found: StreamStatistics) -> StreamCounts:
    """Return the counts of a stream as they are stored."""
    return StreamCounts.model_validate(found.document())


def _state(stored: StoredRecording) -> tuple[RecordingState, str]:
    """Return the state of a file, and why it is not complete."""
    held = stored.contents
    if held is None:
        return "damaged", stored.trouble
    if (lost := held.truncated) is not None:
        lost_mb = lost.lost_bytes / 1e6
        return "truncated", stored.notes.why or f"{lost.reason}; {lost_mb:.1f} MB are lost"
    if held.finalized:
        return "complete", stored.notes.why if stored.notes.ended is EndCause.DISK_RESERVE else ""
    return "partial", stored.notes.why or "its program did not end it as meant; what it holds is whole"
