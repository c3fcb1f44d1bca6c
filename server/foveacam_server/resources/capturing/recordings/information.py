"""`foveacam recording info`: describe a recording, as a document and as a table."""

from pathlib import Path

from rich.console import Group
from rich.table import Table
from rich.text import Text

from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.capture.recording.session import SESSION
from foveacam_pipeline.capture.recording.values import RecordedStream
from foveacam_server.resources.capturing.recordings.schema import (
    RecordingContents,
    RigFacts,
    StreamFacts,
    TruncationDocument,
)


def information(file: Path) -> RecordingContents:
    """Return the description of a recording file; raise `InvalidInput` for another file."""
    with Recording(file) as recording:
        return contents_of(recording)


def contents_of(recording: Recording) -> RecordingContents:
    """Return the description of an open recording."""
    first_ns, last_ns = recording.span_ns
    session = recording.metadata.get(SESSION, {})
    return RecordingContents(
        file=str(recording.path),
        bytes=recording.size_bytes,
        recorded=session.get("timestamp"),
        app=session.get("app"),
        duration_s=(last_ns - first_ns) / 1e9,
        finalized=recording.finalized,
        truncated=_truncation(recording),
        rig=_rig(recording),
        slots=list(recording.slots),
        streams={name: _stream(stream) for name, stream in recording.streams.items()},
    )


def _stream(stream: RecordedStream) -> StreamFacts:
    return StreamFacts(
        role=None if stream.role is None else stream.role.value,
        frames=len(stream),
        fps=round(stream.fps, 3),
        width=stream.form.width,
        height=stream.form.height,
        pixel_format=stream.form.pixel_format,
        bits=stream.form.bits,
        packed=stream.form.packed,
        compressed=stream.form.compressed,
    )


def _truncation(recording: Recording) -> TruncationDocument | None:
    found = recording.truncation
    if found is None:
        return None
    return TruncationDocument(
        at_byte=found.at_byte, lost_bytes=found.lost_bytes, lost=found.lost, reason=found.reason
    )


def _rig(recording: Recording) -> RigFacts | None:
    rig = recording.rig
    if rig is None:
        return None
    return RigFacts(
        rig_id=rig.rig_id,
        name=rig.name,
        baseline_m=rig.baseline_m,
        calibration_id=None if rig.calibration is None else rig.calibration.id,
        calibration_problem=rig.problem,
    )


def information_shown(found: RecordingContents) -> Group:
    """Return the document as a table."""
    end = "ended as meant" if found.finalized else "not ended properly"
    if (lost := found.truncated) is not None:
        held = f", among them {lost.lost}" if lost.lost else ""
        end = f"cut off: {lost.reason}; {lost.lost_bytes} bytes lost{held}"
    rig = found.rig
    whose = "no rig" if rig is None else f"rig {rig.rig_id}, calibration {rig.calibration_id}"
    table = Table()
    for name in ("stream", "role", "frames", "fps", "size", "format"):
        table.add_column(name, justify="right" if name in ("frames", "fps") else "left")
    for name, facts in found.streams.items():
        form = f"{facts.pixel_format}{', zlib' if facts.compressed else ''}, {facts.bits} bit"
        size = f"{facts.width} x {facts.height}"
        table.add_row(name, facts.role or "", str(facts.frames), f"{facts.fps:.2f}", size, form)
    return Group(Text(f"{found.file}: {found.duration_s:.2f} s, {end}; {whose}"), table)
