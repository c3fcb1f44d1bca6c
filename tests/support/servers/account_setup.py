"""What tests of accounts do: sign in, hold a stream open, take the disk away."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sqlalchemy import event
from sqlalchemy.engine.interfaces import DBAPIConnection
from sqlalchemy.pool import ConnectionPoolEntry, PoolProxiedConnection

from foveacam_server.accounts.accounts import Accounts
from foveacam_server.foundation.store import Store

PASSWORD = "correct horse battery"  # noqa: S105  # a password of these tests alone


def signed_in(accounts: Accounts, name: str) -> tuple[str, str]:
    """Sign a user in; return the cookie and the sign-in's id."""
    cookie = accounts.begin(accounts.users.get(name), address="10.0.0.9", browser="test")
    principal = accounts.sign_ins.find(cookie)
    assert principal is not None and principal.sign_in is not None
    return cookie, principal.sign_in


class FillableStore(Store):
    """A store whose SQLite refuses every write while `full`; what is stored can be read."""

    full = False

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)

        def choose(
            connection: DBAPIConnection, _entry: ConnectionPoolEntry, _proxy: PoolProxiedConnection
        ) -> None:
            connection.cursor().execute(f"PRAGMA query_only={'ON' if self.full else 'OFF'}")

        event.listen(self._engine, "checkout", choose)


@contextmanager
def unwritable(store: Store) -> Iterator[None]:
    """Let a store take nothing, as on a disk that is full."""
    assert isinstance(store, FillableStore)
    store.full = True
    try:
        yield
    finally:
        store.full = False
