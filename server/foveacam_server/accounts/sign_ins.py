"""Sign-ins: the browsers in which users are signed in, by a signed cookie whose secret the server can forget.

All live sign-ins are in memory, so that a request costs no query; the table keeps them over a restart. A
revoked sign-in is refused at once, also when the revocation cannot be written.
"""

import logging
import secrets
import threading
import time
from dataclasses import dataclass, field
from datetime import timedelta

from itsdangerous import BadSignature, Signer
from sqlalchemy import delete, select, update

from foveacam_server.accounts.cookies import COOKIE_DAYS
from foveacam_server.accounts.rights import Principal, PrincipalKind, rights_of
from foveacam_server.accounts.signing_key import SigningKey
from foveacam_server.accounts.tables import WRITE_ERRORS, SignInRow, secret_hash
from foveacam_server.accounts.users import User, utc_in
from foveacam_server.foundation.names import age_s, new_id, utc_now
from foveacam_server.foundation.store import Store

_log = logging.getLogger(__name__)

LIFE = timedelta(days=COOKIE_DAYS)
IDLE = timedelta(days=7)
"""Longest pause between two uses of a sign-in."""
_SECRET_BYTES = 32
_BROWSER_CHARS = 160


@dataclass(frozen=True, slots=True, kw_only=True)
class SignIn:
    """A browser in which a user is signed in."""

    id: str
    user: str
    address: str
    browser: str
    created_utc: str
    expires_utc: str


@dataclass(slots=True, kw_only=True)
class _Live:
    sign_in: SignIn
    principal: Principal
    until_s: float
    """Expiry by the monotonic clock, so that a wall clock set back does not prolong it."""
    seen_utc: str
    unwritten: bool = False


@dataclass(slots=True)
class SignIns:
    """The sign-ins of a server; callable from any thread."""

    store: Store
    key: SigningKey
    _signer: Signer = field(init=False)
    _lock: threading.Lock = field(init=False, default_factory=threading.Lock)
    _live: dict[str, _Live] = field(init=False, default_factory=dict)
    """Sign-ins by the hash of the secret."""
    _unwritten: set[str] = field(init=False, default_factory=set)
    """Ids of revoked sign-ins that are still in the table, because the write failed."""
    _writing: threading.Lock = field(init=False, default_factory=threading.Lock)
    """Lock held while it is decided whether the key may be in its file."""

    def __post_init__(self) -> None:
        self._signer = Signer(self.key.text, salt="foveacam sign-in")

    def load(self, users: list[User]) -> None:
        """Load the stored sign-ins of these users; drop others and expired ones."""
        named = {user.name: user for user in users if not user.disabled}
        with self.store.session() as session:
            rows = session.scalars(select(SignInRow)).all()
        live = {
            row.secret_hash: _live(_sign_in(row), named[row.user], seen_utc=row.last_seen_utc)
            for row in rows
            if row.user in named and row.id not in self._unwritten
        }
        with self._lock:
            self._live = live
        self.forget_expired()

    def revoke_stored(self) -> None:
        """Revoke all sign-ins of the table, as after the loss of the key that signed them."""
        with self.store.session() as session:
            ids = session.scalars(select(SignInRow.id)).all()
        if ids:
            self.revoke(*ids)

    def begin(self, user: User, *, address: str, browser: str) -> tuple[str, SignIn]:
        """Sign a user in; return the cookie's value and the sign-in."""
        secret = secrets.token_urlsafe(_SECRET_BYTES)
        now_utc = utc_now()
        sign_in = SignIn(
            id=new_id("signin"),
            user=user.name,
            address=address,
            browser=browser[:_BROWSER_CHARS],
            created_utc=now_utc,
            expires_utc=utc_in(LIFE),
        )
        hashed = secret_hash(secret)
        row = SignInRow(
            id=sign_in.id,
            secret_hash=hashed,
            user=sign_in.user,
            address=sign_in.address,
            browser=sign_in.browser,
            created_utc=now_utc,
            last_seen_utc=now_utc,
            expires_utc=sign_in.expires_utc,
        )
        with self.store.session() as session:
            session.add(row)
        with self._lock:
            self._live[hashed] = _live(sign_in, user, seen_utc=now_utc)
        return self._signer.sign(secret).decode(), sign_in

    def find(self, cookie: str) -> Principal | None:
        """Return the principal of a cookie; None for one that is forged, expired or revoked."""
        try:
            secret = self._signer.unsign(cookie).decode()
        except (BadSignature, UnicodeDecodeError):
            return None
        with self._lock:
            live = self._live.get(secret_hash(secret))
            if live is None or _has_expired(live):
                return None
            live.seen_utc, live.unwritten = utc_now(), True
            return live.principal

    def all(self) -> list[tuple[SignIn, str]]:
        """Return the live sign-ins with the time of their last use, newest first."""
        with self._lock:
            found = [(live.sign_in, live.seen_utc) for live in self._live.values() if not _has_expired(live)]
        return sorted(found, key=lambda pair: pair[0].created_utc, reverse=True)

    def refuse(self, *ids: str) -> None:
        """Revoke sign-ins; `write_refused` stores that for the next start."""
        with self._lock:
            self._live = {key: live for key, live in self._live.items() if live.sign_in.id not in ids}
            self._unwritten.update(ids)

    def write_refused(self) -> None:
        """Delete revoked sign-ins from the table. If that fails, `write` tries again."""
        try:
            with self._writing:
                self._write_refused()
        except WRITE_ERRORS as error:
            _log.warning("a sign-out holds, but was not written; it is tried again: %s", error)

    def revoke(self, *ids: str) -> None:
        """Revoke sign-ins and store that."""
        self.refuse(*ids)
        self.write_refused()

    def write(self) -> None:
        """Write revocations and times of use; raise errors of the disk."""
        with self._writing:
            self._write_refused()
            self.key.keep()
        with self._lock:
            used = {live.sign_in.id: live.seen_utc for live in self._live.values() if live.unwritten}
            for live in self._live.values():
                live.unwritten = False
        with self.store.session() as session:
            for sign_in, seen_utc in used.items():
                session.execute(
                    update(SignInRow).where(SignInRow.id == sign_in).values(last_seen_utc=seen_utc)
                )

    def _write_refused(self) -> None:
        with self._lock:
            ids = frozenset(self._unwritten)
        if not ids:
            return
        try:
            with self.store.session() as session:
                session.execute(delete(SignInRow).where(SignInRow.id.in_(ids)))
        except WRITE_ERRORS:
            self._void_key()
            raise
        with self._lock:
            self._unwritten -= ids

    def _void_key(self) -> None:
        """Remove the key, so that a server killed before a successful write accepts no earlier cookie."""
        try:
            self.key.void()
        except OSError as error:
            _log.warning("%s cannot be removed; a server that is killed now forgets the sign-out", error)

    def change_role(self, user: User) -> None:
        """Give the sign-ins of a user the rights of the user's present role."""
        with self._lock:
            for live in self._live.values():
                if live.sign_in.user == user.name:
                    live.principal = _principal(live.sign_in, user)

    def forget_expired(self) -> list[str]:
        """Revoke the sign-ins that have expired and return their ids."""
        with self._lock:
            expired = [live.sign_in.id for live in self._live.values() if _has_expired(live)]
        if expired:
            self.revoke(*expired)
        return expired


def _sign_in(row: SignInRow) -> SignIn:
    return SignIn(
        id=row.id,
        user=row.user,
        address=row.address,
        browser=row.browser,
        created_utc=row.created_utc,
        expires_utc=row.expires_utc,
    )


def _principal(sign_in: SignIn, user: User) -> Principal:
    return Principal(
        kind=PrincipalKind.USER,
        name=user.name,
        role=user.role,
        rights=rights_of(user.role),
        sign_in=sign_in.id,
    )


def _live(sign_in: SignIn, user: User, *, seen_utc: str) -> _Live:
    left_s = LIFE.total_seconds() - age_s(sign_in.created_utc)
    return _Live(
        sign_in=sign_in,
        principal=_principal(sign_in, user),
        until_s=time.monotonic() + left_s,
        seen_utc=seen_utc,
    )


def _has_expired(live: _Live) -> bool:
    return (
        time.monotonic() > live.until_s
        or live.sign_in.expires_utc < utc_now()
        or age_s(live.seen_utc) > IDLE.total_seconds()
    )
