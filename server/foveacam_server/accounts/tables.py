"""Tables of users, sign-ins, tokens of services and the audit log; secrets are stored only as hashes."""

import hashlib
import hmac

from sqlalchemy import JSON, String
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Mapped, mapped_column

from foveacam_hardware.contract import DeviceFault, StorageFull
from foveacam_server.foundation.store import TableRow

WRITE_ERRORS = (StorageFull, DeviceFault, SQLAlchemyError)
"""Errors of a failed write to the database."""


class UserRow(TableRow):
    """Row of a user."""

    __tablename__ = "users"
    name: Mapped[str] = mapped_column(String(64), primary_key=True)
    role: Mapped[str]
    password_hash: Mapped[str | None]
    """Argon2id hash; None until the invitation was used."""
    disabled: Mapped[bool]
    created_utc: Mapped[str]
    last_seen_utc: Mapped[str | None]
    invitation_hash: Mapped[str | None]
    invitation_until_utc: Mapped[str | None]


class SignInRow(TableRow):
    """A browser in which a user has signed in."""

    __tablename__ = "sign_ins"
    id: Mapped[str] = mapped_column(String(40), primary_key=True)
    secret_hash: Mapped[str] = mapped_column(unique=True)
    user: Mapped[str] = mapped_column(index=True)
    address: Mapped[str]
    browser: Mapped[str]
    created_utc: Mapped[str]
    last_seen_utc: Mapped[str]
    expires_utc: Mapped[str]


class ServiceTokenRow(TableRow):
    """A token of a service."""

    __tablename__ = "service_tokens"
    id: Mapped[str] = mapped_column(String(40), primary_key=True)
    name: Mapped[str] = mapped_column(unique=True)
    prefix: Mapped[str]
    secret_hash: Mapped[str] = mapped_column(unique=True)
    scopes: Mapped[list[str]] = mapped_column(JSON)
    created_by: Mapped[str]
    created_utc: Mapped[str]
    expires_utc: Mapped[str | None]
    last_used_utc: Mapped[str | None]
    owner: Mapped[str | None]
    """User on whose authority it exists; None: the local machine or the shared token."""


class AuditRow(TableRow):
    """A change that somebody made or tried."""

    __tablename__ = "audit"
    id: Mapped[int] = mapped_column(primary_key=True)
    utc: Mapped[str]
    who: Mapped[str] = mapped_column(index=True)
    kind: Mapped[str]
    method: Mapped[str]
    path: Mapped[str]
    what: Mapped[str]
    address: Mapped[str]
    status: Mapped[int]
    outcome: Mapped[str]
    repeated: Mapped[int]
    detail: Mapped[str]


def secret_hash(secret: str) -> str:
    """Return the hash under which a random secret, too long to be guessed, is stored."""
    return hashlib.sha256(secret.encode()).hexdigest()


def equal(given: str, wanted: str) -> bool:
    """Compare two secrets in constant time."""
    return hmac.compare_digest(given.encode(), wanted.encode())
