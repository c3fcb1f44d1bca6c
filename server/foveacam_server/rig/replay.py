"""Presents a recording to the hardware's replay drivers: its streams by role, its rig, its calibration."""

import threading
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import DeviceInfo, InvalidInput, MirrorVolts, Role
from foveacam_hardware.drivers.replay.source import RecordedExposure
from foveacam_hardware.drivers.replay.timeline import EndOfPlayback, Playback
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.capture.recording.session import read_wide_lens
from foveacam_pipeline.capture.recording.values import RecordedStream
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.foundation.settings import Settings

UNNAMED_RIG = "recording"
"""Rig id for a recording without one."""
USUAL_BASELINE_M = 0.2


class PlayedCamera:
    """Implements `RecordedCamera` over one stream; `lock`: of the whole recording."""

    def __init__(
        self, recording: Recording, stream: RecordedStream, *, info: DeviceInfo, lock: threading.Lock
    ) -> None:
        self._recording = recording
        self._stream = stream
        self._lock = lock
        self.info = info

    @property
    def t_ns(self) -> NDArray[np.int64]:
        """(n,) times of the exposures."""
        return self._stream.t_ns

    def frame(self, index: int) -> RecordedExposure:
        """Return one frame."""
        with self._lock:
            found = self._recording.frame(self._stream.name, index)
        pose = found.pose
        return RecordedExposure(
            image=found.image,
            bits=found.bits,
            volts=pose.volts,
            exposure_ns=pose.exposure_ns,
            frame_id=pose.frame_id,
            binning=found.binning,
        )

    def volts(self, index: int) -> MirrorVolts | None:
        """Return the mirror's drive during an exposure."""
        with self._lock:
            return self._recording.pose(self._stream.name, index).volts


class PlayedRig:
    """Implements `RecordedRig` over an open recording."""

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self._lock = threading.Lock()
        rig, lens = recording.rig, read_wide_lens(recording.metadata)
        recorded_m = None if lens is None else lens[1]
        self.rig_id = UNNAMED_RIG if rig is None else rig.rig_id
        self.name = recording.path.name if rig is None else f"{rig.name} ({recording.path.name})"
        self.baseline_m = rig.baseline_m if rig is not None else recorded_m or USUAL_BASELINE_M
        self.calibration: Calibration | None = None if rig is None else rig.calibration
        self.cameras: Mapping[Role, PlayedCamera] = {
            role: self._camera(stream)
            for role in Role
            if (stream := recording.stream_of_role(role)) is not None and len(stream)
        }

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            self._recording.close()

    def _camera(self, stream: RecordedStream) -> PlayedCamera:
        rig, path = self._recording.rig, self._recording.path
        recorded = None if rig is None else rig.cameras.get(stream.name)
        info = DeviceInfo(
            vendor="recording" if recorded is None else recorded.vendor,
            model=stream.name if recorded is None else recorded.model,
            serial=f"{path.stem}-{stream.name}",  # not the camera's own, whose stored settings would not fit
            port=str(path),
        )
        return PlayedCamera(self._recording, stream, info=info, lock=self._lock)


def open_recording(path: Path) -> PlayedRig:
    """Open a recording for replay; raise `InvalidInput` when it cannot be played."""
    recording = Recording(path)
    played = PlayedRig(recording)
    if not played.cameras:
        played.close()
        raise InvalidInput(
            f"replay: {path} holds no frames of a wide (center), a left or a right camera;"
            f" its streams are {', '.join(recording.streams) or 'none'}; choose another recording"
        )
    return played


def playback_of(settings: Settings) -> Playback:
    """Return the playback of the settings' recording."""
    return Playback(speed=settings.replay_speed, at_end=EndOfPlayback(settings.replay_at_end))
