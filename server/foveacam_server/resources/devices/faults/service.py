"""Lists the faults of the running server, counted by place, until they are dismissed.

They are derived from new events of the log; a restart begins with none.
"""

import threading
from dataclasses import dataclass
from typing import Literal

from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.events import Event, EventLevel, EventLog
from foveacam_server.foundation.names import new_id
from foveacam_server.resources.devices.faults.rules import FaultNews, FaultPlace, news_of
from foveacam_server.resources.devices.faults.schema import FaultDocument, FaultsDismissed

MOST = 50
"""Largest number of faults on the list; beyond it, the last ones that are over are dropped first."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Key:
    """Key of a row: lasting faults count together by place, others by place and words."""

    place: FaultPlace
    what: str | None


@dataclass(slots=True, kw_only=True)
class _Row:
    id: str
    place: FaultPlace
    level: Literal["warning", "error"]
    what: str
    remedy: str | None
    first_utc: str
    last_utc: str
    last_event: int
    over_utc: str | None
    count: int = 1

    @property
    def order(self) -> tuple[bool, int]:
        """Sort key: errors first, then newest first."""
        return (self.level != "error", -self.last_event)

    def describe(self) -> FaultDocument:
        """Return the document of the row."""
        return FaultDocument(
            id=self.id,
            level=self.level,
            scope=self.place.scope,
            name=self.place.name,
            what=self.what,
            remedy=self.remedy,
            first_utc=self.first_utc,
            last_utc=self.last_utc,
            count=self.count,
            present=self.over_utc is None,
            over_utc=self.over_utc,
        )


class FaultService:
    """The list of faults; callable from any thread."""

    def __init__(self, events: EventLog) -> None:
        self._events = events
        self._lock = threading.Lock()
        self._rows: dict[_Key, _Row] = {}
        events.on_event(self._handle_event)

    def describe(self) -> list[FaultDocument]:
        """Return all faults, errors first, the newest first within."""
        with self._lock:
            return [row.describe() for row in self._ordered()]

    def dismiss(self, fault_id: str) -> None:
        """Remove a fault from the list or raise `NotFound`."""
        with self._lock:
            keys = [key for key, row in self._rows.items() if row.id == fault_id]
            for key in keys:
                del self._rows[key]
        if not keys:
            raise NotFound(
                f"there is no fault {fault_id} on the list",
                asked=f"dismiss {fault_id}",
                found="no such fault",
                remedy="GET /api/v1/faults lists them",
            )
        self._emit_dismissed([fault_id])

    def dismiss_over(self) -> FaultsDismissed:
        """Remove all faults that are over from the list."""
        with self._lock:
            over = {key: row.id for key, row in self._rows.items() if row.over_utc is not None}
            for key in over:
                del self._rows[key]
        ids = list(over.values())
        if ids:
            self._emit_dismissed(ids)
        return FaultsDismissed(ids=ids)

    def _handle_event(self, event: Event) -> None:
        news = news_of(event)
        if news is None:
            return
        with self._lock:
            row = self._end(news, event) if news.what is None else self._add(news, event, news.what)
            changed = None if row is None else row.describe()
        if changed is not None:
            state = "is present" if changed.present else "is over"
            message = f"{changed.scope} {changed.name}: {changed.level} {state}: {changed.what}"
            self._events.emit("fault.changed", message, data=changed)

    def _end(self, news: FaultNews, event: Event) -> _Row | None:
        row = self._rows.get(_Key(place=news.place, what=None))
        if row is None or row.over_utc is not None:
            return None
        row.over_utc = event.t_utc
        return row

    def _add(self, news: FaultNews, event: Event, what: str) -> _Row:
        key = _Key(place=news.place, what=None if news.lasting else what)
        known = self._rows.get(key)
        row = self._rows[key] = _Row(
            id=new_id("fault") if known is None else known.id,
            place=news.place,
            level="error" if event.level is EventLevel.ERROR else "warning",
            what=what,
            remedy=news.remedy,
            first_utc=event.t_utc if known is None else known.first_utc,
            last_utc=event.t_utc,
            last_event=event.id,
            over_utc=None if news.lasting else event.t_utc,
            count=1 if known is None else known.count + 1,
        )
        self._drop_beyond_limit()
        return row

    def _drop_beyond_limit(self) -> None:
        while len(self._rows) > MOST:
            ordered = self._ordered()
            last = next((row for row in reversed(ordered) if row.over_utc is not None), ordered[-1])
            self._rows = {key: row for key, row in self._rows.items() if row is not last}

    def _ordered(self) -> list[_Row]:
        return sorted(self._rows.values(), key=lambda row: row.order)

    def _emit_dismissed(self, ids: list[str]) -> None:
        words = "a fault was dismissed" if len(ids) == 1 else f"{len(ids)} faults were dismissed"
        self._events.emit("fault.dismissed", words, data=FaultsDismissed(ids=ids))
