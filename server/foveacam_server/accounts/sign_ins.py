"""Sign-ins: the browsers in which users are signed in, by a signed cookie whose secret the server can forget.

All live sign-ins are in memory, so that a request costs no query; the table keeps them over a restart.
"""

import secrets
import threading
import time
from dataclasses import dataclass, field
from datetime import timedelta
from pathlib import Path

from itsdangerous import BadSignature, Signer
from sqlalchemy import delete, select, update

from foveacam_server.accounts.cookies import COOKIE_DAYS
from foveacam_server.accounts.rights import Principal, PrincipalKind, rights_of
from foveacam_server.accounts.tables import SignInRow, secret_hash
from foveacam_server.accounts.users import User, utc_in
from foveacam_server.foundation.names import age_s, new_id, utc_now
from foveacam_server.foundation.store import Store

LIFE = timedelta(days=COOKIE_DAYS)
IDLE = timedelta(days=7)
"""Longest pause between two uses of a sign-in."""
KEY_FILE = "sign_in.key"
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
    """By the monotonic clock: a wall clock that is set back prolongs nothing."""
    seen_utc: str
    unwritten: bool = False


@dataclass(slots=True)
class SignIns:
    """The sign-ins of a server; callable from any thread."""

    store: Store
    _signer: Signer = field(init=False)
    _lock: threading.Lock = field(init=False, default_factory=threading.Lock)
    _live: dict[str, _Live] = field(init=False, default_factory=dict)
    """By the hash of the secret."""

    def __post_init__(self) -> None:
        self._signer = Signer(_signing_key(self.store.folder / KEY_FILE), salt="foveacam sign-in")

    def load(self, users: list[User]) -> None:
        """Take up the stored sign-ins of these users; others, and those that have expired, are forgotten."""
        named = {user.name: user for user in users if not user.disabled}
        with self.store.session() as session:
            rows = session.scalars(select(SignInRow)).all()
        live = {
            row.secret_hash: _live(_sign_in(row), named[row.user], seen_utc=row.last_seen_utc)
            for row in rows
            if row.user in named
        }
        with self._lock:
            self._live = live
        self.forget_expired()

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
        """Return whose sign-in a cookie is; None for one that is forged, expired or revoked."""
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

    def revoke(self, *ids: str) -> None:
        """Forget sign-ins, at once and for good."""
        with self._lock:
            self._live = {key: live for key, live in self._live.items() if live.sign_in.id not in ids}
        with self.store.session() as session:
            session.execute(delete(SignInRow).where(SignInRow.id.in_(ids)))

    def change_role(self, user: User) -> None:
        """Give the sign-ins of a user the rights of the user's present role."""
        with self._lock:
            for live in self._live.values():
                if live.sign_in.user == user.name:
                    live.principal = _principal(live.sign_in, user)

    def forget_expired(self) -> list[str]:
        """Forget the sign-ins that have expired and return their ids; write when the others were used."""
        with self._lock:
            expired = [live.sign_in.id for live in self._live.values() if _has_expired(live)]
            used = {live.sign_in.id: live.seen_utc for live in self._live.values() if live.unwritten}
            for live in self._live.values():
                live.unwritten = False
        if expired:
            self.revoke(*expired)
        with self.store.session() as session:
            for sign_in, seen_utc in used.items():
                session.execute(
                    update(SignInRow).where(SignInRow.id == sign_in).values(last_seen_utc=seen_utc)
                )
        return expired


def _signing_key(path: Path) -> str:
    """Return the key of this data folder, made at first; only its owner can read the file."""
    try:
        return path.read_text(encoding="ascii")
    except FileNotFoundError:
        path.touch(mode=0o600)
        path.write_text(secrets.token_hex(_SECRET_BYTES), encoding="ascii")
        return path.read_text(encoding="ascii")


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
