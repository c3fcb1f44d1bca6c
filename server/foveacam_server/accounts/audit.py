"""The audit log: who changed what, when, from where, and how it ended; written on a thread of its own.

The same request of the same principal within `MERGE_S` is one entry that counts them: a joystick sends thirty
a second. What nobody in particular was refused is merged by address, so that a flood cannot fill the disk.
"""

import json
import logging
import queue
import threading
from collections.abc import Iterator
from dataclasses import dataclass, replace

from sqlalchemy import delete, func, insert, or_, select, update
from sqlalchemy.exc import SQLAlchemyError

from foveacam_hardware.contract import FoveaError
from foveacam_server.accounts.rights import Principal, PrincipalKind
from foveacam_server.accounts.tables import AuditRow
from foveacam_server.foundation.names import age_s, utc_now
from foveacam_server.foundation.store import Store

_log = logging.getLogger(__name__)

KEPT = 200_000
"""Number of entries in the table; the oldest go first."""
MERGE_S = 10.0
WAITING = 5000
"""Most entries that wait to be written."""
_BATCH = 200
_PAGE = 500
_PATH_CHARS = 300
_MOST_OPEN = 256


@dataclass(frozen=True, slots=True, kw_only=True)
class AuditEntry:
    """A change that somebody made or tried."""

    id: int
    utc: str
    who: str
    kind: str
    method: str
    path: str
    what: str
    address: str
    status: int
    outcome: str
    """`done`, `refused` or `failed`."""
    repeated: int
    detail: str = ""

    def as_line(self) -> str:
        """Return it as one line of JSON."""
        return json.dumps(_columns(self), ensure_ascii=False) + "\n"


@dataclass(slots=True)
class AuditNote:
    """What a route adds to the entry of its request; in the scope as `audit_note`."""

    who: Principal | None = None
    """Who it turned out to be, in a request by which somebody signs in."""
    detail: str = ""


def outcome_of(status: int) -> str:
    """Return how a request with this status ended."""
    if status in (401, 403, 429):
        return "refused"
    return "failed" if status >= 400 else "done"


class AuditLog:
    """Takes entries from any thread without waiting for the disk, and reads them back."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._waiting: queue.Queue[AuditEntry | None] = queue.Queue(maxsize=WAITING)
        self.unwritten = 0
        """Entries that will never be written: the disk took none for too long."""
        with store.session() as session:
            self._last_id = session.scalar(select(func.max(AuditRow.id))) or 0
        self._open: dict[tuple[str, ...], AuditEntry] = {}
        self._writer = threading.Thread(target=self._write, name="foveacam-audit", daemon=True)
        self._writer.start()

    def add(
        self,
        principal: Principal,
        *,
        method: str,
        path: str,
        address: str,
        status: int,
        what: str = "",
        detail: str = "",
    ) -> None:
        """Take an entry."""
        anybody = principal.kind is PrincipalKind.NOBODY
        entry = AuditEntry(
            id=0,
            utc=utc_now(),
            who=principal.name,
            kind=principal.kind.value,
            method=method,
            path="/…" if anybody and not detail else path[:_PATH_CHARS],
            what=what,
            address=address,
            status=status,
            outcome=outcome_of(status),
            repeated=1,
            detail=detail,
        )
        try:
            self._waiting.put_nowait(entry)
        except queue.Full:
            self.unwritten += 1

    def close(self) -> None:
        """Write what waits, then end."""
        self._waiting.put(None)
        self._writer.join(timeout=10.0)

    def flush(self) -> None:
        """Return when what was taken so far is written."""
        self._waiting.join()

    def read(
        self,
        *,
        text: str = "",
        who: str = "",
        outcome: str = "",
        before: int | None = None,
        limit: int = 100,
    ) -> list[AuditEntry]:
        """Return the newest entries that fit, newest first; `text`: a part of path, what or detail."""
        query = select(AuditRow).order_by(AuditRow.id.desc()).limit(limit)
        if text:
            columns = (AuditRow.path, AuditRow.what, AuditRow.detail, AuditRow.address)
            query = query.where(or_(*(column.icontains(text, autoescape=True) for column in columns)))
        if who:
            query = query.where(AuditRow.who == who)
        if outcome:
            query = query.where(AuditRow.outcome == outcome)
        if before is not None:
            query = query.where(AuditRow.id < before)
        with self._store.session() as session:
            return [_entry(row) for row in session.scalars(query)]

    def lines(self) -> Iterator[str]:
        """Yield every entry as a line of JSON, oldest first."""
        last = 0
        while True:
            query = select(AuditRow).where(AuditRow.id > last).order_by(AuditRow.id).limit(_PAGE)
            with self._store.session() as session:
                entries = [_entry(row) for row in session.scalars(query)]
            if not entries:
                return
            yield from (entry.as_line() for entry in entries)
            last = entries[-1].id

    def _write(self) -> None:
        ended = False
        while not ended:
            batch = [self._waiting.get()]
            while len(batch) < _BATCH and not self._waiting.empty():
                batch.append(self._waiting.get_nowait())
            ended = None in batch
            try:
                self._store_entries([entry for entry in batch if entry is not None])
            except (FoveaError, SQLAlchemyError) as error:
                self.unwritten += len(batch)
                _log.warning("the audit log was not written: %s", error)
            for _ in batch:
                self._waiting.task_done()

    def _store_entries(self, entries: list[AuditEntry]) -> None:
        new: dict[int, AuditEntry] = {}
        changed: dict[int, AuditEntry] = {}
        for entry in entries:
            key = _key(entry)
            before = self._open.get(key)
            if before is not None and age_s(before.utc) < MERGE_S:
                merged = replace(before, repeated=before.repeated + 1)
                (new if before.id in new else changed)[before.id] = merged
            else:
                self._last_id += 1
                merged = new[self._last_id] = replace(entry, id=self._last_id)
            self._open[key] = merged
        while len(self._open) > _MOST_OPEN:
            self._open.pop(next(iter(self._open)))
        with self._store.session() as session:
            for entry in new.values():
                session.execute(insert(AuditRow).values(**_columns(entry)))
            for number, entry in changed.items():
                session.execute(update(AuditRow).where(AuditRow.id == number).values(repeated=entry.repeated))
            if new:
                session.execute(delete(AuditRow).where(AuditRow.id <= self._last_id - KEPT))


def _key(entry: AuditEntry) -> tuple[str, ...]:
    """Return what entries that are merged have in common."""
    return (
        entry.who, entry.kind, entry.method, entry.path, entry.address, str(entry.status), entry.detail
    )  # fmt: skip


def _columns(entry: AuditEntry) -> dict[str, str | int]:
    return {name: getattr(entry, name) for name in entry.__slots__}


def _entry(row: AuditRow) -> AuditEntry:
    return AuditEntry(**{name: getattr(row, name) for name in AuditEntry.__slots__})
