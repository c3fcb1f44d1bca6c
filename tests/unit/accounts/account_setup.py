"""What tests of accounts do: sign in, hold a stream open, take the disk away."""

from collections.abc import Iterator
from contextlib import contextmanager

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


@contextmanager
def unwritable(store: Store) -> Iterator[None]:
    """Let SQLite refuse every write, as on a disk that takes none; what is stored can be read."""

    def refuse(
        connection: DBAPIConnection, _entry: ConnectionPoolEntry, _proxy: PoolProxiedConnection
    ) -> None:
        connection.cursor().execute("PRAGMA query_only=ON")

    def allow(connection: DBAPIConnection, _entry: ConnectionPoolEntry) -> None:
        connection.cursor().execute("PRAGMA query_only=OFF")

    event.listen(store._engine, "checkout", refuse)
    event.listen(store._engine, "checkin", allow)
    try:
        yield
    finally:
        event.remove(store._engine, "checkout", refuse)
        event.remove(store._engine, "checkin", allow)
