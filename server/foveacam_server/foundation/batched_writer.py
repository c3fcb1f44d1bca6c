"""Writes records on a separate thread, in batches and in the order of arrival.

Adding a record never blocks. Records that a full or locked disk refuses are kept and retried; a record is
lost only when the queue is full, when the database refuses it for good, or at the end of the program.
"""

import logging
import threading
from collections import deque
from collections.abc import Callable, Sequence
from itertools import islice
from typing import Generic, TypeVar

from sqlalchemy.exc import SQLAlchemyError

from foveacam_hardware.contract import FoveaError

_log = logging.getLogger(__name__)

MOST_WAITING = 5000
"""Length of the queue, including the batch under way; records beyond it are never written."""
BATCH = 200
"""Largest batch."""
RETRY_S = 0.5
"""Pause between two attempts to write."""
CLOSE_S = 10.0
"""Timeout of writing the last records at the end: twice SQLite's timeout for a locked database."""

RecordT = TypeVar("RecordT")


class BatchedWriter(Generic[RecordT]):
    """Passes records to `save` in batches, with retries.

    `save` raises `FoveaError` for a failure worth a retry, and must be idempotent: an attempt that raised may
    have succeeded. `on_fault` gets the reason of the first failure, `on_recovered` is called after the first
    success that follows; both are called on the writer's thread.
    """

    def __init__(
        self,
        name: str,
        *,
        save: Callable[[Sequence[RecordT]], None],
        on_fault: Callable[[str], None],
        on_recovered: Callable[[], None] = lambda: None,
    ) -> None:
        self._save, self._on_fault, self._on_recovered = save, on_fault, on_recovered
        self._changed = threading.Condition()
        self._waiting: deque[RecordT] = deque()
        self._added = self._settled = 0
        self._closed = False
        self.unwritten = 0
        """Number of records that will never be written."""
        self.fault: str | None = None
        """Reason of the last failure while records wait to be written; None when none wait."""
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def add(self, record: RecordT) -> None:
        """Add a record, from any thread, without waiting for the disk."""
        with self._changed:
            if self._closed or len(self._waiting) >= MOST_WAITING:
                self.unwritten += 1
                return
            self._waiting.append(record)
            self._added += 1
            self._changed.notify_all()

    def flush(self, *, timeout_s: float) -> bool:
        """Wait for the records added so far; return whether none of them is still queued."""
        with self._changed:
            added = self._added
            return self._changed.wait_for(lambda: self._settled >= added, timeout_s)

    def close(self) -> None:
        """Write the queued records, with a single attempt where the disk refuses them, and end the thread."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self._thread.join(timeout=CLOSE_S)

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._closed or self._waiting)
                batch, closed = list(islice(self._waiting, BATCH)), self._closed
            if not batch:
                return
            if self._try_save(batch):
                self._settle(len(batch))
            elif closed:
                lost = self._settle(len(self._waiting))
                self.unwritten += lost
                _log.warning("%s: %d records were never written: %s", self._thread.name, lost, self.fault)
                return
            else:
                with self._changed:
                    self._changed.wait_for(lambda: self._closed, RETRY_S)

    def _try_save(self, batch: Sequence[RecordT]) -> bool:
        """Write a batch; return whether it is done: written, or refused for good."""
        try:
            self._save(batch)
        except FoveaError as error:  # full, read-only or locked disk: may recover
            detail = error.found or str(error)
            known, self.fault = self.fault is not None, detail
            if not known:
                self._on_fault(detail)
            return False
        except SQLAlchemyError:  # the records themselves were refused
            self.unwritten += len(batch)
            _log.exception("%s: %d records were not written", self._thread.name, len(batch))
        if self.fault is not None:
            self.fault = None
            self._on_recovered()
        return True

    def _settle(self, count: int) -> int:
        """Remove the oldest `count` queued records, which are written or lost; return `count`."""
        with self._changed:
            for _ in range(count):
                self._waiting.popleft()
            self._settled += count
            self._changed.notify_all()
        return count
