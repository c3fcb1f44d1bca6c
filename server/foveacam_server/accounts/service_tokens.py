"""Tokens of services: shown once, stored as hashes, with scopes, expiry and time of last use.

A token never has more rights than its owner, the user on whose authority it exists, has now. A revoked token
is refused at once, also when the revocation cannot be written.
"""

import logging
import secrets
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import timedelta

from sqlalchemy import delete, select, update

from foveacam_hardware.contract import Busy
from foveacam_server.accounts.rights import Principal, PrincipalKind, Right
from foveacam_server.accounts.tables import WRITE_ERRORS, ServiceTokenRow, secret_hash
from foveacam_server.accounts.users import utc_in
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.names import new_id, utc_now
from foveacam_server.foundation.store import Store

_log = logging.getLogger(__name__)

PREFIX = "fcd_"
"""Prefix of every token, so that a leaked one is recognised."""
SHOWN_CHARS = 10
_SECRET_BYTES = 32
_MISSING = object()


@dataclass(frozen=True, slots=True, kw_only=True)
class ServiceToken:
    """A token of a service, without its secret."""

    id: str
    name: str
    prefix: str
    scopes: frozenset[Right]
    created_by: str
    created_utc: str
    expires_utc: str | None
    last_used_utc: str | None
    owner: str | None
    """User whose rights bound it; None: the local machine or the shared token."""

    @property
    def expired(self) -> bool:
        """Whether it has expired."""
        return self.expires_utc is not None and self.expires_utc < utc_now()


class ServiceTokens:
    """The tokens of a server, in memory, so that a request costs no query; callable from any thread."""

    def __init__(self, store: Store, *, rights_of_owner: Callable[[str], frozenset[Right]]) -> None:
        """`rights_of_owner`: returns the present rights of a user."""
        self._store = store
        self._rights_of_owner = rights_of_owner
        self._lock = threading.Lock()
        self._live: dict[str, ServiceToken] = {}
        """Tokens by the hash of the secret."""
        self._used: dict[str, str] = {}
        """Unwritten times of use, by token id."""
        self._refused: set[str] = set()
        """Ids of revoked tokens that are still in the table, because the write failed."""
        self._handed_over: dict[str, str | None] = {}
        """Unwritten new owners, by token id."""
        self.load()

    def load(self) -> None:
        """Load the stored tokens."""
        with self._store.session() as session:
            rows = session.scalars(select(ServiceTokenRow)).all()
        with self._lock:
            self._live = {row.secret_hash: _token(row) for row in rows if row.id not in self._refused}

    def all(self) -> list[ServiceToken]:
        """Return the tokens by name, also expired ones."""
        with self._lock:
            found = [
                replace(token, last_used_utc=self._used.get(token.id, token.last_used_utc))
                for token in self._live.values()
            ]
        return sorted(found, key=lambda token: token.name)

    def owned_by(self, name: str) -> list[ServiceToken]:
        """Return the tokens of a user, by name."""
        return [token for token in self.all() if token.owner == name]

    def add(
        self,
        name: str,
        scopes: frozenset[Right],
        *,
        days: int | None,
        created_by: str,
        owner: str | None = None,
    ) -> tuple[str, ServiceToken]:
        """Return a new token's secret, which is not stored, and the token; raise `Busy` for a taken name."""
        secret = PREFIX + secrets.token_urlsafe(_SECRET_BYTES)
        token = ServiceToken(
            id=new_id("token"),
            name=name,
            prefix=secret[:SHOWN_CHARS],
            scopes=scopes,
            created_by=created_by,
            created_utc=utc_now(),
            expires_utc=None if days is None else utc_in(timedelta(days=days)),
            last_used_utc=None,
            owner=owner,
        )
        hashed = secret_hash(secret)
        self._write_pending()  # a revoked token's name is in the table until then
        with self._lock:
            if any(other.name == name for other in self._live.values()):
                raise Busy(
                    f"there is a token named {name} already",
                    asked=f"a token named {name}",
                    found="one of that name",
                    remedy="revoke it, or choose another name",
                )
            with self._store.session() as session:
                session.add(_row(token, hashed))
            self._live[hashed] = token
        return secret, token

    def find(self, secret: str) -> Principal | None:
        """Return the principal of a token; None for one unknown, expired, revoked, or without a right."""
        with self._lock:
            token = self._live.get(secret_hash(secret))
            if token is None or token.expired:
                return None
            rights = self._rights(token)
            if not rights:
                return None
            self._used[token.id] = utc_now()
        return Principal(kind=PrincipalKind.SERVICE, name=token.name, rights=rights, sign_in=token.id)

    def get(self, token_id: str) -> ServiceToken:
        """Return a token; raise `NotFound`."""
        found = next((token for token in self.all() if token.id == token_id), None)
        if found is None:
            raise NotFound(
                f"there is no token {token_id}",
                asked=token_id,
                found="no such token",
                remedy="GET /api/v1/service_tokens lists them",
            )
        return found

    def refuse(self, *ids: str) -> None:
        """Revoke tokens; `write_changes` stores that for the next start."""
        with self._lock:
            self._live = {hashed: token for hashed, token in self._live.items() if token.id not in ids}
            self._refused.update(ids)
            for token_id in ids:
                self._used.pop(token_id, None)
                self._handed_over.pop(token_id, None)

    def hand_over(self, *ids: str, owner: str | None) -> None:
        """Give tokens another owner; `write_changes` stores that."""
        with self._lock:
            self._live = {
                hashed: replace(token, owner=owner) if token.id in ids else token
                for hashed, token in self._live.items()
            }
            self._handed_over.update(dict.fromkeys(ids, owner))

    def write_changes(self) -> None:
        """Write revocations and new owners. If that fails, `write` tries again."""
        try:
            self._write_pending()
        except WRITE_ERRORS as error:
            _log.warning("a change of tokens holds, but was not written; it is tried again: %s", error)

    def forget_expired(self) -> list[str]:
        """Return the ids of the tokens that have expired; they stay in the list."""
        return [token.id for token in self.all() if token.expired]

    def write(self) -> None:
        """Write revocations, new owners and times of use; raise errors."""
        self._write_pending()
        with self._lock:
            used, self._used = self._used, {}
            self._live = {
                hashed: replace(token, last_used_utc=used.get(token.id, token.last_used_utc))
                for hashed, token in self._live.items()
            }
        with self._store.session() as session:
            for token_id, utc in used.items():
                session.execute(
                    update(ServiceTokenRow).where(ServiceTokenRow.id == token_id).values(last_used_utc=utc)
                )

    def _rights(self, token: ServiceToken) -> frozenset[Right]:
        return token.scopes if token.owner is None else token.scopes & self._rights_of_owner(token.owner)

    def _write_pending(self) -> None:
        with self._lock:
            refused, handed_over = frozenset(self._refused), dict(self._handed_over)
        if not refused and not handed_over:
            return
        with self._store.session() as session:
            session.execute(delete(ServiceTokenRow).where(ServiceTokenRow.id.in_(refused)))
            for token_id, owner in handed_over.items():
                session.execute(
                    update(ServiceTokenRow).where(ServiceTokenRow.id == token_id).values(owner=owner)
                )
        with self._lock:
            self._refused -= refused
            self._handed_over = {
                token_id: owner
                for token_id, owner in self._handed_over.items()
                if handed_over.get(token_id, _MISSING) != owner
            }


def _token(row: ServiceTokenRow) -> ServiceToken:
    return ServiceToken(
        id=row.id,
        name=row.name,
        prefix=row.prefix,
        scopes=frozenset(Right(scope) for scope in row.scopes),
        created_by=row.created_by,
        created_utc=row.created_utc,
        expires_utc=row.expires_utc,
        last_used_utc=row.last_used_utc,
        owner=row.owner,
    )


def _row(token: ServiceToken, hashed: str) -> ServiceTokenRow:
    return ServiceTokenRow(
        id=token.id,
        name=token.name,
        prefix=token.prefix,
        secret_hash=hashed,
        scopes=sorted(token.scopes),
        created_by=token.created_by,
        created_utc=token.created_utc,
        expires_utc=token.expires_utc,
        last_used_utc=None,
        owner=token.owner,
    )
