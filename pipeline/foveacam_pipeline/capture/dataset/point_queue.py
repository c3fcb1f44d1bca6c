"""Points on their way from the rig to the disk: a bounded queue, and a thread that empties it."""

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
    """Where points go: `begin` returns at once, `keep` when the point is on the disk."""

    def begin(self, point: CapturedPoint) -> BegunPoint:
        """Start on a point."""

    def keep(self, begun: BegunPoint) -> None:
        """Finish it; raise FoveaError when that cannot be."""

    def drop(self, begun: BegunPoint) -> None:
        """Give it up."""


class PointQueue:
    """Keeps every point handed over, in order, on a thread of its own.

    At most `depth` points wait, begun already. The first error ends it: those that wait are dropped, and the
    error comes back from every call thereafter.
    """

    def __init__(self, keeper: PointSink, *, depth: int) -> None:
        self._keeper = keeper
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
        """How many points are not on the disk yet."""
        with self._changed:
            return len(self._points) + self._busy

    def put(self, point: CapturedPoint) -> None:
        """Hand a point over; wait while the queue is full. Raise what ended it."""
        started_s = time.monotonic()
        with self._changed:
            self._changed.wait_for(lambda: self._error is not None or len(self._points) < self._depth)
            self.waited_s += time.monotonic() - started_s
            self._raise_error()
            self._points.append(self._keeper.begin(point))
            self._changed.notify_all()

    def check(self) -> None:
        """Raise what ended it."""
        with self._changed:
            self._raise_error()

    def flush(self) -> None:
        """Wait until everything handed over is kept. Raise what ended it."""
        with self._changed:
            self._changed.wait_for(lambda: self._error is not None or not (self._points or self._busy))
            self._raise_error()

    def close(self) -> None:
        """Keep what was handed over, then end the thread; an error is not raised again."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join()

    def _raise_error(self) -> None:
        if self._error is not None:
            raise self._error

    def _run(self) -> None:
        while (begun := self._next()) is not None:
            error = self._kept(begun)
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
                    self._keeper.drop(each)
                return

    def _kept(self, begun: BegunPoint) -> FoveaError | None:
        index = begun.place.index
        try:
            self._keeper.keep(begun)
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
