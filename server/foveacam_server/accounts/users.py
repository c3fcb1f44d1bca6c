"""Users: their roles, passwords and invitations; there is always an admin who can sign in."""

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
"""Lower case, so that nobody passes for somebody else by a capital."""


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
    """Changes with the password."""

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
        """One change at a time, so that two changes cannot remove both of two admins."""
        self._rights: dict[str, frozenset[Right]] = {}
        self._admin_joined = False
        self._read_rights()

    @property
    def exist(self) -> bool:
        """Whether an admin can sign in: from then on everybody must."""
        return self._admin_joined

    def rights(self, name: str) -> frozenset[Right]:
        """Return what a user may do now; nothing for one who is disabled or was removed."""
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
        """Add a user; without a password, one who is invited to set it. `first`: only as the first admin.

        Raise `Busy` for a name that is taken, or a first admin who is not the first, `InvalidInput` for a bad
        password, or for a first user who could not administer the server.
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
            "the first user is an admin with a password: else nobody could add others",
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
        """Return a new code with which the user sets a password; an older code is no longer good."""
        with self._change() as session:
            return _invite(_row(session, name))

    def drop_invitations(self) -> None:
        """Refuse all codes from now on."""
        with self._change() as session:
            for row in session.scalars(select(UserRow)):
                _drop_invitation(row)

    def check_invitation(self, code: str) -> str:
        """Return whose invitation a code is; raise `WrongCredentials` for one that is none any more."""
        with self._store.session() as session:
            return _invited(session, code).name

    def join(self, code: str, password: str) -> User:
        """Set the password of the user whose invitation this is; raise `WrongCredentials`."""
        check_password(password, name=self.check_invitation(code))
        hashed = hash_password(password)
        with self._change() as session:
            row = _invited(session, code)  # again: somebody else may have used it meanwhile
            row.password_hash = hashed
            _drop_invitation(row)
            name = row.name
        return self.get(name)

    def sign_in(self, name: str, password: str, *, known: bool) -> User:
        """Return the user whose name and password these are, and remember when.

        `known`: whether the browser is. Raise `WrongCredentials`, the same whether the name or the password
        is wrong.
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
        """Return the user whom a provider has proved to be `name`; an unknown one is added with `new_role`.

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
        """Set a user's password; open invitations are no longer good.

        `proved`: the user as the present password has proved it; raise `WrongCredentials` where it is another
        one by now.
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
    """Return the refusal of somebody whose password changed while it was checked."""
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
    """Return the row of the user whose invitation this is; raise `WrongCredentials`."""
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
        f"asked to make {name} the first admin: somebody else became that meanwhile",
        asked=f"{name} as the first admin",
        found="an admin",
        remedy="sign in, or ask an admin to add you",
    )


def utc_in(life: timedelta) -> str:
    """Return the wall clock after `life`, as `utc_now` writes it."""
    return (datetime.now(UTC) + life).isoformat(timespec="milliseconds").replace("+00:00", "Z")
