"""Brings the database to the present revision by Alembic, in one transaction, and copies it before.

Alembic is imported only when there is something to migrate, as that takes a third of a second.
"""

import logging
import sqlite3
import threading
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

from sqlalchemy import Connection, create_engine, event, inspect
from sqlalchemy.engine.interfaces import DBAPIConnection
from sqlalchemy.pool import ConnectionPoolEntry, NullPool

from foveacam_hardware.contract import InvalidInput
from foveacam_server.foundation.private_files import make_private_file

if TYPE_CHECKING:
    from alembic.config import Config

NEWEST_REVISION = "0004"
"""The revision of the newest migration."""
FIRST_REVISION = "0001"
"""Revision of databases made before revisions were numbered."""
LOCKED_S = 5.0
"""Timeout for another program's lock of the database."""
_FOLDER = Path(__file__).parent / "migrations"
_MIGRATING = threading.Lock()
"""Serializes migrations: Alembic's `context` and `op` are global in the process."""


def migration_config() -> "Config":
    """Return Alembic's configuration of this database's migrations."""
    from alembic.config import Config

    config = Config()
    config.set_main_option("script_location", str(_FOLDER).replace("%", "%%"))
    return config


def migrate(path: Path) -> None:
    """Bring the database at `path` to the newest revision; a missing one is created.

    A database that has tables is first copied to `NAME.before-REVISION` beside it. All changes are one
    transaction: a database whose migration fails stays as it was.

    Raise `InvalidInput` for a database of a newer version, SQLAlchemy's or sqlite3's `DatabaseError` for one
    that cannot be used.
    """
    engine = create_engine(f"sqlite:///{path}", connect_args={"timeout": LOCKED_S}, poolclass=NullPool)
    event.listen(engine, "connect", _leave_transactions_to_sqlalchemy)
    event.listen(engine, "begin", _begin)
    with _MIGRATING, engine.begin() as connection:
        found = _revision(connection)
        if found != NEWEST_REVISION:
            _upgrade(connection, path, found=found)


def _upgrade(connection: Connection, path: Path, *, found: str | None) -> None:
    from alembic import command
    from alembic.util import CommandError

    config = migration_config()
    config.attributes["connection"] = connection
    if found is not None:
        copy_database(path, path.with_name(f"{path.name}.before-{NEWEST_REVISION}"))
        logging.getLogger(__name__).info("migrating %s from %s to %s", path, found, NEWEST_REVISION)
        if not inspect(connection).has_table("alembic_version"):
            command.stamp(config, FIRST_REVISION)
    try:
        command.upgrade(config, NEWEST_REVISION)
    except CommandError as error:
        raise InvalidInput(
            f"{path} was written by a newer version (revision {found}, this one knows {NEWEST_REVISION})",
            asked=str(path),
            found=f"revision {found}",
            remedy="update the program, or use --data DIR",
        ) from error


def revision_of(path: Path) -> str | None:
    """Return the revision of the database at `path`; None when it is empty."""
    engine = create_engine(f"sqlite:///{path}", poolclass=NullPool)
    with engine.connect() as connection:
        return _revision(connection)


def is_known(revision: str) -> bool:
    """Return whether this program can migrate a database of a revision to the newest one."""
    from alembic.script import ScriptDirectory
    from alembic.util import CommandError

    try:
        return ScriptDirectory.from_config(migration_config()).get_revision(revision) is not None
    except CommandError:
        return False


def _revision(connection: Connection) -> str | None:
    """Return the revision of a database; None when it is empty."""
    tables = inspect(connection)
    if tables.has_table("alembic_version"):
        row = connection.exec_driver_sql("SELECT version_num FROM alembic_version").first()
        return None if row is None else str(row[0])
    return FIRST_REVISION if tables.has_table("jobs") else None


def copy_database(path: Path, copy: Path) -> None:
    """Copy a consistent snapshot of a database, also while it is in use; only its owner can read the copy."""
    partial = copy.with_name(f"{copy.name}.part")
    try:
        make_private_file(partial)
        with closing(sqlite3.connect(path)) as source, closing(sqlite3.connect(partial)) as target:
            source.backup(target)
        partial.replace(copy)
    finally:
        partial.unlink(missing_ok=True)


def _leave_transactions_to_sqlalchemy(connection: DBAPIConnection, _entry: ConnectionPoolEntry) -> None:
    connection.isolation_level = None  # otherwise Python's driver commits before each CREATE TABLE


def _begin(connection: Connection) -> None:
    connection.exec_driver_sql("BEGIN IMMEDIATE")
