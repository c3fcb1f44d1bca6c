"""The control lease: while a client holds and renews it, only that client may move the rig.

Another client can request it from the holder, who hands it over; an admin can take it over with a reason. It
expires when its holder does not renew it, or has moved nothing for long.
"""

import secrets
import threading
from collections.abc import Callable
from dataclasses import dataclass

from foveacam_hardware.contract import Busy, Clock, InvalidInput
from foveacam_server.foundation.errors import Forbidden
from foveacam_server.foundation.events import EventLevel, EventLog
from foveacam_server.foundation.schema import LeaseAsked, LeaseChange, LeaseDocument, LeaseGrant

LIFETIME_S = 15.0
"""Lifetime of a lease after it was taken or renewed."""
IDLE_S = 600.0
"""Time without a move after which the lease ends."""
EXCUSED_NS = 30_000_000_000
"""Largest extension of a lease for the time in which the blocked event loop could not read renewals."""
OFFER_S = 20.0
"""Time for which a lease that was handed over is reserved for the requester."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LeaseClaim:
    """A client that takes or requests the lease, with its person and rights."""

    holder: str
    """Name by which the client identifies itself."""
    person: str | None = None
    """Name of the user or service; None where nobody signs in."""
    may_take_over: bool = True
    """Whether it may take the lease over from another person."""
    take_over: bool = False
    reason: str | None = None

    @property
    def title(self) -> str:
        """Person and client in words."""
        if self.person is None or self.person == self.holder:
            return self.holder
        return f"{self.person} ({self.holder})"


@dataclass(slots=True, kw_only=True)
class _Held:
    token: str
    claim: LeaseClaim
    expires_ns: int
    moved_ns: int
    blocked_ns: int
    """Total blocked time of the event loop when the lease was taken or renewed."""


@dataclass(slots=True, kw_only=True)
class _Offer:
    """A lease that was handed over and is reserved for its requester."""

    title: str
    until_ns: int


class Lease:
    """The lease: one holder at a time, who must renew it; in memory, so that a restart releases it."""

    def __init__(self, *, clock: Clock, events: EventLog, blocked_ns: Callable[[], int] = lambda: 0) -> None:
        """`blocked_ns`: returns the total blocked time of the event loop, which reads the renewals."""
        self._clock = clock
        self._events = events
        self._blocked_ns = blocked_ns
        self._lock = threading.Lock()
        self._held: _Held | None = None
        self._asked: LeaseClaim | None = None
        self._offer: _Offer | None = None

    def describe(self) -> LeaseDocument:
        """Return the holder of the lease, the time until it expires unless renewed, and its requester."""
        with self._lock:
            held = self._current()
            asked_by = self._asked.title if held is not None and self._asked is not None else None
            if held is None:
                return LeaseDocument(holder=None, expires_in_s=None, person=None, idle_s=None, asked_by=None)
            return LeaseDocument(
                holder=held.claim.title,
                expires_in_s=self._left_s(held),
                person=held.claim.person,
                idle_s=(self._clock.now_ns() - held.moved_ns) / 1e9,
                asked_by=asked_by,
            )

    def take(self, claim: LeaseClaim) -> LeaseGrant:
        """Grant the lease to a claim, from another holder only by taking it over; emit an event.

        Raise `Busy` while another holds it or it is reserved for a requester, `Forbidden` without the right
        to take it over from another person, `InvalidInput` without a reason for that.
        """
        with self._lock:
            before = self._current()
            self._check_offer(claim)
            if before is not None:
                _check_take_over(claim, before.claim)
            now_ns = self._clock.now_ns()
            self._held = _Held(
                token=secrets.token_urlsafe(16),
                claim=claim,
                expires_ns=now_ns + round(LIFETIME_S * 1e9),
                moved_ns=now_ns,
                blocked_ns=self._blocked_ns(),
            )
            self._asked = self._offer = None
            granted = self._grant(self._held)
        self._emit_taken(claim, before)
        return granted

    def renew(self, token: str | None) -> LeaseGrant:
        """Renew the lease that `token` belongs to."""
        with self._lock:
            held = self._require(token, "keep the lease")
            held.expires_ns = self._clock.now_ns() + round(LIFETIME_S * 1e9)
            held.blocked_ns = self._blocked_ns()
            return self._grant(held)

    def release(self, token: str | None) -> None:
        """Release the lease."""
        with self._lock:
            held = self._require(token, "give the lease back")
            self._held = self._asked = None
        self._emit_free(held, f"{held.claim.title} gave the control lease back")

    def ask(self, claim: LeaseClaim) -> LeaseDocument:
        """Request the lease from its holder; raise `Busy` when it is free or already requested."""
        with self._lock:
            if self._current() is None:
                raise Busy(
                    "asked for the lease, which is free",
                    asked="the lease of its holder",
                    found="the lease is free",
                    remedy="take it with POST /api/v1/lease",
                )
            if self._asked is not None and self._asked.title != claim.title:
                raise Busy(
                    f"{self._asked.title} asks for the lease already",
                    asked="the lease of its holder",
                    found=f"{self._asked.title} asks for it",
                    remedy="wait for the answer",
                )
            self._asked = claim
        asked = LeaseAsked(asked_by=claim.title)
        self._events.emit("lease.asked", f"{claim.title} asks for the control lease", data=asked)
        return self.describe()

    def answer(self, token: str | None, *, hand_over: bool) -> LeaseDocument:
        """Hand the lease over to its requester, who has `OFFER_S` to take it, or refuse."""
        with self._lock:
            held = self._require(token, "answer who asks for the lease")
            asked, self._asked = self._asked, None
            if asked is None:
                raise Busy(
                    "asked to answer a request for the lease: there is none",
                    asked="to answer who asks for the lease",
                    found="no request",
                    remedy="GET /api/v1/lease shows who asks",
                )
            if hand_over:
                until_ns = self._clock.now_ns() + round(OFFER_S * 1e9)
                self._held, self._offer = None, _Offer(title=asked.title, until_ns=until_ns)
        if hand_over:
            self._emit_free(held, f"{held.claim.title} hands the control lease over to {asked.title}")
        else:
            message = f"{held.claim.title} keeps the control lease, which {asked.title} asked for"
            self._events.emit("lease.asked", message, data=LeaseAsked(asked_by=None))
        return self.describe()

    def check(self, token: str | None) -> None:
        """Raise `Busy`, naming the holder, when somebody else holds the lease."""
        with self._lock:
            held = self._current()
            if held is None:
                return
            if not _same(token, held.token):
                raise _held_by(held.claim.title, "move the mirrors")
            held.moved_ns = self._clock.now_ns()

    def require(self, token: str | None, *, asked: str) -> None:
        """Raise `Busy` unless `token` is that of the present lease; a free lease is refused."""
        with self._lock:
            self._require(token, asked)

    def _current(self) -> _Held | None:
        held, now_ns = self._held, self._clock.now_ns()
        if held is None:
            return None
        idle_s = (now_ns - held.moved_ns) / 1e9
        if self._left_s(held) <= 0 or idle_s > IDLE_S:
            self._held = self._asked = None
            if idle_s > IDLE_S:
                self._emit_free(
                    held, f"the control lease of {held.claim.title} ended: nothing moved for {IDLE_S:.0f} s"
                )
        return self._held

    def _check_offer(self, claim: LeaseClaim) -> None:
        offer = self._offer
        if offer is None or offer.title == claim.title or offer.until_ns <= self._clock.now_ns():
            return
        if not claim.take_over:
            raise Busy(
                f"asked to take the lease: it is kept for {offer.title}, who was handed it",
                asked="take the lease",
                found=f"it is kept for {offer.title}",
                remedy="wait a moment",
            )

    def _require(self, token: str | None, asked: str) -> _Held:
        held = self._current()
        if held is None:
            raise Busy(
                f"asked to {asked}: the lease is free",
                asked=asked,
                found="the lease is free",
                remedy="take it with POST /api/v1/lease",
            )
        if not _same(token, held.token):
            raise _held_by(held.claim.title, asked)
        return held

    def _emit_taken(self, claim: LeaseClaim, before: _Held | None) -> None:
        change = LeaseChange(holder=claim.title, before=before.claim.title if before else None)
        if before is None:
            self._events.emit("lease.changed", f"{claim.title} holds the control lease", data=change)
            return
        why = f": {claim.reason}" if claim.reason else ""
        message = f"{claim.title} took the control lease over from {before.claim.title}{why}"
        self._events.emit("lease.changed", message, level=EventLevel.WARNING, data=change)

    def _emit_free(self, held: _Held, message: str) -> None:
        self._events.emit("lease.changed", message, data=LeaseChange(holder=None, before=held.claim.title))

    def _grant(self, held: _Held) -> LeaseGrant:
        return LeaseGrant(
            token=held.token, holder=held.claim.title, expires_in_s=round(self._left_s(held), 2)
        )

    def _left_s(self, held: _Held) -> float:
        excused_ns = min(EXCUSED_NS, self._blocked_ns() - held.blocked_ns)
        return (held.expires_ns + excused_ns - self._clock.now_ns()) / 1e9


def _check_take_over(claim: LeaseClaim, before: LeaseClaim) -> None:
    """Raise unless a claim takes the lease over and may; from one's own other client it always may."""
    own = claim.person is not None and claim.person == before.person
    if not claim.take_over:
        raise _held_by(before.title, "take the lease")
    if own or before.person is None:
        return
    if not claim.may_take_over:
        raise Forbidden(
            f"asked to take the lease over from {before.title}: only an admin may",
            asked="to take the lease over",
            found=f"the lease is held by {before.title}",
            remedy=f"ask {before.title} for it with POST /api/v1/lease/request",
        )
    if not claim.reason:
        raise InvalidInput(
            f"asked to take the lease over from {before.title} without a reason",
            asked="to take the lease over",
            found="no reason",
            remedy="send a reason, which is logged",
        )


def _same(token: str | None, expected: str) -> bool:
    return token is not None and secrets.compare_digest(token.encode(), expected.encode())


def _held_by(holder: str, asked: str) -> Busy:
    return Busy(
        f"asked to {asked}: {holder} holds the control lease",
        asked=asked,
        found=f"the lease is held by {holder}",
        remedy=f"ask {holder}, wait, or take over with POST /api/v1/lease and take_over true",
    )
