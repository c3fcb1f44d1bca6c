"""REST documents of recordings, and of their channels over time."""

from collections.abc import Container

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.capture.recording.bounds import EndCause
from foveacam_pipeline.capture.recording.reader import Recording, archive_record_path
from foveacam_pipeline.capture.recording.session import SESSION
from foveacam_pipeline.capture.recording.statistics import StreamStatistics
from foveacam_pipeline.capture.recording.tracks import track_of
from foveacam_pipeline.capture.recording.values import (
    DESCRIPTOR_PREFIX,
    STREAM_OF_ROLE,
    TELEMETRY,
    RecordedStream,
    role_of,
)
from foveacam_server.datasets.archived import archived_document
from foveacam_server.resources.capturing.recordings.collection import StoredRecording
from foveacam_server.resources.capturing.recordings.live import LiveRecording
from foveacam_server.resources.capturing.recordings.schema import (
    RecordedStreamDocument,
    RecordingDocument,
    RecordingState,
    StreamCounts,
    StreamFacts,
    TrackDocument,
    TracksDocument,
)

URL = "/api/v1/recordings"
TRACK_ORDER = ("wide", "left", "right")


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
    """Return the stored form of a stream's counts."""
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
    return "partial", stored.notes.why or "its program did not end it properly; its content is complete"


def tracks_document(recording: Recording, *, whole: Container[str] = ()) -> TracksDocument:
    """Return cameras, telemetry and boxes of a recording over time.

    `whole`: names of the streams that are complete by the recorder's counts; no drops are inferred for them
    from an uneven rate.
    """
    begin_ns, end_ns = recording.span_ns
    frames = [
        _frame_track(stream, begin_ns, whole=stream.name in whole) for stream in recording.streams.values()
    ]
    frames.sort(key=lambda track: (_place(track), track.name))
    others = [topic for topic in recording.topics if topic not in recording.streams]
    return TracksDocument(
        duration_s=(end_ns - begin_ns) / 1e9,
        recorded=recording.metadata.get(SESSION, {}).get("timestamp"),
        tracks=[
            *frames,
            *(_other_track(topic, recording.times_ns(topic), begin_ns) for topic in others if _kind(topic)),
        ],
    )


def _place(track: TrackDocument) -> int:
    return TRACK_ORDER.index(track.role) if track.role in TRACK_ORDER else len(TRACK_ORDER)


def _kind(topic: str) -> bool:
    return topic == TELEMETRY or topic.startswith(DESCRIPTOR_PREFIX)


def _frame_track(stream: RecordedStream, begin_ns: int, *, whole: bool) -> TrackDocument:
    track = _track(stream.name, stream.t_ns, begin_ns)
    if whole:
        track.drops = []
    track.role = None if stream.role is None else stream.role.value
    return track


def _other_track(topic: str, t_ns: NDArray[np.int64], begin_ns: int) -> TrackDocument:
    track = _track(topic.removeprefix(DESCRIPTOR_PREFIX), t_ns, begin_ns)
    track.kind = "telemetry" if topic == TELEMETRY else "boxes"
    return track


def _track(name: str, t_ns: NDArray[np.int64], begin_ns: int) -> TrackDocument:
    found = track_of(t_ns)
    drops_s = ((found.drops_ns - begin_ns) / 1e9).round(6).tolist()
    return TrackDocument(
        name=name,
        kind="frames",
        role=None,
        count=found.count,
        period_s=None if found.period_ns is None else round(found.period_ns / 1e9, 9),
        runs=[(first, last) for first, last in ((found.runs_ns - begin_ns) / 1e9).round(6).tolist()],
        drops=[
            (before, after, int(lost)) for (before, after), lost in zip(drops_s, found.dropped, strict=True)
        ],
    )
