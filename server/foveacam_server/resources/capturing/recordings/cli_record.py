"""`foveacam record`: open a rig and write its looks and wide frames to a recording."""

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from rich.console import Console
from rich.table import Table

from foveacam_hardware.contract import PARKED, Frame, InvalidInput, StereoVolts
from foveacam_hardware.rig import Rig
from foveacam_pipeline.capture.recording.bounds import EndCause, RecordingBounds, early_end_message
from foveacam_pipeline.capture.recording.poses import raw_frame
from foveacam_pipeline.capture.recording.recorder import Recorder, RecordingOptions
from foveacam_pipeline.capture.recording.session import RecordingSession
from foveacam_pipeline.capture.recording.statistics import StreamStatistics
from foveacam_pipeline.capture.recording.values import STREAM_OF_ROLE, SUFFIX
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.storage.free_space import free_bytes
from foveacam_server.commands.calibration_data import open_data
from foveacam_server.commands.options import RigOptions
from foveacam_server.commands.rig import RigChoice, open_enabled_rig
from foveacam_server.resources.capturing.recordings.begin import check_room, identity_of
from foveacam_server.resources.capturing.recordings.documents import counts_of
from foveacam_server.resources.capturing.recordings.schema import RecordedFile

ReportProgress = Callable[[float, str], None]
"""Callback of the progress: seconds recorded, and a note."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingSpec:
    """The recording to make. `direction_deg`: gaze (ax, ay); `distance_m`: None is infinity."""

    file: Path
    seconds: float
    direction_deg: tuple[float, float] = (0.0, 0.0)
    distance_m: float | None = None
    compress: bool = False
    packed: bool = False


def record_rig(rig_options: RigOptions, spec: RecordingSpec, *, report: ReportProgress) -> RecordedFile:
    """Open the rig, record it, and return the frame counts of every stream."""
    if spec.file.suffix.lower() != SUFFIX:
        raise InvalidInput(f"record: {spec.file.name} is no name of a recording; end it in {SUFFIX}")
    choice = RigChoice.of(rig_options)
    console = Console(stderr=True, quiet=rig_options.as_json)
    with open_data(choice, lock=False) as data:
        calibration = data.calibration.current
        with open_enabled_rig(choice, data.settle_times, console=console) as rig:
            return record_opened(rig, spec, calibration=calibration, report=report)


def record_opened(
    rig: Rig, spec: RecordingSpec, *, calibration: Calibration | None, report: ReportProgress
) -> RecordedFile:
    """Record with an open and enabled rig; raise the fault that ended it early, such as a full disk."""
    volts = gaze_of(spec, calibration)
    if spec.file.parent.is_dir():  # otherwise the recorder raises
        check_room((), duration_s=None, free_bytes=free_bytes(spec.file.parent))
    session = RecordingSession(timestamp=datetime.now(UTC).isoformat(), rig=identity_of(rig, calibration))
    options = RecordingOptions(compress=spec.compress)
    recorder = Recorder(spec.file, session, options=options)
    ended = EndCause.STOPPED
    with recorder, suppress(KeyboardInterrupt):
        ended = _record_looks(rig, recorder, spec, volts=volts, calibration=calibration, report=report)
    return RecordedFile(
        file=str(spec.file),
        ended=ended,
        why=early_end_message(spec.file) if ended is EndCause.DISK_RESERVE else "",
        bytes=recorder.bytes_written,
        streams={stream: counts_of(found) for stream, found in recorder.statistics.items()},
    )


def gaze_of(spec: RecordingSpec, calibration: Calibration | None) -> StereoVolts:
    """Return the volts for the spec's gaze; without a calibration those of parked mirrors, straight ahead."""
    ax_deg, ay_deg = spec.direction_deg
    if calibration is not None:
        distance_m = math.inf if spec.distance_m is None else spec.distance_m
        return calibration.steer(math.radians(ax_deg), math.radians(ay_deg), distance_m=distance_m)
    if (ax_deg, ay_deg) != (0.0, 0.0) or spec.distance_m is not None:
        raise InvalidInput(
            "record: to look somewhere the rig needs a calibration; calibrate it, or leave the direction out"
        )
    return PARKED


def _record_looks(
    rig: Rig,
    recorder: Recorder,
    spec: RecordingSpec,
    *,
    volts: StereoVolts,
    calibration: Calibration | None,
    report: ReportProgress,
) -> EndCause:
    """Record looks until a bound is reached or the recorder fails; return the cause."""

    def publish(frame: Frame) -> None:
        found = raw_frame(frame, calibration=calibration, packed=spec.packed)
        recorder.publish(STREAM_OF_ROLE[frame.role], found)

    bounds = RecordingBounds(longest_s=spec.seconds, free_bytes=lambda: free_bytes(spec.file.parent))
    begin_ns, last_wide, done_s = rig.clock.now_ns(), -1, 0.0
    while (ended := bounds.reached(done_s)) is None and recorder.failure is None:
        observation = rig.head.look(volts)
        for wide in (*observation.wide_before, observation.wide):
            if wide.seq > last_wide:
                last_wide = wide.seq
                publish(wide)
        publish(observation.left)
        publish(observation.right)
        done_s = (rig.clock.now_ns() - begin_ns) / 1e9
        report(done_s, _counts_words(recorder.statistics, recorder.bytes_written))
    return ended or EndCause.FAILED


def _counts_words(streams: dict[str, StreamStatistics], size: int) -> str:
    written = sum(found.written for found in streams.values())
    dropped = sum(found.dropped for found in streams.values())
    return f"{written} frames, {dropped} dropped, {size / 1e6:.0f} MB"


def record_table(found: RecordedFile) -> Table:
    """Return the frame counts as a table."""
    table = Table(title=f"{found.file}: {found.bytes / 1e6:.1f} MB", caption=found.why or None)
    for name in ("stream", "published", "written", "dropped", "why", "missing", "fps"):
        table.add_column(name, justify="left" if name in ("stream", "why") else "right")
    for stream, counts in found.streams.items():
        why = ", ".join(f"{loss}: {count}" for loss, count in counts.losses.items())
        shown = [stream, *(str(count) for count in (counts.published, counts.written, counts.dropped))]
        table.add_row(*shown, why, str(counts.missing), f"{counts.fps:.2f}")
    return table
