"""The control lease: while a client holds and renews it, only that client may move the rig."""

import secrets
import threading
from dataclasses import dataclass

from foveacam_hardware.contract import Busy, Clock
from foveacam_server.foundation.events import EventLevel, EventLog
from foveacam_server.foundation.schema import LeaseChange, LeaseDocument, LeaseGrant

LIFETIME_S = 15.0
"""How long a lease lasts after it was taken or renewed."""


@dataclass(slots=True, kw_only=True)
class _Held:
    token: str
    holder: str
    expires_ns: int


class Lease:
    """One holder at a time, who must renew it; in memory, so that a restart frees it."""

    def __init__(self, *, clock: Clock, events: EventLog) -> None:
        self._clock = clock
        self._events = events
        self._lock = threading.Lock()
        self._held: _Held | None = None

    def describe(self) -> LeaseDocument:
        """Return who holds the lease now, and how long it lasts unless it is renewed."""
        with self._lock:
            held = self._current()
            return LeaseDocument(
                holder=held.holder if held else None, expires_in_s=self._left_s(held) if held else None
            )

    def take(self, holder: str, *, take_over: bool) -> LeaseGrant:
        """Give the lease to `holder`; from another holder only with `take_over`; emit an event."""
        with self._lock:
            before = self._current()
            if before is not None and not take_over:
                raise _held_by(before.holder, "take the lease")
            self._held = _Held(
                token=secrets.token_urlsafe(16),
                holder=holder,
                expires_ns=self._clock.now_ns() + round(LIFETIME_S * 1e9),
            )
            granted = self._grant(self._held)
        if before is not None:
            message, level = f"{holder} took the control lease over from {before.holder}", EventLevel.WARNING
        else:
            message, level = f"{holder} holds the control lease", EventLevel.INFO
        self._events.emit(
            "lease.changed",
            message,
            level=level,
            data=LeaseChange(holder=holder, before=before.holder if before else None),
        )
        return granted

    def renew(self, token: str | None) -> LeaseGrant:
        """Renew the lease that `token` belongs to."""
        with self._lock:
            held = self._require(token, "keep the lease")
            held.expires_ns = self._clock.now_ns() + round(LIFETIME_S * 1e9)
            return self._grant(held)

    def release(self, token: str | None) -> None:
        """Give the lease back."""
        with self._lock:
            held = self._require(token, "give the lease back")
            self._held = None
        self._events.emit(
            "lease.changed",
            f"{held.holder} gave the control lease back",
            data=LeaseChange(holder=None, before=held.holder),
        )

    def check(self, token: str | None) -> None:
        """Raise `Busy`, naming the holder, when somebody else holds the lease."""
        with self._lock:
            held = self._current()
            if held is not None and not _same(token, held.token):
                raise _held_by(held.holder, "move the mirrors")

    def require(self, token: str | None, *, asked: str) -> None:
        """Raise `Busy` unless `token` is that of the present lease; a lease that nobody holds is refused."""
        with self._lock:
            self._require(token, asked)

    def _current(self) -> _Held | None:
        if self._held is not None and self._held.expires_ns <= self._clock.now_ns():
            self._held = None
        return self._held

    def _require(self, token: str | None, asked: str) -> _Held:
        held = self._current()
        if held is None:
            raise Busy(
                f"asked to {asked}: nobody holds it (any more); take it with POST /api/v1/lease",
                asked=asked,
                found="nobody holds the lease",
                remedy="take it with POST /api/v1/lease",
            )
        if not _same(token, held.token):
            raise _held_by(held.holder, asked)
        return held

    def _grant(self, held: _Held) -> LeaseGrant:
        return LeaseGrant(token=held.token, holder=held.holder, expires_in_s=round(self._left_s(held), 2))

    def _left_s(self, held: _Held) -> float:
        return (held.expires_ns - self._clock.now_ns()) / 1e9


def _same(token: str | None, expected: str) -> bool:
    return token is not None and secrets.compare_digest(token.encode(), expected.encode())


def _held_by(holder: str, asked: str) -> Busy:
    remedy = f"ask {holder}, wait, or take over with POST /api/v1/lease and take_over true"
    return Busy(
        f"asked to {asked}: {holder} holds the control lease; {remedy}",
        asked=asked,
        found=f"the lease is held by {holder}",
        remedy=remedy,
    )
