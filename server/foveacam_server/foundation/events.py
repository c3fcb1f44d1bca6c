"""The event log: events go to listeners at once, to the database on a thread, and are replayed by id.

`emit` never blocks and needs no database, so that a stop is reported even when the disk hangs. Events that a
full disk does not take are held and written again until it does.
"""

import asyncio
import contextlib
import logging
import queue
import threading
from collections import deque
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass, field
from enum import StrEnum

import anyio.to_thread
from pydantic import BaseModel
from sqlalchemy import delete, func, insert, select
from sqlalchemy.exc import SQLAlchemyError

from foveacam_hardware.contract import FoveaError
from foveacam_server.foundation.names import utc_now
from foveacam_server.foundation.schema import EventDocument, ResponseModel, StorageFault
from foveacam_server.foundation.store import Document, EventRow, Store

_log = logging.getLogger(__name__)

RING = 2000
"""Number of events in memory; older ones are read from the table."""
KEPT = 20_000
"""Number of events in the table."""
UNWRITTEN = 5000
"""Most events that wait for a full disk; later ones go to listeners and are never written."""
BATCH = 200
"""Events written at once."""
RETRY_S = 0.5
"""Pause between two attempts to write."""
BACKLOG = 500
"""Events that may wait for a slow listener before it is disconnected (it reconnects with its last id)."""


class EventLevel(StrEnum):
    """Severity of an event for the operator."""

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
    data: Document = field(default_factory=dict)  # JSON: depends on the kind

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
        """Put an event into the queue, in the listener's loop; None or a full queue ends the listener."""
        if event is not None and not self.waiting.full():
            self.waiting.put_nowait(event)
            return
        while self.waiting.full():
            self.waiting.get_nowait()
        self.waiting.put_nowait(None)


def _json_of(data: BaseModel) -> Document:
    """Return a schema as a JSON object; of an answer, only the fields that were set."""
    return data.as_json() if isinstance(data, ResponseModel) else data.model_dump(mode="json")


class EventLog:
    """Holds the newest events in memory, passes events to listeners and writes them to the database."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._lock = threading.Lock()
        self._ring: deque[Event] = deque(maxlen=RING)
        self._listeners: set[_Listener] = set()
        self._callbacks: list[Callable[[Event], None]] = []
        self._to_write: queue.Queue[Event | None] = queue.Queue(maxsize=UNWRITTEN)
        self._closing = threading.Event()
        self.unwritten = 0
        """Number of events that will never be written."""
        self.fault: str | None = None
        """Why events wait to be written; None when none does."""
        with store.session() as session:
            self._next_id = (session.scalar(select(func.max(EventRow.id))) or 0) + 1
            rows = session.scalars(select(EventRow).order_by(EventRow.id.desc()).limit(RING)).all()
            self._ring.extend(_event(row) for row in reversed(rows))
        self._writer = threading.Thread(target=self._write, name="foveacam-events", daemon=True)
        self._writer.start()

    def emit(
        self,
        kind: str,
        message: str,
        *,
        level: EventLevel = EventLevel.INFO,
        data: BaseModel | None = None,
    ) -> Event:
        """Add an event and pass it to all listeners, from any thread, without waiting for them."""
        content = {} if data is None else _json_of(data)
        with self._lock:
            event = Event(
                id=self._next_id, kind=kind, level=level, t_utc=utc_now(), message=message, data=content
            )
            self._next_id += 1
            self._ring.append(event)
            for listener in self._listeners:
                _call_in_loop(listener, event)
        try:
            self._to_write.put_nowait(event)
        except queue.Full:
            self.unwritten += 1
        for callback in self._callbacks:
            callback(event)
        return event

    def on_event(self, callback: Callable[[Event], None]) -> None:
        """Call `callback` with every later event, in the thread that emits it; it must not wait."""
        self._callbacks.append(callback)

    def recent(self, limit: int) -> list[Event]:
        """Return the newest events, oldest of them first."""
        with self._lock:
            return list(self._ring)[-limit:]

    def after(self, last_id: int) -> list[Event]:
        """Return the events that followed `last_id`, as far as they are stored."""
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
        """Yield the events after `last_id` (None: no older ones), then every new event."""
        listener = _Listener(asyncio.get_running_loop(), asyncio.Queue(maxsize=BACKLOG))
        with self._lock:
            self._listeners.add(listener)
        try:
            seen = last_id or 0
            for event in [] if last_id is None else await anyio.to_thread.run_sync(self.after, last_id):
                seen = event.id
                yield event
                await asyncio.sleep(0)  # lets the loop end a listener that has left
            while (waited := await listener.waiting.get()) is not None:
                if waited.id > seen:
                    yield waited
        finally:
            with self._lock:
                self._listeners.discard(listener)

    def end_listeners(self) -> None:
        """End every listener; the server calls this when it shuts down."""
        with self._lock:
            for listener in self._listeners:
                _call_in_loop(listener, None)

    def close(self) -> None:
        """Write the events that wait, and end the thread."""
        self.end_listeners()
        self._closing.set()
        with contextlib.suppress(queue.Full):  # a full queue wakes the thread as well
            self._to_write.put_nowait(None)
        self._writer.join(timeout=5.0)

    def _write(self) -> None:
        written, batch = 0, list[Event]()
        while not (self._closing.is_set() and self._to_write.empty()):
            if not batch and (first := self._to_write.get()) is not None:
                batch.append(first)
            self._fill_batch(batch)
            prune = written // 1000 != (written + len(batch)) // 1000
            if self._try_save(batch, prune=prune):
                written += len(batch)
                batch.clear()
            elif self._closing.wait(RETRY_S):
                break
        self.unwritten += len(batch)

    def _fill_batch(self, batch: list[Event]) -> None:
        """Add the events that wait to `batch`, without waiting for more."""
        with contextlib.suppress(queue.Empty):
            while len(batch) < BATCH:
                event = self._to_write.get_nowait()
                if event is not None:
                    batch.append(event)

    def _try_save(self, events: list[Event], *, prune: bool) -> bool:
        """Write events; return whether they need not be written again."""
        try:
            self._save(events, prune=prune)
        except FoveaError as error:  # full, read-only, or locked: it may recover
            self._emit_fault(error.found or str(error))
            return False
        except SQLAlchemyError:
            self.unwritten += len(events)
            _log.exception("events %d and later were not written down", events[0].id if events else 0)
        if self.fault is not None:
            self.fault = None
            self.emit("storage.recovered", "events are written down again")
        return True

    def _emit_fault(self, detail: str) -> None:
        """Emit once that events cannot be written."""
        known, self.fault = self.fault is not None, detail
        if known:
            return
        remedy = "make room on it, or make it writable; what waits is kept and tried again by itself"
        self.emit(
            "storage.fault",
            f"the data directory {self._store.folder} takes no events: {detail}; {remedy}",
            level=EventLevel.ERROR,
            data=StorageFault(detail=detail, remedy=remedy),
        )

    def _save(self, events: list[Event], *, prune: bool) -> None:
        if not events:
            return
        rows = [{"id": event.id, "kind": event.kind, "document": event.describe()} for event in events]
        with self._store.session() as session:
            # an attempt that raised may have written them
            session.execute(insert(EventRow).prefix_with("OR IGNORE"), rows)
            if prune:
                session.execute(delete(EventRow).where(EventRow.id <= events[-1].id - KEPT))


def _call_in_loop(listener: _Listener, event: Event | None) -> None:
    if not listener.loop.is_closed():
        listener.loop.call_soon_threadsafe(listener.offer, event)


def _event(row: EventRow) -> Event:
    found = row.document
    return Event(
        id=row.id,
        kind=row.kind,
        level=EventLevel(found.level),
        t_utc=found.t_utc,
        message=found.message,
        data=found.data,
    )
