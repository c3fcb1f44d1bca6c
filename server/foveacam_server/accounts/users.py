"""Users with their roles, passwords and invitations; the last admin who can sign in cannot be removed."""

import re
import secrets
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from typing import Literal

from sqlalchemy import select
from sqlalchemy.orm import Session

from foveacam_hardware.contract import Busy, InvalidInput
from foveacam_server.accounts.passwords import check_password, hash_password, verify_password
from foveacam_server.accounts.rights import Right, UserRole, rights_of
from foveacam_server.accounts.tables import UserRow, secret_hash
from foveacam_server.foundation.errors import NotFound, WrongCredentials
from foveacam_server.foundation.names import utc_now
from foveacam_server.foundation.store import Store

UserState = Literal["active", "invited", "disabled"]
INVITATION_HOURS = 48
_INVITATION_BYTES = 24
NAME_PATTERN = r"^[a-z0-9][a-z0-9._@+-]{0,63}$"
"""Valid names: lower case, so that names cannot differ by a capital only."""


@dataclass(frozen=True, slots=True, kw_only=True)
class User:
    """A user, without secrets."""

    name: str
    role: UserRole
    disabled: bool
    joined: bool
    """Whether a password was set."""
    created_utc: str
    last_seen_utc: str | None
    credentials: str = field(repr=False)
    """Version of the password: changes with it."""

    @property
    def state(self) -> UserState:
        """Return `active`, `invited` or `disabled`."""
        if self.disabled:
            return "disabled"
        return "active" if self.joined or self.last_seen_utc is not None else "invited"


@dataclass(frozen=True, slots=True, kw_only=True)
class Invitation:
    """A one-time code with which a user sets a password; only its hash is stored."""

    code: str
    expires_utc: str


class Users:
    """The users of a server; callable from any thread."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._lock = threading.Lock()
        """Serializes changes, so that two concurrent ones cannot remove both of two admins."""
        self._rights: dict[str, frozenset[Right]] = {}
        self._admin_joined = False
        self._read_rights()

    @property
    def exist(self) -> bool:
        """Whether an admin who can sign in exists: from then on everybody must."""
        return self._admin_joined

    def rights(self, name: str) -> frozenset[Right]:
        """Return the present rights of a user; none for one who is disabled or was removed."""
        return self._rights.get(name, frozenset())

    def all(self) -> list[User]:
        """Return all users by name."""
        with self._store.session() as session:
            return [_user(row) for row in session.scalars(select(UserRow).order_by(UserRow.name))]

    def get(self, name: str) -> User:
        """Return a user; raise `NotFound`."""
        with self._store.session() as session:
            return _user(_row(session, name))

    def add(
        self, name: str, role: UserRole, *, password: str | None = None, first: bool = False
    ) -> tuple[User, Invitation | None]:
        """Add a user; without a password, one who is invited to set it.

        `first`: only as the first admin. Raise `Busy` for a used name or where an admin exists despite
        `first`, `InvalidInput` for a bad password, or for a first user who is not an admin with a password.
        """
        self._check_first(name, role, with_password=password is not None)
        check_name(name)
        if password is not None:
            check_password(password, name=name)
        row = UserRow(name=name, role=role.value, disabled=False, created_utc=utc_now())
        row.password_hash = None if password is None else hash_password(password)
        invitation = _invite(row) if password is None else None
        with self._change() as session:
            if first and self.exist:
                raise _not_the_first(name)
            if session.get(UserRow, name) is not None:
                raise Busy(
                    f"there is a user {name} already",
                    asked=f"a user {name}",
                    found="one of that name",
                    remedy="choose another name, or change that user",
                )
            session.add(row)
        return self.get(name), invitation

    def _check_first(self, name: str, role: UserRole, *, with_password: bool) -> None:
        if self.exist or (role is UserRole.ADMIN and with_password):
            return
        raise InvalidInput(
            "the first user is an admin with a password, who can add others",
            asked=f"{name}, {role}, {'with' if with_password else 'without'} a password",
            found="no user yet",
            remedy="give both the role admin and a password",
        )

    def change(self, name: str, *, role: UserRole | None = None, disabled: bool | None = None) -> User:
        """Change the role of a user, or whether the user may sign in; raise `Busy` for the last admin."""
        with self._change() as session:
            row = _row(session, name)
            row.role = row.role if role is None else role.value
            row.disabled = row.disabled if disabled is None else disabled
            if row.disabled:
                _drop_invitation(row)
            _check_admin_left(session, f"to change {name}")
        return self.get(name)

    def remove(self, name: str) -> None:
        """Remove a user; raise `Busy` for the last admin."""
        with self._change() as session:
            session.delete(_row(session, name))
            session.flush()
            _check_admin_left(session, f"to remove {name}")

    def invite(self, name: str) -> Invitation:
        """Return a new code with which the user sets a password; invalidates an older code."""
        with self._change() as session:
            return _invite(_row(session, name))

    def drop_invitations(self) -> None:
        """Invalidate all codes."""
        with self._change() as session:
            for row in session.scalars(select(UserRow)):
                _drop_invitation(row)

    def check_invitation(self, code: str) -> str:
        """Return the user of an invitation's code; raise `WrongCredentials` for an invalid or expired one."""
        with self._store.session() as session:
            return _invited(session, code).name

    def join(self, code: str, password: str) -> User:
        """Set the password of an invitation's user; raise `WrongCredentials`."""
        check_password(password, name=self.check_invitation(code))
        hashed = hash_password(password)
        with self._change() as session:
            row = _invited(session, code)  # checked again: it may have been used meanwhile
            row.password_hash = hashed
            _drop_invitation(row)
            name = row.name
        return self.get(name)

    def sign_in(self, name: str, password: str, *, known: bool) -> User:
        """Return the user with this name and password, and store the time.

        `known`: whether the browser is known. Raise `WrongCredentials`, the same for a wrong name and a wrong
        password.
        """
        with self._store.session() as session:
            row = session.get(UserRow, name)
            stored = None if row is None or row.disabled else row.password_hash
        if not verify_password(password, stored, known=known):
            raise WrongCredentials(
                "this name and password do not belong together, or the user is disabled",
                asked=f"to sign in as {name}",
                found="a wrong name or password",
                remedy="try again; an admin can make a new link for a forgotten password",
            )
        with self._store.session() as session:
            row = session.get(UserRow, name)
            if row is None or row.disabled or row.password_hash != stored:
                raise changed_meanwhile(name)
            row.last_seen_utc = utc_now()
            return _user(row)

    def come_by_provider(self, name: str, *, new_role: UserRole | None) -> User:
        """Return the user authenticated by a provider as `name`; an unknown one is added with `new_role`.

        Raise `WrongCredentials` for a user who is disabled, or unknown without `new_role`.
        """
        known = next((user for user in self.all() if user.name == name), None)
        if known is None and new_role is not None:
            known, _ = self.add(name, new_role)
        if known is None or known.disabled:
            why = "is disabled" if known is not None else "was not added by an admin"
            raise WrongCredentials(
                f"{name} {why}",
                asked=f"to sign in as {name}",
                found=why,
                remedy="ask an admin of this server",
            )
        with self._store.session() as session:
            row = _row(session, name)
            row.last_seen_utc = utc_now()
            return _user(row)

    def set_password(self, name: str, password: str, *, proved: User | None = None) -> None:
        """Set a user's password; invalidates open invitations.

        `proved`: the user as authenticated by the present password; raise `WrongCredentials` if that has
        changed since.
        """
        check_password(password, name=name)
        hashed = hash_password(password)
        with self._change() as session:
            row = _row(session, name)
            if proved is not None and _user(row).credentials != proved.credentials:
                raise changed_meanwhile(name)
            row.password_hash = hashed
            _drop_invitation(row)

    @contextmanager
    def _change(self) -> Iterator[Session]:
        with self._lock:
            with self._store.session() as session:
                yield session
            self._read_rights()

    def _read_rights(self) -> None:
        found = self.all()
        self._rights = {user.name: rights_of(user.role) for user in found if not user.disabled}
        self._admin_joined = any(_can_administer(user) for user in found)


def changed_meanwhile(name: str) -> WrongCredentials:
    """Return the error for a user whose password changed during its check."""
    return WrongCredentials(
        f"the password of {name} was changed meanwhile, or the user disabled or removed",
        asked=f"to sign in as {name}",
        found="a user that has changed",
        remedy="sign in again",
    )


def check_name(name: str) -> None:
    """Raise `InvalidInput` for a name that no user can have."""
    if re.fullmatch(NAME_PATTERN, name) is None:
        raise InvalidInput(
            "a user's name is 1 to 64 lower-case letters, digits, . _ @ + or -, first a letter or digit; "
            f"{name[:64]!r} is not",
            asked=name[:64],
            found="other characters",
            remedy="choose another name",
        )


def _row(session: Session, name: str) -> UserRow:
    row = session.get(UserRow, name)
    if row is None:
        raise NotFound(
            f"there is no user {name}",
            asked=name,
            found="no such user",
            remedy="GET /api/v1/users lists them",
        )
    return row


def _user(row: UserRow) -> User:
    return User(
        name=row.name,
        role=UserRole(row.role),
        disabled=row.disabled,
        joined=row.password_hash is not None,
        created_utc=row.created_utc,
        last_seen_utc=row.last_seen_utc,
        credentials=secret_hash(row.password_hash or ""),
    )


def _can_administer(user: User) -> bool:
    return user.role is UserRole.ADMIN and user.joined and not user.disabled


def _check_admin_left(session: Session, asked: str) -> None:
    if any(_can_administer(_user(row)) for row in session.scalars(select(UserRow))):
        return
    raise Busy(
        f"asked {asked}: this is the last admin who can sign in",
        asked=asked,
        found="no other admin",
        remedy="make another admin first",
    )


def _invited(session: Session, code: str) -> UserRow:
    """Return the row of an invitation's user; raise `WrongCredentials`."""
    row = session.scalar(select(UserRow).where(UserRow.invitation_hash == secret_hash(code)))
    if row is None or row.disabled or (row.invitation_until_utc or "") < utc_now():
        raise WrongCredentials(
            "this link is not good: it was used, has expired, or a newer one was made",
            found="a link that is not good",
            remedy="ask an admin for a new link",
        )
    return row


def _invite(row: UserRow) -> Invitation:
    invitation = Invitation(
        code=secrets.token_urlsafe(_INVITATION_BYTES),
        expires_utc=utc_in(timedelta(hours=INVITATION_HOURS)),
    )
    row.invitation_hash, row.invitation_until_utc = secret_hash(invitation.code), invitation.expires_utc
    return invitation


def _drop_invitation(row: UserRow) -> None:
    row.invitation_hash = row.invitation_until_utc = None


def _not_the_first(name: str) -> Busy:
    return Busy(
        f"asked to make {name} the first admin: another user was made the first admin meanwhile",
        asked=f"{name} as the first admin",
        found="an admin",
        remedy="sign in, or ask an admin to add you",
    )


def utc_in(life: timedelta) -> str:
    """Return the wall clock after `life`, as `utc_now` writes it."""
    return (datetime.now(UTC) + life).isoformat(timespec="milliseconds").replace("+00:00", "Z")
