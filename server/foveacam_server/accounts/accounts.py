"""Combines users, sign-ins, tokens and audit log: a change of a user affects the user's open browsers.

A revocation (a sign-out, a removal, another password) takes effect in memory at once, ends the open streams
first, and does not wait for the disk. A grant is written before it takes effect.
"""

import logging
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum

from foveacam_hardware.contract import InvalidInput
from foveacam_server.accounts.attempts import SignInLimits
from foveacam_server.accounts.audit import AuditLog
from foveacam_server.accounts.errors import require
from foveacam_server.accounts.first_admin import FirstAdminLink
from foveacam_server.accounts.known_browsers import KnownBrowsers
from foveacam_server.accounts.open_streams import OpenStreams
from foveacam_server.accounts.rights import Principal, PrincipalKind, Right, UserRole, rights_of
from foveacam_server.accounts.service_tokens import ServiceToken, ServiceTokens
from foveacam_server.accounts.sign_ins import SignIns
from foveacam_server.accounts.signing_key import SigningKey
from foveacam_server.accounts.tables import WRITE_ERRORS
from foveacam_server.accounts.users import User, Users, changed_meanwhile
from foveacam_server.foundation.errors import NotFound, WrongCredentials
from foveacam_server.foundation.periodic import PeriodicThread
from foveacam_server.foundation.store import Store

_log = logging.getLogger(__name__)

SWEEP_S = 5.0
"""Interval at which expired sign-ins and tokens lose their open streams, and failed writes are retried."""


class Mode(StrEnum):
    """Authentication that a server requires."""

    OPEN = "open"
    """None: one person on one machine."""
    TOKEN = "token"  # noqa: S105 - a mode, no token
    """The settings' shared token."""
    USERS = "users"
    """A name and a password, or a service's token."""
    FIRST_ADMIN = "first_admin"
    """The first admin's code, in a file named on the terminal; nothing else is served before."""


def mode_without_users(*, shared_token: bool, guarded: bool) -> Mode:
    """Return the authentication of a server without users; `guarded`: whether others can reach it."""
    if shared_token:
        return Mode.TOKEN
    return Mode.FIRST_ADMIN if guarded else Mode.OPEN


class Accounts:
    """The accounts of one server; callable from any thread."""

    def __init__(self, store: Store, *, shared_token: bool = False, guarded: bool = False) -> None:
        """`shared_token`: whether the settings have one; `guarded`: whether authentication is required."""
        self._shared_token, self._guarded = shared_token, guarded
        self._changing = threading.RLock()
        """Lock held from a change of a user until the user's sign-ins have ended, and while a sign-in
        begins."""
        self._key = SigningKey(store.folder)
        self.users = Users(store)
        self.sign_ins = SignIns(store, self._key)
        self.known_browsers = KnownBrowsers(self._key.text)
        self.tokens = ServiceTokens(store, rights_of_owner=self.users.rights)
        self._take_up()
        self.audit = AuditLog(store)
        self.streams = OpenStreams()
        self.limits = SignInLimits()
        self.first_admin = FirstAdminLink(store.folder)
        self._sweeper = PeriodicThread("foveacam-accounts", self._sweep, period_s=SWEEP_S, at_close=True)
        self._sweeper.start()

    def close(self) -> None:
        """Write pending changes, then end."""
        self.first_admin.forget()
        self._sweeper.close()
        self.audit.close()

    @property
    def mode(self) -> Mode:
        """Authentication that the server requires now."""
        if self.users.exist:
            return Mode.USERS
        return mode_without_users(shared_token=self._shared_token, guarded=self._guarded)

    def is_first_admin_code(self, code: str) -> bool:
        """Return whether `code` is that of the first admin's link, and no admin exists yet."""
        return not self.users.exist and self.first_admin.matches(code)

    def join(self, code: str, password: str, *, name: str | None) -> User:
        """Set the password of the invited user, or make the first admin `name`; raise `WrongCredentials`.

        All sign-ins of that user end: a link is the way to recover an account.
        """
        if self.first_admin.matches(code):
            return self._join_first(password, name=name)
        if not self.users.exist:
            raise WrongCredentials(
                "this link is not good: it makes the first admin once, and for an hour",
                found="a link that is not good",
                remedy="start the server again for a new one",
            )
        name = self.users.check_invitation(code)
        with self._ending_sign_ins(name):
            user = self.users.join(code, password)
        self.limits.forget_account(name)
        return user

    def _join_first(self, password: str, *, name: str | None) -> User:
        if not name:
            raise WrongCredentials("the first admin needs a name", remedy="give a name")
        user, _ = self.users.add(name, UserRole.ADMIN, password=password, first=True)
        self.first_admin.forget()
        return user

    def authenticate(
        self, name: str, password: str, *, address: str, known: str = "", sign_in: str | None = None
    ) -> User:
        """Return the user with this name and password.

        `known`: cookie of a known browser; `sign_in`: the user's present sign-in, if any. Raise
        `WrongCredentials`, or `TooManyAttempts`.
        """
        browser = sign_in or self.known_browsers.id_of(known, name)
        self.limits.check(name, address=address, browser=browser)
        try:
            user = self.users.sign_in(name, password, known=browser is not None)
        except WrongCredentials:
            self.limits.add_wrong(name, address=address, browser=browser)
            raise
        self.limits.forget_browser(browser)
        return user

    def begin(self, user: User, *, address: str, browser: str) -> str:
        """Sign in an authenticated user; return the cookie's value.

        Raise `WrongCredentials` for one who was removed, disabled, or got another password since.
        """
        with self._changing:
            try:
                present = self.users.get(user.name)
            except NotFound as error:
                raise changed_meanwhile(user.name) from error
            if present.disabled or present.credentials != user.credentials:
                raise changed_meanwhile(user.name)
            cookie, _ = self.sign_ins.begin(present, address=address, browser=browser)
        return cookie

    def change_user(self, name: str, *, role: UserRole | None, disabled: bool | None) -> User:
        """Change a user and the rights of the user's tokens; a disabled user is signed out everywhere."""
        takes_rights = disabled is True or (
            role is not None and not rights_of(role) >= self.users.rights(name)
        )
        with self._changing:
            try:
                user = self.users.change(name, role=role, disabled=disabled)
            except WRITE_ERRORS:
                if takes_rights:
                    self.sign_out_user(name)
                raise
            if user.disabled:
                self.sign_out_user(name)
            else:
                self.sign_ins.change_role(user)
                self._end_streams(name)  # they were opened with other rights
            for token in self.tokens.owned_by(name):
                self.streams.end(token.id)
        return user

    def remove_user(
        self, name: str, *, keep_tokens: bool = False, by: str | None = None
    ) -> list[ServiceToken]:
        """Remove a user, who is signed out everywhere; return the user's tokens, which are revoked.

        `keep_tokens`: they stay, owned by the user `by`; None: by the local machine. Raise `Busy` for
        the last admin, `InvalidInput` where the removed user would own them.
        """
        if keep_tokens and by == name:
            raise InvalidInput(
                f"the tokens of {name} cannot outlive {name} on {name}'s own authority",
                asked=f"to remove {name} and keep the tokens",
                found=f"{name} as the one who keeps them",
                remedy=f"let another admin remove {name}, or revoke them",
            )
        with self._changing:
            tokens = self.tokens.owned_by(name)
            with self._ending_sign_ins(name):
                self.users.remove(name)
            ids = [token.id for token in tokens]
            if keep_tokens:
                self.tokens.hand_over(*ids, owner=by)
                self.tokens.write_changes()
            else:
                self._revoke_tokens(ids)
        return tokens

    def set_password(self, name: str, password: str, *, keep: str | None, proved: User | None = None) -> None:
        """Set a user's password; sign the user out everywhere but in the sign-in `keep`.

        `proved`: the user as authenticated by the present password.
        """
        with self._ending_sign_ins(name, keep=keep):
            self.users.set_password(name, password, proved=proved)
        self.limits.forget_account(name)

    def sign_out_user(self, name: str, *, keep: str | None = None) -> None:
        """Sign a user out everywhere, but in the sign-in `keep`."""
        found = [sign_in.id for sign_in, _ in self.sign_ins.all() if sign_in.user == name]
        self.sign_out(*(sign_in for sign_in in found if sign_in != keep))

    def sign_out(self, *ids: str) -> None:
        """End sign-ins and their open streams."""
        self.sign_ins.refuse(*ids)
        for sign_in in ids:
            self.streams.end(sign_in)
        self.sign_ins.write_refused()

    def add_token(
        self, principal: Principal, name: str, scopes: frozenset[Right], *, days: int | None
    ) -> tuple[str, ServiceToken]:
        """Return a new secret and its token, with no more rights than `principal`; raise `Forbidden`."""
        for scope in sorted(scopes):
            require(principal, scope, asked=f"a token that may {scope}")
        owner = self.authority_of(principal)
        return self.tokens.add(name, scopes, days=days, created_by=principal.name, owner=owner)

    def authority_of(self, principal: Principal) -> str | None:
        """Return the user who owns what a principal creates; None for the local machine."""
        if principal.kind is PrincipalKind.SERVICE and principal.sign_in is not None:
            return self.tokens.get(principal.sign_in).owner
        return principal.name if principal.kind is PrincipalKind.USER else None

    def revoke_token(self, token_id: str) -> ServiceToken:
        """Revoke a service's token and end its open streams; raise `NotFound`."""
        token = self.tokens.get(token_id)
        self._revoke_tokens([token_id])
        return token

    def _revoke_tokens(self, ids: list[str]) -> None:
        self.tokens.refuse(*ids)
        for token_id in ids:
            self.streams.end(token_id)
        self.tokens.write_changes()

    @contextmanager
    def _ending_sign_ins(self, name: str, *, keep: str | None = None) -> Iterator[None]:
        """Sign a user out after the block has changed the user, also where the write failed."""
        with self._changing:
            try:
                yield
            except WRITE_ERRORS:
                self.sign_out_user(name, keep=keep)
                raise
            self.sign_out_user(name, keep=keep)

    def _end_streams(self, name: str) -> None:
        for sign_in, _ in self.sign_ins.all():
            if sign_in.user == name:
                self.streams.end(sign_in.id)

    def _take_up(self) -> None:
        """Load the state of the last run; drop sign-ins not signed by this data directory's key."""
        try:
            if self._key.is_new:  # a new directory, a restored backup, or an unwritten sign-out
                self.sign_ins.revoke_stored()
                self.users.drop_invitations()
            self._key.keep()
        except WRITE_ERRORS as error:
            _log.warning("the accounts cannot be written; it is tried again: %s", error)
        self.sign_ins.load(self.users.all())
        known = {user.name for user in self.users.all()}
        self.tokens.refuse(*(token.id for token in self.tokens.all() if token.owner not in (None, *known)))
        self.tokens.write_changes()

    def _sweep(self) -> None:
        for ended in [*self.sign_ins.forget_expired(), *self.tokens.forget_expired()]:
            self.streams.end(ended)
        if self.users.exist:
            self.first_admin.forget()
        self.first_admin.forget_expired()
        self.sign_ins.write()
        self.tokens.write()
