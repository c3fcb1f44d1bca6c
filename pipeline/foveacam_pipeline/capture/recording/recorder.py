"""Records: frames are handed over without waiting, a thread of its own writes them.

Between both stands a bounded ring. When it is full, the newest frame is lost and counted: what was
recorded has no hole that nobody knows of.
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
from foveacam_pipeline.capture.recording.disk import RecordingDisk, disk_failure, new_file
from foveacam_pipeline.capture.recording.pixels import compressed
from foveacam_pipeline.capture.recording.session import FINALIZE, STATISTICS, RecordingSession
from foveacam_pipeline.capture.recording.statistics import FrameLoss, StreamStatistics
from foveacam_pipeline.capture.recording.values import RawFrame, StreamFormat, TrackedBox

_log = logging.getLogger(__name__)

KEPT = "what it took can be read"
RING_FRAMES = 64
"""Two thirds of a second of three cameras at 30 Hz; 100 MB of their grey pictures."""
FINISH_S = 30.0
"""How long finishing may take; then the file is left as a crash would leave it, readable."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingOptions:
    """How to record. `compress`: each frame by zlib, which may not keep up at the full rate."""

    compress: bool = False
    ring_frames: int = RING_FRAMES
    finish_s: float = FINISH_S


USUAL = RecordingOptions()


class Recorder:
    """A recording that is being made. `publish` may be called by any thread and never waits for the disk.

    `close` (or the end of the `with`) writes the rest and the file's end, and raises what went wrong.
    """

    def __init__(
        self,
        path: Path,
        session: RecordingSession,
        *,
        options: RecordingOptions = USUAL,
        disk: RecordingDisk | None = None,
    ) -> None:
        self.path = path
        self._options = options
        self._container = McapContainer(disk or new_file(path))
        self._forms: dict[str, StreamFormat] = {}
        self._streams: dict[str, StreamStatistics] = {}
        self._ring: deque[tuple[str, RawFrame] | TrackedBox] = deque()
        self._changed = threading.Condition()
        self._closing = self._as_meant = False
        self._deadline_s = float("inf")
        self._failure: FoveaError | None = None
        self._thread = threading.Thread(target=self._run, name="foveacam-recording", daemon=True)
        try:
            self._container.begin()
            for name, values in session.records().items():
                self._container.add_metadata(name, values)
        except OSError as error:
            self._let_go()
            raise disk_failure(path, error, kept="nothing was recorded") from error
        self._thread.start()

    # What others ask --------------------------------------------------------------------------------------

    @property
    def statistics(self) -> dict[str, StreamStatistics]:
        """What became of the frames of every stream so far."""
        with self._changed:
            return dict(self._streams)

    @property
    def bytes_written(self) -> int:
        """Length of the file so far."""
        return self._container.length

    @property
    def failure(self) -> FoveaError | None:
        """What ended the recording early; None while all is well."""
        return self._failure

    def publish(self, stream: str, frame: RawFrame) -> bool:
        """Hand over a frame; tell whether it will be written unless the disk fails. Never waits."""
        with self._changed:
            self._streams[stream] = self._streams.get(stream, StreamStatistics()).with_published(frame.seq)
            loss = self._refusal(stream, frame)
            if loss is not None:
                self._streams[stream] = self._streams[stream].with_lost(loss)
                return False
            self._ring.append((stream, frame))
            self._changed.notify()
            return True

    def describe(self, descriptor: TrackedBox) -> bool:
        """Hand over a tracked box; tell whether there was room."""
        with self._changed:
            if self._closing or self._failure is not None or len(self._ring) >= self._options.ring_frames:
                return False
            self._ring.append(descriptor)
            self._changed.notify()
            return True

    def close(self, *, as_meant: bool = True) -> dict[str, StreamStatistics]:
        """Write what waits and the file's end; return the counts, or raise what ended the recording.

        `as_meant`: whether the recording ends because it was to; else the file says that it did not.
        """
        with self._changed:
            if not self._closing:
                self._closing, self._as_meant = True, as_meant
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
            self.close(as_meant=error is None)
        except FoveaError:
            if error is None:
                raise

    def _refusal(self, stream: str, frame: RawFrame) -> FrameLoss | None:
        if self._closing:
            return FrameLoss.CLOSED
        if self._failure is not None:
            return FrameLoss.DISK
        if self._forms.setdefault(stream, frame.form) != frame.form:
            return FrameLoss.FORMAT
        return FrameLoss.QUEUE if len(self._ring) >= self._options.ring_frames else None

    # The thread -------------------------------------------------------------------------------------------

    def _run(self) -> None:
        begun: set[str] = set()
        try:
            while (item := self._next()) is not None:
                self._write(item, begun)
            self._finish()
        except OSError as error:
            self._fail(disk_failure(self.path, error, kept=KEPT))
        except Exception as error:  # noqa: BLE001 - nobody would hear of it: the recording ends, and says why
            _log.exception("recording %s", self.path)
            self._fail(DeviceFault(f"recording {self.path}: {error}; {KEPT}; begin another one"))

    def _next(self) -> tuple[str, RawFrame] | TrackedBox | None:
        """Return what is to be written next; None when all is."""
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
            frame = compressed(frame) if self._options.compress else frame
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
        if in_time and self._as_meant:
            self._container.add_metadata(FINALIZE, {"durationSec": json.dumps(self._duration_s())})
        self._container.finish()

    def _duration_s(self) -> float:
        found = self.statistics.values()
        first = min((one.first_t_ns for one in found if one.first_t_ns is not None), default=0)
        last = max((one.last_t_ns for one in found if one.last_t_ns is not None), default=0)
        return (last - first) / 1e9

    def _fail(self, failure: FoveaError) -> None:
        """End early, with a file that can be read: whole if the disk has room for its end."""
        lost: list[tuple[str, int]] = []
        try:
            lost = self._container.recover()
        except OSError:
            self._let_go()
        with self._changed:
            for stream, size in lost:
                self._streams[stream] = self._streams[stream].with_taken_back(size)
            self._failure = failure
            self._lose_waiting(FrameLoss.DISK)

    def _let_go(self) -> None:
        try:
            self._container.give_up()
        except OSError:
            return  # the disk has failed already, and this was told

    def _lose_waiting(self, loss: FrameLoss) -> None:
        """Count everything that waits as lost; called with the lock held."""
        for item in self._ring:
            if not isinstance(item, TrackedBox):
                self._streams[item[0]] = self._streams[item[0]].with_lost(loss)
        self._ring.clear()
