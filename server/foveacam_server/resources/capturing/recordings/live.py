"""The recording in progress: passes camera frames to the recorder until it is stopped."""

import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from foveacam_hardware.contract import DeviceFault, FoveaError, Frame, Role
from foveacam_pipeline.capture.recording.bounds import RecordingBounds
from foveacam_pipeline.capture.recording.poses import raw_frame
from foveacam_pipeline.capture.recording.recorder import DEFAULT_OPTIONS, Recorder, RecordingOptions
from foveacam_pipeline.capture.recording.session import RigDescription
from foveacam_pipeline.capture.recording.statistics import StreamStatistics
from foveacam_pipeline.capture.recording.values import STREAM_OF_ROLE, TrackedBox
from foveacam_server.foundation.names import utc_now
from foveacam_server.foundation.watching.flows import FILE, count_flow
from foveacam_server.resources.capturing.recordings.schema import RecordingState

_log = logging.getLogger(__name__)

PART = "foveacam-recording"
"""Name of the thread that writes frames."""


@dataclass(slots=True, kw_only=True)
class LiveRecording:
    """The recording in progress; written by its job and the cameras' thread, read by any thread."""

    id: str
    job_id: str
    path: Path
    roles: tuple[Role, ...]
    rig: RigDescription
    label: str
    bounds: RecordingBounds
    every: bool
    """Whether frames are recorded at the rig's full rate instead of the live views' rate."""
    begun_ns: int
    packed: bool = False
    options: RecordingOptions = DEFAULT_OPTIONS
    boxes: Callable[[Frame], list[TrackedBox]]
    """Returns the boxes of the followed targets in a wide frame."""
    created_utc: str = field(default_factory=utc_now)
    recorder: Recorder | None = None
    failure: FoveaError | None = None
    stopping: threading.Event = field(default_factory=threading.Event)
    ended: threading.Event = field(default_factory=threading.Event)
    newest_ns: dict[Role, int] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """The recording's name: its file's stem."""
        return self.path.stem

    @property
    def state(self) -> RecordingState:
        """State of the recording: starting, recording or ending."""
        if self.recorder is None:
            return "starting"
        return "ending" if self.stopping.is_set() else "recording"

    @property
    def statistics(self) -> dict[str, StreamStatistics]:
        """Frame counts so far, by stream."""
        return {} if self.recorder is None else self.recorder.statistics

    @property
    def size_bytes(self) -> int:
        """Size of the file so far, bytes."""
        return 0 if self.recorder is None else self.recorder.bytes_written

    @property
    def broken(self) -> FoveaError | None:
        """The fault that ends it early; None without one."""
        return self.failure or (None if self.recorder is None else self.recorder.failure)

    def record_frame(self, frame: Frame) -> None:
        """Pass a frame with its pose to the recorder; skip a repeated one. Never raises."""
        recorder = self.recorder
        if recorder is None or frame.t_ns <= self.newest_ns.get(frame.role, -1):
            return
        self.newest_ns[frame.role] = frame.t_ns
        try:
            found = raw_frame(frame, calibration=self.rig.calibration, packed=self.packed)
            kept = recorder.publish(STREAM_OF_ROLE[frame.role], found)
            count_flow(PART, FILE, "frames", passed=int(kept), dropped=int(not kept))
            for box in self.boxes(frame) if frame.role is Role.WIDE else ():
                recorder.publish_box(box)
        except Exception as error:  # noqa: BLE001 - this is the hardware's thread, which must not end
            _log.exception("recording %s", self.name)
            self.failure = DeviceFault(
                f"recording {self.name}: a frame of camera {frame.role.value} cannot be recorded ({error});"
                " what came before it can be read; look at the camera's format"
            )

    def summary(self) -> str:
        """Return the frame counts and size in words."""
        found = self.statistics.values()
        written, dropped = sum(one.written for one in found), sum(one.dropped for one in found)
        return f"{written} frames, {dropped} dropped, {self.size_bytes / 1e6:.0f} MB"
