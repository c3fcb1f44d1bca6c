"""The recording that is being made: from a camera's frame to the recorder, until somebody says stop."""

import logging
import threading
from dataclasses import dataclass, field
from pathlib import Path

from foveacam_hardware.contract import DeviceFault, FoveaError, Frame, Role
from foveacam_pipeline.capture.recording.bounds import RecordingBounds
from foveacam_pipeline.capture.recording.poses import raw_frame
from foveacam_pipeline.capture.recording.recorder import Recorder
from foveacam_pipeline.capture.recording.session import RigDescription
from foveacam_pipeline.capture.recording.statistics import StreamStatistics
from foveacam_pipeline.capture.recording.values import STREAM_OF_ROLE
from foveacam_server.runtime.names import utc_now

_log = logging.getLogger(__name__)


@dataclass(slots=True, kw_only=True)
class LiveRecording:
    """What is recorded, and how it stands; the job and the cameras' thread write, whoever asks reads."""

    id: str
    job_id: str
    path: Path
    roles: tuple[Role, ...]
    rig: RigDescription
    label: str
    bounds: RecordingBounds
    every: bool
    """Whether frames come as fast as the rig can bring them, or as live views show them."""
    begun_ns: int
    created_utc: str = field(default_factory=utc_now)
    recorder: Recorder | None = None
    failure: FoveaError | None = None
    stopping: threading.Event = field(default_factory=threading.Event)
    ended: threading.Event = field(default_factory=threading.Event)
    newest_ns: dict[Role, int] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Its name, which is its file's."""
        return self.path.stem

    @property
    def state(self) -> str:
        """How it stands, for people."""
        if self.recorder is None:
            return "starting"
        return "ending" if self.stopping.is_set() else "recording"

    @property
    def statistics(self) -> dict[str, StreamStatistics]:
        """What became of the frames so far, by stream."""
        return {} if self.recorder is None else self.recorder.statistics

    @property
    def size_bytes(self) -> int:
        """Length of the file so far."""
        return 0 if self.recorder is None else self.recorder.bytes_written

    @property
    def broken(self) -> FoveaError | None:
        """What ends it early; None while all is well."""
        return self.failure or (None if self.recorder is None else self.recorder.failure)

    def take(self, frame: Frame) -> None:
        """Hand a frame over, with its pose; one that was shown twice is recorded once. Never raises."""
        recorder = self.recorder
        if recorder is None or frame.t_ns <= self.newest_ns.get(frame.role, -1):
            return
        self.newest_ns[frame.role] = frame.t_ns
        try:
            recorder.publish(STREAM_OF_ROLE[frame.role], raw_frame(frame, calibration=self.rig.calibration))
        except Exception as error:  # noqa: BLE001 - this is the hardware's thread: it must live on
            _log.exception("recording %s", self.name)
            self.failure = DeviceFault(
                f"recording {self.name}: a frame of camera {frame.role.value} cannot be recorded ({error});"
                " what came before it can be read; look at the camera's format"
            )

    def told(self) -> str:
        """Return a few words on how far it is."""
        found = self.statistics.values()
        written, dropped = sum(one.written for one in found), sum(one.dropped for one in found)
        return f"{written} frames, {dropped} dropped, {self.size_bytes / 1e6:.0f} MB"
