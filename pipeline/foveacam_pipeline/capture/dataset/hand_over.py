"""Points on their way from the rig to the disk: a bounded queue, and a thread that empties it."""

import logging
import threading
import time
from collections import deque
from collections.abc import Callable

from foveacam_hardware.contract import FoveaError
from foveacam_pipeline.capture.dataset.values import Point

logger = logging.getLogger(__name__)


class HandOver:
    """Calls `keep(point)` for every point handed over, in order, on a thread of its own.

    At most `depth` points wait. The first error of `keep` ends it: it comes back from every call thereafter.
    """

    def __init__(self, keep: Callable[[Point], None], *, depth: int) -> None:
        self._keep = keep
        self._depth = depth
        self._points: deque[Point] = deque()
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

    def put(self, point: Point) -> None:
        """Hand a point over; wait while the queue is full. Raise what `keep` raised."""
        started_s = time.monotonic()
        with self._changed:
            self._changed.wait_for(lambda: self._error is not None or len(self._points) < self._depth)
            self.waited_s += time.monotonic() - started_s
            self._raise_error()
            self._points.append(point)
            self._changed.notify_all()

    def flush(self) -> None:
        """Wait until everything handed over is kept. Raise what `keep` raised."""
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
        while (point := self._next()) is not None:
            error: FoveaError | None = None
            try:
                self._keep(point)
            except FoveaError as refused:
                error = refused
            except Exception as unforeseen:
                logger.exception("point %d was not kept", point.place.index)
                error = FoveaError(
                    f"point {point.place.index} was not kept: {unforeseen}; resume the dataset"
                )
            del point
            with self._changed:
                self._busy = False
                self._error = error
                if error is not None:
                    self._points.clear()
                self._changed.notify_all()
            if error is not None:
                return

    def _next(self) -> Point | None:
        with self._changed:
            self._changed.wait_for(lambda: self._closing or bool(self._points))
            if not self._points:
                return None
            self._busy = True
            point = self._points.popleft()
            self._changed.notify_all()
            return point
