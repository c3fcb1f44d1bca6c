"""The audit log: who changed what, when, from where, and how it ended; written by a `BatchedWriter`.

The same request of the same principal within `MERGE_S` is one entry that counts them: a joystick sends thirty
a second. Refused requests without a principal are merged by address, so that a flood cannot fill the disk.
"""

import json
import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from sqlalchemy import delete, func, insert, or_, select

from foveacam_server.accounts.rights import Principal, PrincipalKind
from foveacam_server.accounts.tables import AuditRow
from foveacam_server.foundation.batched_writer import BatchedWriter
from foveacam_server.foundation.names import seconds_between, utc_now
from foveacam_server.foundation.store import Store

_log = logging.getLogger(__name__)

KEPT = 200_000
"""Number of entries in the table; the oldest go first."""
MERGE_S = 10.0
FLUSH_S = 10.0
_PAGE = 500
_PATH_CHARS = 300
_MOST_OPEN = 256


@dataclass(frozen=True, slots=True, kw_only=True)
class AuditEntry:
    """An entry: a change that was made or attempted."""

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
    """Details that a route adds to the entry of its request; in the scope as `audit_note`."""

    who: Principal | None = None
    """The authenticated principal, in a request that signs in."""
    detail: str = ""


def outcome_of(status: int) -> str:
    """Return the outcome of a request by its HTTP status."""
    if status in (401, 403, 429):
        return "refused"
    return "failed" if status >= 400 else "done"


class AuditLog:
    """Records entries from any thread without waiting for the disk, and reads them back."""

    def __init__(self, store: Store) -> None:
        self._store = store
        with store.session() as session:
            self._last_id = session.scalar(select(func.max(AuditRow.id))) or 0
        self._open: dict[tuple[str, ...], AuditEntry] = {}
        self._writer = BatchedWriter("foveacam-audit", save=self._save, on_fault=_log_fault)

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
        """Record an entry."""
        anonymous = principal.kind is PrincipalKind.ANONYMOUS
        entry = AuditEntry(
            id=0,  # `_save` assigns it, or merges the entry
            utc=utc_now(),
            who=principal.name,
            kind=principal.kind.value,
            method=method,
            path="/…" if anonymous and not detail else path[:_PATH_CHARS],
            what=what,
            address=address,
            status=status,
            outcome=outcome_of(status),
            repeated=1,
            detail=detail,
        )
        self._writer.add(entry)

    def close(self) -> None:
        """Write queued entries, then end."""
        self._writer.close()

    def flush(self) -> bool:
        """Wait for the entries recorded so far; return whether they were written."""
        return self._writer.flush(timeout_s=FLUSH_S)

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

    def _save(self, entries: Sequence[AuditEntry]) -> None:
        """Write entries, merged with earlier ones; idempotent, so that a retry gives the same rows."""
        last_id, merged_by_key = self._last_id, dict(self._open)
        rows: dict[int, AuditEntry] = {}
        for entry in entries:
            key = _key(entry)
            before = merged_by_key.get(key)
            if before is not None and seconds_between(before.utc, entry.utc) < MERGE_S:
                merged = replace(before, repeated=before.repeated + 1)
            else:
                last_id += 1
                merged = replace(entry, id=last_id)
            rows[merged.id] = merged_by_key[key] = merged
        with self._store.session() as session:
            session.execute(
                insert(AuditRow).prefix_with("OR REPLACE"), [_columns(row) for row in rows.values()]
            )
            session.execute(delete(AuditRow).where(AuditRow.id <= last_id - KEPT))
        self._last_id, self._open = last_id, dict(list(merged_by_key.items())[-_MOST_OPEN:])


def _log_fault(detail: str) -> None:
    _log.warning("the audit log is not written until the disk takes it: %s", detail)


def _key(entry: AuditEntry) -> tuple[str, ...]:
    """Return the key by which entries are merged."""
    return (
        entry.who, entry.kind, entry.method, entry.path, entry.address, str(entry.status), entry.detail
    )  # fmt: skip


def _columns(entry: AuditEntry) -> dict[str, str | int]:
    return {name: getattr(entry, name) for name in entry.__slots__}


def _entry(row: AuditRow) -> AuditEntry:
    return AuditEntry(**{name: getattr(row, name) for name in AuditEntry.__slots__})
