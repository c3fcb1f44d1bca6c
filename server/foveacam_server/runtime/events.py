"""The event log: told at once to whoever listens, written down behind their back, replayed by id.

`emit` never blocks and needs no database: a stop is told even when the disk hangs. What a full disk does not
take is kept and tried again until it does.
"""

import asyncio
import contextlib
import logging
import queue
import threading
from collections import deque
from collections.abc import AsyncIterator
from dataclasses import dataclass, field
from enum import StrEnum

from sqlalchemy import delete, func, insert, select
from sqlalchemy.exc import OperationalError, SQLAlchemyError

from foveacam_hardware.contract import DeviceFault, StorageFull
from foveacam_server.api.models import EventDocument
from foveacam_server.runtime.names import utc_now
from foveacam_server.runtime.store import Document, EventRow, Store

_log = logging.getLogger(__name__)

RING = 2000
"""Events kept in memory; older ones are read from the table."""
KEPT = 20_000
"""Events kept in the table."""
UNWRITTEN = 5000
"""Events that wait for a disk that takes none; later ones are told, and never written down."""
BATCH = 200
"""Events written down at once."""
RETRY_S = 0.5
"""Pause between two attempts on a disk that takes none."""
BACKLOG = 500
"""Events that a slow listener may be behind before it is cut off (it reconnects with its last id)."""


class EventLevel(StrEnum):
    """How much an event matters to the operator."""

    INFO = "info"
    WARNING = "warning"
    ERROR = "error"


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """One line of the log."""

    id: int
    kind: str
    level: EventLevel
    t_utc: str
    message: str
    data: Document = field(default_factory=dict)

    def describe(self) -> EventDocument:
        """Return the event as REST shows it."""
        return EventDocument(
            id=self.id,
            kind=self.kind,
            level=self.level.value,
            t_utc=self.t_utc,
            message=self.message,
            data=self.data,
        )


@dataclass(slots=True, eq=False)
class _Listener:
    loop: asyncio.AbstractEventLoop
    waiting: "asyncio.Queue[Event | None]"

    def offer(self, event: Event | None) -> None:
        """Hand over in the listener's own loop; None, or a full queue, ends it."""
        if event is not None and not self.waiting.full():
            self.waiting.put_nowait(event)
            return
        while self.waiting.full():
            self.waiting.get_nowait()
        self.waiting.put_nowait(None)


class EventLog:
    """Ring in memory, listeners in their loops, table on disk."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._lock = threading.Lock()
        self._ring: deque[Event] = deque(maxlen=RING)
        self._listeners: set[_Listener] = set()
        self._to_write: queue.Queue[Event | None] = queue.Queue(maxsize=UNWRITTEN)
        self._closing = threading.Event()
        self.unwritten = 0
        """Events that no disk will ever have."""
        self.fault: str | None = None
        """Why events wait to be written down, in words; None when none does."""
        with store.session() as session:
            self._next_id = (session.scalar(select(func.max(EventRow.id))) or 0) + 1
            rows = session.scalars(select(EventRow).order_by(EventRow.id.desc()).limit(RING)).all()
            self._ring.extend(_event(row) for row in reversed(rows))
        self._writer = threading.Thread(target=self._write, name="foveacam-events", daemon=True)
        self._writer.start()

    def emit(
        self, kind: str, message: str, *, level: EventLevel = EventLevel.INFO, data: Document | None = None
    ) -> Event:
        """Tell everybody, from any thread, without waiting for any of them."""
        with self._lock:
            event = Event(
                id=self._next_id, kind=kind, level=level, t_utc=utc_now(), message=message, data=data or {}
            )
            self._next_id += 1
            self._ring.append(event)
            for listener in self._listeners:
                _call_in_loop(listener, event)
        try:
            self._to_write.put_nowait(event)
        except queue.Full:
            self.unwritten += 1
        return event

    def recent(self, limit: int) -> list[Event]:
        """Return the newest events, oldest of them first."""
        with self._lock:
            return list(self._ring)[-limit:]

    def after(self, last_id: int) -> list[Event]:
        """Return the events that followed `last_id`, as far back as they are kept."""
        with self._lock:
            ring = list(self._ring)
        oldest = ring[0].id if ring else self._next_id
        older: list[Event] = []
        if last_id + 1 < oldest:
            with self._store.session() as session:
                query = (
                    select(EventRow).where(EventRow.id > last_id, EventRow.id < oldest).order_by(EventRow.id)
                )
                older = [_event(row) for row in session.scalars(query)]
        return older + [event for event in ring if event.id > last_id]

    async def listen(self, last_id: int | None = None) -> AsyncIterator[Event]:
        """Yield what followed `last_id` (None: nothing older), then every event as it comes."""
        listener = _Listener(asyncio.get_running_loop(), asyncio.Queue(maxsize=BACKLOG))
        with self._lock:
            self._listeners.add(listener)
        try:
            seen = last_id or 0
            for event in [] if last_id is None else await asyncio.to_thread(self.after, last_id):
                seen = event.id
                yield event
                await asyncio.sleep(0)  # in one turn of the loop, all would go to a listener that left, too
            while (waited := await listener.waiting.get()) is not None:
                if waited.id > seen:
                    yield waited
        finally:
            with self._lock:
                self._listeners.discard(listener)

    def hang_up(self) -> None:
        """End every listener; the server calls this when it shuts down."""
        with self._lock:
            for listener in self._listeners:
                _call_in_loop(listener, None)

    def close(self) -> None:
        """Write down what is left and stop."""
        self.hang_up()
        self._closing.set()
        with contextlib.suppress(queue.Full):  # then there is something to wake up for
            self._to_write.put_nowait(None)
        self._writer.join(timeout=5.0)

    def _write(self) -> None:
        written, batch = 0, list[Event]()
        while not (self._closing.is_set() and self._to_write.empty()):
            if not batch and (first := self._to_write.get()) is not None:
                batch.append(first)
            self._top_up(batch)
            prune = written // 1000 != (written + len(batch)) // 1000
            if self._saved(batch, prune=prune):
                written += len(batch)
                batch.clear()
            elif self._closing.wait(RETRY_S):
                break
        self.unwritten += len(batch)

    def _top_up(self, batch: list[Event]) -> None:
        """Take what waits, without waiting for more."""
        with contextlib.suppress(queue.Empty):
            while len(batch) < BATCH:
                event = self._to_write.get_nowait()
                if event is not None:
                    batch.append(event)

    def _saved(self, events: list[Event], *, prune: bool) -> bool:
        """Write them down; tell whether they are off one's hands."""
        try:
            self._save(events, prune=prune)
        except (StorageFull, DeviceFault) as error:  # full, read-only: it may pass
            self._tell_fault(error.found or str(error))
            return False
        except OperationalError as error:  # locked: so may that
            self._tell_fault(str(error.orig))
            return False
        except SQLAlchemyError:
            self.unwritten += len(events)
            _log.exception("events %d and later were not written down", events[0].id if events else 0)
        if self.fault is not None:
            self.fault = None
            self.emit("storage.recovered", "events are written down again")
        return True

    def _tell_fault(self, detail: str) -> None:
        """Tell once that the disk takes nothing."""
        known, self.fault = self.fault is not None, detail
        if known:
            return
        remedy = "make room on it, or make it writable; what waits is kept and tried again by itself"
        self.emit(
            "storage.fault",
            f"the data directory {self._store.folder} takes no events: {detail}; {remedy}",
            level=EventLevel.ERROR,
            data={"detail": detail, "remedy": remedy},
        )

    def _save(self, events: list[Event], *, prune: bool) -> None:
        if not events:
            return
        rows = [
            {"id": event.id, "kind": event.kind, "document": event.describe().as_json()} for event in events
        ]
        with self._store.session() as session:
            # an attempt that seemed to fail may have written them
            session.execute(insert(EventRow).prefix_with("OR IGNORE"), rows)
            if prune:
                session.execute(delete(EventRow).where(EventRow.id <= events[-1].id - KEPT))


def _call_in_loop(listener: _Listener, event: Event | None) -> None:
    if not listener.loop.is_closed():
        listener.loop.call_soon_threadsafe(listener.offer, event)


def _event(row: EventRow) -> Event:
    stored = EventDocument.model_validate(row.document)
    return Event(
        id=row.id,
        kind=row.kind,
        level=EventLevel(stored.level),
        t_utc=stored.t_utc,
        message=stored.message,
        data=stored.data,
    )
