"""The table of followed targets, shared by the threads of requests and the job that follows them."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from foveacam_hardware.contract import Busy
from foveacam_pipeline.track.follow import MOST_TARGETS
from foveacam_server.foundation.errors import NotFound
from foveacam_server.resources.looking.follows.followed import FollowedRecord


class FollowedRecords:
    """Followed targets in order of addition; callable from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._records: dict[str, FollowedRecord] = {}
        self._changed: set[str] = set()
        """Ids of targets whose tracker or priority was changed since `take_changes`."""

    def __bool__(self) -> bool:
        return bool(self._records)

    def add(self, record: FollowedRecord) -> None:
        """Add a target; raise `Busy` beyond `MOST_TARGETS`."""
        with self._lock:
            if len(self._records) >= MOST_TARGETS:
                raise Busy(
                    f"{MOST_TARGETS} targets are followed already",
                    found=f"{MOST_TARGETS} targets",
                    remedy="let one of them go: DELETE /api/v1/follows/{id}",
                )
            self._records[record.id] = record

    def remove(self, follow_id: str) -> FollowedRecord | None:
        """Remove a target and return it; None when there is none of that id."""
        with self._lock:
            self._changed.discard(follow_id)
            return self._records.pop(follow_id, None)

    @contextmanager
    def all(self) -> Iterator[dict[str, FollowedRecord]]:
        """Yield all targets by their ids, under the lock."""
        with self._lock:
            yield self._records

    @contextmanager
    def one(self, follow_id: str) -> Iterator[FollowedRecord]:
        """Yield one target under the lock, or raise `NotFound`."""
        with self._lock:
            record = self._records.get(follow_id)
            if record is None:
                raise NotFound(f"no target {follow_id} is followed", asked=f"followed target {follow_id}")
            yield record

    def change(self, follow_id: str, change: Callable[[FollowedRecord], None]) -> None:
        """Change how a target is followed, or raise `NotFound`; the job applies it at its next look."""
        with self.one(follow_id) as record:
            change(record)
            self._changed.add(follow_id)

    def take_changes(self) -> tuple[dict[str, FollowedRecord], set[str]]:
        """Return all targets, and the ids of those that were changed since the last call."""
        with self._lock:
            changed, self._changed = self._changed, set()
            return dict(self._records), changed
