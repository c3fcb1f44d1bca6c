"""The channels of a recording over time, as a document."""

from collections.abc import Container

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.capture.recording.session import SESSION
from foveacam_pipeline.capture.recording.tracks import track_of
from foveacam_pipeline.capture.recording.values import DESCRIPTOR_PREFIX, TELEMETRY, RecordedStream
from foveacam_server.resources.recordings.schema import TrackDocument, TracksDocument

ORDER = ("wide", "left", "right")


def tracks_document(recording: Recording, *, whole: Container[str] = ()) -> TracksDocument:
    """Return cameras, telemetry and boxes of a recording over time.

    `whole`: names of the streams of which the recorder counted that nothing is missing; they have no drops,
    however uneven their rate.
    """
    begin_ns, end_ns = recording.span_ns
    frames = [_frames(stream, begin_ns, whole=stream.name in whole) for stream in recording.streams.values()]
    frames.sort(key=lambda track: (_place(track), track.name))
    others = [topic for topic in recording.topics if topic not in recording.streams]
    return TracksDocument(
        duration_s=(end_ns - begin_ns) / 1e9,
        recorded=recording.metadata.get(SESSION, {}).get("timestamp"),
        tracks=[
            *frames,
            *(_other(topic, recording.times_ns(topic), begin_ns) for topic in others if _kind(topic)),
        ],
    )


def _place(track: TrackDocument) -> int:
    return ORDER.index(track.role) if track.role in ORDER else len(ORDER)


def _kind(topic: str) -> bool:
    return topic == TELEMETRY or topic.startswith(DESCRIPTOR_PREFIX)


def _frames(stream: RecordedStream, begin_ns: int, *, whole: bool) -> TrackDocument:
    track = _document(stream.name, stream.t_ns, begin_ns)
    if whole:
        track.drops = []
    track.role = None if stream.role is None else stream.role.value
    return track


def _other(topic: str, t_ns: NDArray[np.int64], begin_ns: int) -> TrackDocument:
    track = _document(topic.removeprefix(DESCRIPTOR_PREFIX), t_ns, begin_ns)
    track.kind = "telemetry" if topic == TELEMETRY else "boxes"
    return track


def _document(name: str, t_ns: NDArray[np.int64], begin_ns: int) -> TrackDocument:
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
