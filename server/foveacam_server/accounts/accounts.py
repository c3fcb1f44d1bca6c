"""Users, sign-ins, tokens and audit log as one: a change of a user reaches the user's open browsers."""

import secrets
import threading
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import StrEnum

from foveacam_server.accounts.attempts import WrongAttempts
from foveacam_server.accounts.audit import AuditLog
from foveacam_server.accounts.rights import UserRole
from foveacam_server.accounts.service_tokens import ServiceToken, ServiceTokens
from foveacam_server.accounts.sign_ins import SignIns
from foveacam_server.accounts.tables import equal
from foveacam_server.accounts.users import User, Users
from foveacam_server.foundation.errors import TooManyAttempts, WrongCredentials
from foveacam_server.foundation.periodic import PeriodicThread
from foveacam_server.foundation.store import Store

SWEEP_S = 5.0
"""Interval at which expired sign-ins and tokens lose their open streams."""
_CODE_BYTES = 24


class OpenStreams:
    """Counts the open connections of each sign-in or token, and ends them; callable from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._ends: defaultdict[str, list[Callable[[], None]]] = defaultdict(list)

    @contextmanager
    def opened(self, sign_in: str, end: Callable[[], None]) -> Iterator[None]:
        """Hold a connection that `end` ends, while the block runs; `end` must not wait."""
        with self._lock:
            self._ends[sign_in].append(end)
        try:
            yield
        finally:
            with self._lock:
                self._ends[sign_in].remove(end)
                if not self._ends[sign_in]:
                    del self._ends[sign_in]

    def end(self, sign_in: str) -> None:
        """End the connections of a sign-in or token."""
        with self._lock:
            ends = list(self._ends.get(sign_in, ()))
        for end in ends:
            end()

    def counts(self) -> Counter[str]:
        """Return how many connections each sign-in or token has open."""
        with self._lock:
            return Counter({sign_in: len(ends) for sign_in, ends in self._ends.items()})


class Mode(StrEnum):
    """What a server asks of whoever comes."""

    OPEN = "open"
    """Nothing: one person on one machine."""
    TOKEN = "token"  # noqa: S105 - a mode, no token
    """The shared token of the settings."""
    USERS = "users"
    """A name and a password, or a service's token."""
    FIRST_ADMIN = "first_admin"
    """The code that the terminal shows; nothing is served before the first admin exists."""


def mode_without_users(*, shared_token: bool, guarded: bool) -> Mode:
    """Return what a server without users asks; `guarded`: whether others can reach it."""
    if shared_token:
        return Mode.TOKEN
    return Mode.FIRST_ADMIN if guarded else Mode.OPEN


class Accounts:
    """The accounts of one server; callable from any thread."""

    def __init__(self, store: Store, *, shared_token: bool = False, guarded: bool = False) -> None:
        """`shared_token`: whether the settings have one; `guarded`: whether the server must ask somebody."""
        self._shared_token, self._guarded = shared_token, guarded
        self.users = Users(store)
        self.sign_ins = SignIns(store)
        self.sign_ins.load(self.users.all())
        self.tokens = ServiceTokens(store)
        self.audit = AuditLog(store)
        self.streams = OpenStreams()
        self._first_code: str | None = None
        self._wrong = WrongAttempts()
        self._sweeper = PeriodicThread("foveacam-accounts", self._sweep, period_s=SWEEP_S, at_close=True)
        self._sweeper.start()

    def close(self) -> None:
        """Write what is to be written, then end."""
        self._sweeper.close()
        self.audit.close()

    @property
    def mode(self) -> Mode:
        """What the server asks of whoever comes."""
        if self.users.exist:
            return Mode.USERS
        return mode_without_users(shared_token=self._shared_token, guarded=self._guarded)

    def first_admin_code(self) -> str:
        """Return the code with which the first admin is made; a new one for each start of the server."""
        if self._first_code is None:
            self._first_code = secrets.token_urlsafe(_CODE_BYTES)
        return self._first_code

    def is_first_admin_code(self, code: str) -> bool:
        """Return whether `code` is that of the terminal, and no admin exists yet."""
        return self._first_code is not None and not self.users.exist and equal(code, self._first_code)

    def join(self, code: str, password: str, *, name: str | None) -> User:
        """Set the password of the invited user, or make the first admin `name`; raise `WrongCredentials`."""
        if not self.is_first_admin_code(code):
            return self.users.join(code, password)
        if not name:
            raise WrongCredentials("the first admin needs a name; give one", remedy="give a name")
        user, _ = self.users.add(name, UserRole.ADMIN, password=password)
        self._first_code = None
        return user

    def authenticate(self, name: str, password: str, *, address: str) -> User:
        """Return the user whose name and password these are.

        Raise `WrongCredentials`, or `TooManyAttempts` for an address or account with too many wrong ones.
        """
        wait_s = self._wrong.wait_s(address)
        if wait_s > 0.0:
            raise TooManyAttempts(
                f"too many wrong passwords came from this address; none is looked at for {wait_s:.0f} s",
                wait_s=wait_s,
                asked=f"to sign in as {name}",
                found="too many wrong passwords",
                remedy="wait, then try again",
            )
        try:
            return self.users.sign_in(name, password)
        except WrongCredentials:
            self._wrong.add_wrong(address)
            raise

    def begin(self, user: User, *, address: str, browser: str) -> str:
        """Sign in a user who has proved who it is; return the cookie's value."""
        cookie, _ = self.sign_ins.begin(user, address=address, browser=browser)
        return cookie

    def change_user(self, name: str, *, role: UserRole | None, disabled: bool | None) -> User:
        """Change a user; a disabled one is signed out everywhere, another role holds at once."""
        user = self.users.change(name, role=role, disabled=disabled)
        if user.disabled:
            self.sign_out_user(name)
        else:
            self.sign_ins.change_role(user)
            self._end_streams(name)  # they were opened with other rights
        return user

    def remove_user(self, name: str) -> None:
        """Remove a user, who is signed out everywhere."""
        self.users.remove(name)
        self.sign_out_user(name)

    def set_password(self, name: str, password: str, *, keep: str | None) -> None:
        """Set a user's password; sign the user out everywhere but in the sign-in `keep`."""
        self.users.set_password(name, password)
        self.sign_out_user(name, keep=keep)

    def sign_out_user(self, name: str, *, keep: str | None = None) -> None:
        """Sign a user out everywhere, but in the sign-in `keep`."""
        found = [sign_in.id for sign_in, _ in self.sign_ins.all() if sign_in.user == name]
        self.sign_out(*(sign_in for sign_in in found if sign_in != keep))

    def sign_out(self, *ids: str) -> None:
        """End sign-ins and their open streams."""
        self.sign_ins.revoke(*ids)
        for sign_in in ids:
            self.streams.end(sign_in)

    def revoke_token(self, token_id: str) -> ServiceToken:
        """Refuse a service's token from now on, and end its open streams."""
        token = self.tokens.revoke(token_id)
        self.streams.end(token_id)
        return token

    def _end_streams(self, name: str) -> None:
        for sign_in, _ in self.sign_ins.all():
            if sign_in.user == name:
                self.streams.end(sign_in.id)

    def _sweep(self) -> None:
        for ended in [*self.sign_ins.forget_expired(), *self.tokens.write_uses()]:
            self.streams.end(ended)
