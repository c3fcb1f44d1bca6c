"""Tokens of services: shown once, stored as hashes, with scopes, an end and the time of their last use."""

import secrets
import threading
from dataclasses import dataclass, replace
from datetime import timedelta

from sqlalchemy import delete, select, update

from foveacam_hardware.contract import Busy
from foveacam_server.accounts.rights import Principal, PrincipalKind, Right
from foveacam_server.accounts.tables import ServiceTokenRow, secret_hash
from foveacam_server.accounts.users import utc_in
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.names import new_id, utc_now
from foveacam_server.foundation.store import Store

PREFIX = "fcd_"
"""Begins every token, so that a leaked one is recognised."""
SHOWN_CHARS = 10
_SECRET_BYTES = 32


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

    @property
    def expired(self) -> bool:
        """Whether its life is over."""
        return self.expires_utc is not None and self.expires_utc < utc_now()


class ServiceTokens:
    """The tokens of a server, in memory, so that a request costs no query; callable from any thread."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._lock = threading.Lock()
        self._used: dict[str, str] = {}
        self._live: dict[str, ServiceToken] = {}
        self.load()

    def load(self) -> None:
        """Take up the stored tokens."""
        with self._store.session() as session:
            rows = session.scalars(select(ServiceTokenRow)).all()
        with self._lock:
            self._live = {row.secret_hash: _token(row) for row in rows}

    def all(self) -> list[ServiceToken]:
        """Return the tokens by name, also expired ones."""
        with self._lock:
            found = [
                replace(token, last_used_utc=self._used.get(token.id, token.last_used_utc))
                for token in self._live.values()
            ]
        return sorted(found, key=lambda token: token.name)

    def add(
        self, name: str, scopes: frozenset[Right], *, days: int | None, created_by: str
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
        )
        hashed = secret_hash(secret)
        with self._lock:
            if any(other.name == name for other in self._live.values()):
                raise Busy(
                    f"there is a token named {name} already; revoke it, or choose another name",
                    asked=f"a token named {name}",
                    found="one of that name",
                    remedy="revoke it, or choose another name",
                )
            with self._store.session() as session:
                session.add(_row(token, hashed))
            self._live[hashed] = token
        return secret, token

    def find(self, secret: str) -> Principal | None:
        """Return whose token this is; None for one that is unknown, expired or revoked."""
        with self._lock:
            token = self._live.get(secret_hash(secret))
            if token is None or token.expired:
                return None
            self._used[token.id] = utc_now()
        return Principal(kind=PrincipalKind.SERVICE, name=token.name, rights=token.scopes, sign_in=token.id)

    def revoke(self, token_id: str) -> ServiceToken:
        """Refuse a token from now on; return it. Raise `NotFound`."""
        with self._lock:
            found = next((pair for pair in self._live.items() if pair[1].id == token_id), None)
            if found is None:
                raise NotFound(
                    f"there is no token {token_id}",
                    asked=token_id,
                    found="no such token",
                    remedy="GET /api/v1/service_tokens",
                )
            with self._store.session() as session:
                session.execute(delete(ServiceTokenRow).where(ServiceTokenRow.id == token_id))
            del self._live[found[0]]
            self._used.pop(token_id, None)
        return found[1]

    def write_uses(self) -> list[str]:
        """Write when the tokens were used; return the ids of those that have expired."""
        with self._lock:
            used, self._used = self._used, {}
            self._live = {
                hashed: replace(token, last_used_utc=used.get(token.id, token.last_used_utc))
                for hashed, token in self._live.items()
            }
            expired = [token.id for token in self._live.values() if token.expired]
        with self._store.session() as session:
            for token_id, utc in used.items():
                session.execute(
                    update(ServiceTokenRow).where(ServiceTokenRow.id == token_id).values(last_used_utc=utc)
                )
        return expired


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
    )
