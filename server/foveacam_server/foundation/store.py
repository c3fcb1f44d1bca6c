"""The SQLite database (WAL) and the data directory's lock; each resource adds its own tables."""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from sqlalchemy import JSON, Dialect, Engine, Index, String, TypeDecorator, create_engine, event
from sqlalchemy.engine.interfaces import DBAPIConnection
from sqlalchemy.orm import DeclarativeBase, Mapped, Session, mapped_column
from sqlalchemy.pool import ConnectionPoolEntry, NullPool

from foveacam_hardware.contract import Busy, InvalidInput
from foveacam_pipeline.storage.disk import PRIVATE, disk_errors
from foveacam_server.foundation.database_errors import database_errors, unreadable_row
from foveacam_server.foundation.migrate import migrate
from foveacam_server.foundation.private_files import make_private, make_private_file, make_private_folder
from foveacam_server.foundation.schema import EventDocument, Problem

Document = dict[str, Any]  # Any: depends on the kind of job or event
"""A JSON object, as stored in a row or sent by REST."""
SchemaT = TypeVar("SchemaT", bound=BaseModel)
DATABASE = "foveacam.sqlite"


class SchemaColumn(TypeDecorator[SchemaT]):
    """A column that stores a schema as JSON; fields that were never set are left out."""

    impl = JSON
    cache_ok = True

    def __init__(self, schema: type[SchemaT]) -> None:
        super().__init__()
        self.schema = schema

    def process_bind_param(self, value: SchemaT | None, dialect: Dialect) -> object:
        """Return the JSON object of a schema."""
        return None if value is None else value.model_dump(mode="json", exclude_unset=True)

    def process_result_value(self, value: object, dialect: Dialect) -> SchemaT | None:
        """Return the schema of a stored JSON object."""
        if value is None:
            return None
        try:
            return self.schema.model_validate(value)
        except ValidationError as error:
            raise unreadable_row(f"a {self.schema.__name__}", error.errors()[0]["msg"]) from error


class TableRow(DeclarativeBase):
    """Declarative base of the tables."""


class JobRow(TableRow):
    """A job."""

    __tablename__ = "jobs"
    seq: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    id: Mapped[str] = mapped_column(String(40), unique=True)
    kind: Mapped[str]
    state: Mapped[str] = mapped_column(index=True)
    request: Mapped[Document] = mapped_column(JSON)  # depends on the kind
    created_utc: Mapped[str]
    started_utc: Mapped[str | None]
    ended_utc: Mapped[str | None]
    done: Mapped[int] = mapped_column(default=0)
    total: Mapped[int] = mapped_column(default=0)
    note: Mapped[str] = mapped_column(default="")
    result_url: Mapped[str | None]
    problem: Mapped[Problem | None] = mapped_column(SchemaColumn(Problem))
    idempotency_key: Mapped[str | None] = mapped_column(String(200), unique=True)


class EventRow(TableRow):
    """An event."""

    __tablename__ = "events"
    id: Mapped[int] = mapped_column(primary_key=True)
    kind: Mapped[str]
    document: Mapped[EventDocument] = mapped_column(SchemaColumn(EventDocument))


Index("events_by_kind", EventRow.kind, EventRow.id)


class Store:
    """The database and the data directory, locked for one server at a time."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._lock_fd = _lock_folder(folder)
        try:
            self._path = folder / DATABASE
            with disk_errors("the database", folder), database_errors(self._path):
                _make_private(self._path)
                self._engine = _open_engine(self._path)
        except BaseException:
            os.close(self._lock_fd)
            raise

    def __enter__(self) -> "Store":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @contextmanager
    def session(self) -> Iterator[Session]:
        """Open a transaction: committed at the end of the block, rolled back on an error.

        Raise as `database_errors`.
        """
        with (
            database_errors(self._path),
            Session(self._engine, expire_on_commit=False) as session,
            session.begin(),
        ):
            yield session

    @property
    def size_bytes(self) -> int:
        """Size of the database with its write-ahead log."""
        return sum(file.stat().st_size for file in (self._path, Path(f"{self._path}-wal")) if file.exists())

    def subfolder(self, name: str) -> Path:
        """Return a folder of the data directory, made when missing."""
        path = self.folder / name
        path.mkdir(exist_ok=True)
        return path

    def close(self) -> None:
        """Close the database and release the data directory."""
        self._engine.dispose()
        os.close(self._lock_fd)


class StoreReader:
    """Read access to the database of a data directory, also while a server uses it."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / DATABASE
        self._engine = create_engine(
            f"sqlite:///{self._path}", connect_args={"timeout": 5.0}, poolclass=NullPool
        )

    @contextmanager
    def session(self) -> Iterator[Session]:
        """Open a session; raise as `Store.session`."""
        with database_errors(self._path), Session(self._engine) as session:
            yield session


def _lock_folder(folder: Path) -> int:
    try:
        make_private_folder(folder)
        lock_fd = os.open(folder / "lock", os.O_RDWR | os.O_CREAT, PRIVATE)
    except OSError as error:
        raise InvalidInput(
            f"data directory {folder}: {error.strerror}",
            asked=str(folder),
            found=error.strerror,
            remedy="choose another with --data DIR or FOVEACAM_DATA",
        ) from error
    try:
        fcntl.flock(lock_fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        os.close(lock_fd)
        raise Busy(
            f"data directory {folder} is in use by another FoveaCam server",
            asked=str(folder),
            found="held by another server",
            remedy="stop the other server, or give this one its own with --data DIR",
        ) from error
    return lock_fd


def _make_private(database: Path) -> None:
    """Restrict the database to its owner; SQLite gives the files that it makes beside it the same mode."""
    make_private_file(database)
    for suffix in ("-wal", "-shm"):
        with suppress(FileNotFoundError):
            make_private(Path(f"{database}{suffix}"))


def _open_engine(path: Path) -> Engine:
    engine = create_engine(f"sqlite:///{path}", connect_args={"timeout": 5.0})

    @event.listens_for(engine, "connect")
    def _prepare(connection: DBAPIConnection, _entry: ConnectionPoolEntry) -> None:
        cursor = connection.cursor()
        cursor.execute("PRAGMA journal_mode=WAL")
        # A power failure may lose the last commits, but never damages the file
        cursor.execute("PRAGMA synchronous=NORMAL")
        cursor.close()

    migrate(path)
    return engine
