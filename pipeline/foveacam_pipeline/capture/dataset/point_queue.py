"""A bounded queue of points that wait to be written to disk, and the thread that empties it."""

import logging
import threading
import time
from collections import deque
from typing import Protocol

from foveacam_hardware.contract import FoveaError
from foveacam_pipeline.capture.dataset.point_store import BegunPoint
from foveacam_pipeline.capture.dataset.values import CapturedPoint

logger = logging.getLogger(__name__)


class PointSink(Protocol):
    """Writes points: `begin` starts and returns at once, `commit` returns when the point is on disk."""

    def begin(self, point: CapturedPoint) -> BegunPoint:
        """Start to write a point."""

    def commit(self, begun: BegunPoint) -> None:
        """Finish writing a point; raise FoveaError when that fails."""

    def drop(self, begun: BegunPoint) -> None:
        """Discard a point that was begun."""


class PointQueue:
    """Commits every queued point, in order, on its own thread.

    At most `depth` points wait, already begun. The first error ends the queue: waiting points are dropped,
    and every later call raises that error.
    """

    def __init__(self, sink: PointSink, *, depth: int) -> None:
        self._sink = sink
        self._depth = depth
        self._points: deque[BegunPoint] = deque()
        self._changed = threading.Condition()
        self._busy = False
        self._closing = False
        self._error: FoveaError | None = None
        self.waited_s = 0.0
        self._thread = threading.Thread(target=self._run, name="dataset-writer", daemon=True)
        self._thread.start()

    @property
    def queued(self) -> int:
        """Number of points that are not on disk yet."""
        with self._changed:
            return len(self._points) + self._busy

    def put(self, point: CapturedPoint) -> None:
        """Add a point; wait while the queue is full. Raise the error that ended the queue."""
        started_s = time.monotonic()
        with self._changed:
            self._changed.wait_for(lambda: self._error is not None or len(self._points) < self._depth)
            self.waited_s += time.monotonic() - started_s
            self._raise_error()
            self._points.append(self._sink.begin(point))
            self._changed.notify_all()

    def check(self) -> None:
        """Raise the error that ended the queue, if there is one."""
        with self._changed:
            self._raise_error()

    def flush(self) -> None:
        """Wait until every queued point is on disk. Raise the error that ended the queue."""
        with self._changed:
            self._changed.wait_for(lambda: self._error is not None or not (self._points or self._busy))
            self._raise_error()

    def close(self) -> None:
        """Write what is queued, then end the thread; raises nothing, even after an error."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join()

    def _raise_error(self) -> None:
        if self._error is not None:
            raise self._error

    def _run(self) -> None:
        while (begun := self._next()) is not None:
            error = self._commit(begun)
            del begun
            with self._changed:
                self._busy = False
                self._error = error
                left = list(self._points) if error is not None else []
                if error is not None:
                    self._points.clear()
                self._changed.notify_all()
            if error is not None:
                for each in left:
                    self._sink.drop(each)
                return

    def _commit(self, begun: BegunPoint) -> FoveaError | None:
        index = begun.place.index
        try:
            self._sink.commit(begun)
        except FoveaError as refused:
            return refused
        except Exception as unforeseen:
            logger.exception("point %d was not kept", index)
            return FoveaError(f"point {index} was not kept: {unforeseen}; resume the dataset")
        return None

    def _next(self) -> BegunPoint | None:
        with self._changed:
            self._changed.wait_for(lambda: self._closing or bool(self._points))
            if not self._points:
                return None
            self._busy = True
            begun = self._points.popleft()
            self._changed.notify_all()
            return begun
