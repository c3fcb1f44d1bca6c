"""Records frames: callers queue them without waiting, and a thread writes them.

The queue is a bounded ring. When it is full, the newest frame is dropped and counted, so that every gap in
a recording is known.
"""

import json
import logging
import threading
import time
from collections import deque
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

from foveacam_hardware.contract import DeviceFault, FoveaError, Timeout
from foveacam_pipeline.capture.recording.container import McapContainer
from foveacam_pipeline.capture.recording.disk import RecordingDisk, new_recording_file, recording_disk_error
from foveacam_pipeline.capture.recording.pixels import compress_frame
from foveacam_pipeline.capture.recording.session import FINALIZE, STATISTICS, RecordingSession
from foveacam_pipeline.capture.recording.statistics import FrameLoss, StreamStatistics
from foveacam_pipeline.capture.recording.values import RawFrame, StreamFormat, TrackedBox

_log = logging.getLogger(__name__)

READABLE = "what it took can be read"
RING_FRAMES = 64
"""Two thirds of a second of three cameras at 30 Hz; 100 MB of their grey images."""
FINISH_S = 30.0
"""Longest time to finish; then the file is abandoned without its end, but readable as after a crash."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingOptions:
    """Options of a recording. `compress`: each frame by zlib, which may not keep up at the full rate."""

    compress: bool = False
    ring_frames: int = RING_FRAMES
    finish_s: float = FINISH_S


DEFAULT_OPTIONS = RecordingOptions()


class Recorder:
    """A recording in progress. `publish` may be called by any thread and never waits for the disk.

    `close` (or the end of the `with`) writes the rest and the file's end, and raises the error that occurred.
    """

    def __init__(
        self,
        path: Path,
        session: RecordingSession,
        *,
        options: RecordingOptions = DEFAULT_OPTIONS,
        disk: RecordingDisk | None = None,
    ) -> None:
        self.path = path
        self._options = options
        self._container = McapContainer(disk or new_recording_file(path))
        self._forms: dict[str, StreamFormat] = {}
        self._streams: dict[str, StreamStatistics] = {}
        self._ring: deque[tuple[str, RawFrame] | TrackedBox] = deque()
        self._changed = threading.Condition()
        self._closing = self._finalize = False
        self._deadline_s = float("inf")
        self._failure: FoveaError | None = None
        self._thread = threading.Thread(target=self._run, name="foveacam-recording", daemon=True)
        try:
            self._container.begin()
            for name, values in session.records().items():
                self._container.add_metadata(name, values)
        except OSError as error:
            self._close_file()
            raise recording_disk_error(path, error, content="nothing was recorded") from error
        self._thread.start()

    # Interface --------------------------------------------------------------------------------------------

    @property
    def statistics(self) -> dict[str, StreamStatistics]:
        """The frame counts of every stream so far."""
        with self._changed:
            return dict(self._streams)

    @property
    def bytes_written(self) -> int:
        """Length of the file so far."""
        return self._container.length

    @property
    def failure(self) -> FoveaError | None:
        """The error that ended the recording early; None without one."""
        return self._failure

    def publish(self, stream: str, frame: RawFrame) -> bool:
        """Queue a frame without waiting; return whether it will be written unless the disk fails."""
        with self._changed:
            self._streams[stream] = self._streams.get(stream, StreamStatistics()).with_published(frame.seq)
            loss = self._loss_of(stream, frame)
            if loss is not None:
                self._streams[stream] = self._streams[stream].with_lost(loss)
                return False
            self._ring.append((stream, frame))
            self._changed.notify()
            return True

    def publish_box(self, descriptor: TrackedBox) -> bool:
        """Queue a tracked box; return whether there was room."""
        with self._changed:
            if self._closing or self._failure is not None or len(self._ring) >= self._options.ring_frames:
                return False
            self._ring.append(descriptor)
            self._changed.notify()
            return True

    def close(self, *, finalize: bool = True) -> dict[str, StreamStatistics]:
        """Write what is queued and the file's end; return the counts, or raise the error that occurred.

        `finalize`: whether to mark the recording as ended regularly.
        """
        with self._changed:
            if not self._closing:
                self._closing, self._finalize = True, finalize
                self._deadline_s = time.monotonic() + self._options.finish_s
            self._changed.notify()
        self._thread.join(self._options.finish_s + 1.0)
        if self._thread.is_alive():
            raise Timeout(
                f"recording {self.path}: the disk has not answered for {self._options.finish_s:g} s; what it"
                " took can be read, the rest is lost; choose another disk"
            )
        if self._failure is not None:
            raise self._failure
        return self.statistics

    def __enter__(self) -> "Recorder":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self.close(finalize=error is None)
        except FoveaError:
            if error is None:
                raise

    def _loss_of(self, stream: str, frame: RawFrame) -> FrameLoss | None:
        if self._closing:
            return FrameLoss.CLOSED
        if self._failure is not None:
            return FrameLoss.DISK
        if self._forms.setdefault(stream, frame.form) != frame.form:
            return FrameLoss.FORMAT
        return FrameLoss.QUEUE if len(self._ring) >= self._options.ring_frames else None

    # Writer thread ----------------------------------------------------------------------------------------

    def _run(self) -> None:
        begun: set[str] = set()
        try:
            while (item := self._next()) is not None:
                self._write(item, begun)
            self._finish()
        except OSError as error:
            self._fail(recording_disk_error(self.path, error, content=READABLE))
        except Exception as error:  # noqa: BLE001 - the thread's outermost frame: the recording ends, and says why
            _log.exception("recording %s", self.path)
            self._fail(DeviceFault(f"recording {self.path}: {error}; {READABLE}; begin another one"))

    def _next(self) -> tuple[str, RawFrame] | TrackedBox | None:
        """Return the next item to write; None after the last."""
        with self._changed:
            self._changed.wait_for(lambda: self._ring or self._closing)
            if self._ring and time.monotonic() > self._deadline_s:
                self._lose_waiting(FrameLoss.DEADLINE)
            return self._ring.popleft() if self._ring else None

    def _write(self, item: tuple[str, RawFrame] | TrackedBox, begun: set[str]) -> None:
        if isinstance(item, TrackedBox):
            self._container.add_descriptor(item)
            return
        stream, frame = item
        try:
            frame = compress_frame(frame) if self._options.compress else frame
            if stream not in begun:
                self._container.add_stream(stream, frame.form)
                begun.add(stream)
            size = self._container.add_frame(stream, frame)
        except OSError:
            with self._changed:
                self._streams[stream] = self._streams[stream].with_lost(FrameLoss.DISK)
            raise
        with self._changed:
            self._streams[stream] = self._streams[stream].with_written(size, t_ns=frame.t_ns)

    def _finish(self) -> None:
        counts = {stream: json.dumps(found.document()) for stream, found in self.statistics.items()}
        self._container.add_metadata(STATISTICS, counts)
        in_time = not any(FrameLoss.DEADLINE in found.losses for found in self.statistics.values())
        if in_time and self._finalize:
            self._container.add_metadata(FINALIZE, {"durationSec": json.dumps(self._duration_s())})
        self._container.finish()

    def _duration_s(self) -> float:
        found = self.statistics.values()
        first = min((counts.first_t_ns for counts in found if counts.first_t_ns is not None), default=0)
        last = max((counts.last_t_ns for counts in found if counts.last_t_ns is not None), default=0)
        return (last - first) / 1e9

    def _fail(self, failure: FoveaError) -> None:
        """End early with a readable file, complete if the disk has room for its end."""
        lost: list[tuple[str, int]] = []
        try:
            lost = self._container.recover()
        except OSError:
            self._close_file()
        with self._changed:
            for stream, size in lost:
                self._streams[stream] = self._streams[stream].with_taken_back(size)
            self._failure = failure
            self._lose_waiting(FrameLoss.DISK)

    def _close_file(self) -> None:
        try:
            self._container.close()
        except OSError:
            return  # the disk has failed already, and that is reported

    def _lose_waiting(self, loss: FrameLoss) -> None:
        """Count all queued frames as lost; called with the lock held."""
        for item in self._ring:
            if not isinstance(item, TrackedBox):
                self._streams[item[0]] = self._streams[item[0]].with_lost(loss)
        self._ring.clear()
