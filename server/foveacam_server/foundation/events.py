"""The event log: passes events to listeners at once and to a `BatchedWriter`, and replays them by id.

`emit` never blocks and needs no database, so that a stop is reported even when the disk hangs.
"""

import asyncio
import threading
from collections import deque
from collections.abc import AsyncIterator, Callable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import anyio.to_thread
from pydantic import BaseModel
from sqlalchemy import delete, func, insert, select

from foveacam_server.foundation.batched_writer import BatchedWriter
from foveacam_server.foundation.names import utc_now
from foveacam_server.foundation.schema import EventDocument, ResponseModel, StorageFault
from foveacam_server.foundation.store import Document, EventRow, Store

RING = 2000
"""Number of events in memory; older ones are read from the table."""
KEPT = 20_000
"""Number of events in the table."""
PRUNE_EVERY = 1000
"""Number of events between two prunings of the table."""
BACKLOG = 500
"""Length of a listener's queue; a slower listener is disconnected (it reconnects with its last id)."""


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
        """Return REST's document of the event."""
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
    """Return a schema as a JSON object; of a response model, only the fields that were set."""
    return data.as_json() if isinstance(data, ResponseModel) else data.model_dump(mode="json")


class EventLog:
    """Holds the newest events in memory, passes events to listeners and writes them to the database."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._lock = threading.Lock()
        self._ring: deque[Event] = deque(maxlen=RING)
        self._listeners: set[_Listener] = set()
        self._callbacks: list[Callable[[Event], None]] = []
        with store.session() as session:
            self._next_id = (session.scalar(select(func.max(EventRow.id))) or 0) + 1
            rows = session.scalars(select(EventRow).order_by(EventRow.id.desc()).limit(RING)).all()
            self._ring.extend(_event(row) for row in reversed(rows))
        self._writer = BatchedWriter(
            "foveacam-events", save=self._save, on_fault=self._emit_fault, on_recovered=self._emit_recovered
        )

    @property
    def unwritten(self) -> int:
        """Number of events that will never be written."""
        return self._writer.unwritten

    @property
    def fault(self) -> str | None:
        """Reason of the last failure while events wait to be written; None when none wait."""
        return self._writer.fault

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
            self._writer.add(event)  # with the lock held: events are written in the order of their ids
        for callback in self._callbacks:
            callback(event)
        return event

    def on_event(self, callback: Callable[[Event], None]) -> None:
        """Call `callback` with every later event, in the thread that emits it; it must not block."""
        self._callbacks.append(callback)

    def recent(self, limit: int) -> list[Event]:
        """Return the newest events, oldest of them first."""
        with self._lock:
            return list(self._ring)[-limit:]

    def after(self, last_id: int) -> list[Event]:
        """Return the events after `last_id`, as far as they are stored."""
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
                await asyncio.sleep(0)  # lets the loop end a disconnected listener
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
        """End every listener, and write the events that wait."""
        self.end_listeners()
        self._writer.close()

    def _emit_fault(self, detail: str) -> None:
        remedy = "make room on it, or make it writable; what waits is kept and tried again by itself"
        self.emit(
            "storage.fault",
            f"the data directory {self._store.folder} takes no events: {detail}; {remedy}",
            level=EventLevel.ERROR,
            data=StorageFault(detail=detail, remedy=remedy),
        )

    def _emit_recovered(self) -> None:
        self.emit("storage.recovered", "events are written down again")

    def _save(self, events: Sequence[Event]) -> None:
        rows = [{"id": event.id, "kind": event.kind, "document": event.describe()} for event in events]
        with self._store.session() as session:
            # a failed attempt may have written them
            session.execute(insert(EventRow).prefix_with("OR IGNORE"), rows)
            if any(event.id % PRUNE_EVERY == 0 for event in events):
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
