"""Small recordings for tests, and disks that fail."""

import errno
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Image, MirrorVolts
from foveacam_pipeline.capture.recording.disk import Buffer, FileDisk
from foveacam_pipeline.capture.recording.pixels import payload_of, stream_format
from foveacam_pipeline.capture.recording.recorder import RING_FRAMES, Recorder, RecordingOptions
from foveacam_pipeline.capture.recording.session import RecordingSession, RigDescription
from foveacam_pipeline.capture.recording.statistics import StreamStatistics
from foveacam_pipeline.capture.recording.values import FramePose, RawFrame

STREAMS = ("left", "center", "right")
BEGIN_NS = 5_000_000_000
PERIOD_NS = 20_000_000
SESSION = RecordingSession(timestamp="2026-01-31T12:00:00+00:00")


def picture(stream: str, tick: int, *, height: int = 24, width: int = 32) -> NDArray[np.uint8]:
    """Return a grey ramp whose level tells stream and tick."""
    level = 20 + 60 * STREAMS.index(stream) + 3 * tick
    ramp = np.linspace(0.0, 30.0, width)[None, :] + np.linspace(0.0, 20.0, height)[:, None]
    return np.asarray(level + ramp, dtype=np.uint8)


def pose(tick: int) -> FramePose:
    """Return a pose that tells its tick."""
    return FramePose(
        frame_id=100 + tick,
        volts=MirrorVolts(x_v=1.5 + tick, y_v=-0.25 * tick),
        volts_source="fin-averaged",
        angles_rad=(0.01 * tick, -0.02),
        wide_from_fovea=np.arange(9.0).reshape(3, 3) + tick,
        exposure_ns=4_000_000,
    )


def raw(image: Image, *, tick: int, bits: int = 8, packed: bool = False) -> RawFrame:
    """Return a picture as it is recorded, `tick` periods after the begin."""
    form = stream_format(image, bits=bits, packed=packed)
    return RawFrame(
        payload=payload_of(image, form),
        form=form,
        seq=tick,
        t_ns=BEGIN_NS + tick * PERIOD_NS,
        pose=pose(tick),
    )


def record(
    path: Path,
    *,
    ticks: int = 6,
    streams: Sequence[str] = STREAMS,
    rig: RigDescription | None = None,
    options: RecordingOptions | None = None,
) -> dict[str, StreamStatistics]:
    """Make a small recording; unless `options` say otherwise its ring has room for every frame."""
    options = options or RecordingOptions(ring_frames=max(RING_FRAMES, ticks * len(streams)))
    session = RecordingSession(timestamp=SESSION.timestamp, rig=rig)
    with Recorder(path, session, options=options) as recorder:
        for tick in range(ticks):
            for stream in streams:
                recorder.publish(stream, raw(picture(stream, tick), tick=tick))
    return recorder.statistics


class SmallDisk(FileDisk):
    """A disk with room for `room` bytes; with `read_only` it can then not even be taken back from."""

    def __init__(self, path: Path, *, room: int, read_only: bool = False) -> None:
        super().__init__(path)
        self._left = room
        self._room = room
        self._read_only = read_only

    def append(self, buffers: Sequence[Buffer]) -> None:
        size = sum(len(buffer) for buffer in buffers)
        if size <= self._left:
            self._left -= size
            super().append(buffers)
            return
        if self._read_only:
            raise OSError(errno.EROFS, "Read-only file system")
        half = memoryview(b"".join(bytes(buffer) for buffer in buffers))[: self._left]
        self._left = 0
        super().append([half])
        raise OSError(errno.ENOSPC, "No space left on device")

    def truncate(self, length: int) -> None:
        if self._read_only:
            raise OSError(errno.EROFS, "Read-only file system")
        self._left = self._room - length
        super().truncate(length)
