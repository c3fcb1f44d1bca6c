"""Records an opened rig: looks and wide frames go to the recorder as they come."""

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
from foveacam_server.calibrate_command.choices import CalibrateOptions
from foveacam_server.calibrate_command.rig import RigChoice, opened_rig, opened_shop
from foveacam_server.recordings.begin import check_room, identity_of

Tell = Callable[[float, str], None]
"""Called with seconds recorded and a few words."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingSpec:
    """What to record, and how. `direction_deg`: of the gaze, (ax, ay); `distance_m`: None is infinity."""

    file: Path
    seconds: float
    direction_deg: tuple[float, float] = (0.0, 0.0)
    distance_m: float | None = None
    compress: bool = False
    packed: bool = False


def record_rig(wish: CalibrateOptions, recorded: RecordingSpec, *, tell: Tell) -> dict[str, object]:
    """Open the rig, record it, and return what became of every stream's frames."""
    if recorded.file.suffix.lower() != SUFFIX:
        raise InvalidInput(f"record: {recorded.file.name} is no name of a recording; end it in {SUFFIX}")
    choice = RigChoice.of(wish)
    with opened_shop(choice) as shop:
        calibration = shop.calibration.current
        with opened_rig(choice, shop.settle_times, console=Console(stderr=True, quiet=wish.as_json)) as rig:
            return record_opened(rig, recorded, calibration=calibration, tell=tell)


def record_opened(
    rig: Rig, recorded: RecordingSpec, *, calibration: Calibration | None, tell: Tell
) -> dict[str, object]:
    """Record a rig that is open and enabled; raise what ended it early, as a full disk."""
    volts = gaze_of(recorded, calibration)
    if recorded.file.parent.is_dir():  # else the recorder says so
        check_room((), duration_s=None, free_bytes=free_bytes(recorded.file.parent))
    session = RecordingSession(timestamp=datetime.now(UTC).isoformat(), rig=identity_of(rig, calibration))
    options = RecordingOptions(compress=recorded.compress)
    recorder = Recorder(recorded.file, session, options=options)
    ended = EndCause.STOPPED
    with recorder, suppress(KeyboardInterrupt):
        ended = _looks(rig, recorder, recorded, volts=volts, calibration=calibration, tell=tell)
    return {
        "file": str(recorded.file),
        "ended": ended.value,
        "why": early_end_message(recorded.file) if ended is EndCause.DISK_RESERVE else "",
        "bytes": recorder.bytes_written,
        "streams": {stream: found.document() for stream, found in recorder.statistics.items()},
    }


def gaze_of(recorded: RecordingSpec, calibration: Calibration | None) -> StereoVolts:
    """Return the drive that looks where it was asked; parked, without a calibration, straight ahead."""
    ax_deg, ay_deg = recorded.direction_deg
    if calibration is not None:
        distance_m = math.inf if recorded.distance_m is None else recorded.distance_m
        return calibration.steer(math.radians(ax_deg), math.radians(ay_deg), distance_m=distance_m)
    if (ax_deg, ay_deg) != (0.0, 0.0) or recorded.distance_m is not None:
        raise InvalidInput(
            "record: to look somewhere the rig needs a calibration; calibrate it, or leave the direction out"
        )
    return PARKED


def _looks(
    rig: Rig,
    recorder: Recorder,
    recorded: RecordingSpec,
    *,
    volts: StereoVolts,
    calibration: Calibration | None,
    tell: Tell,
) -> EndCause:
    """Look again and again until a bound is reached or the disk fails; return which bound."""

    def publish(frame: Frame) -> None:
        found = raw_frame(frame, calibration=calibration, packed=recorded.packed)
        recorder.publish(STREAM_OF_ROLE[frame.role], found)

    bounds = RecordingBounds(longest_s=recorded.seconds, free_bytes=lambda: free_bytes(recorded.file.parent))
    begin_ns, last_wide, done_s = rig.clock.now_ns(), -1, 0.0
    while (ended := bounds.reached(done_s)) is None and recorder.failure is None:
        sighting = rig.head.look(volts)
        for wide in (*sighting.wide_before, sighting.wide):
            if wide.seq > last_wide:
                last_wide = wide.seq
                publish(wide)
        publish(sighting.left)
        publish(sighting.right)
        done_s = (rig.clock.now_ns() - begin_ns) / 1e9
        tell(done_s, _told(recorder.statistics, recorder.bytes_written))
    return ended or EndCause.FAILED


def _told(streams: dict[str, StreamStatistics], size: int) -> str:
    written = sum(found.written for found in streams.values())
    dropped = sum(found.dropped for found in streams.values())
    return f"{written} frames, {dropped} dropped, {size / 1e6:.0f} MB"


def record_table(found: dict[str, object]) -> Table:
    """Return what became of the frames, for people."""
    title = f"{found['file']}: {int(str(found['bytes'])) / 1e6:.1f} MB"
    table = Table(title=title, caption=str(found["why"]) or None)
    for name in ("stream", "published", "written", "dropped", "why", "missing", "fps"):
        table.add_column(name, justify="left" if name in ("stream", "why") else "right")
    streams = found["streams"]
    for stream, counts in (streams if isinstance(streams, dict) else {}).items():
        why = ", ".join(f"{loss}: {count}" for loss, count in counts["losses"].items())
        shown = [stream, *(str(counts[name]) for name in ("published", "written", "dropped"))]
        table.add_row(*shown, why, str(counts["missing"]), f"{counts['fps']:.2f}")
    return table
