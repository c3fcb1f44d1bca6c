"""The SQLite database (WAL) of jobs, fixations, targets, clouds and events, and the data directory's lock."""

import errno
import fcntl
import os
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any

from sqlalchemy import JSON, Engine, Index, String, create_engine, event, text
from sqlalchemy.engine.interfaces import DBAPIConnection
from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import DeclarativeBase, Mapped, Session, mapped_column
from sqlalchemy.pool import ConnectionPoolEntry

from foveacam_hardware.contract import Busy, InvalidInput
from foveacam_pipeline.storage.disk import disk_fault

SCHEMA_VERSION = 1
Document = dict[str, Any]
"""A JSON object, as stored in a row or sent by REST."""
_DISK_ERRORS = {
    sqlite3.SQLITE_FULL: errno.ENOSPC,
    sqlite3.SQLITE_READONLY: errno.EROFS,
    sqlite3.SQLITE_IOERR: errno.EIO,
    sqlite3.SQLITE_CANTOPEN: errno.EIO,
}
_LEAST_FREE_BYTES = 65_536
"""With less free space, an I/O error is taken as a full disk."""


class TableRow(DeclarativeBase):
    """Root of the tables."""

    type_annotation_map = {Document: JSON}  # noqa: RUF012 - SQLAlchemy reads this name from the class


class JobRow(TableRow):
    """A job."""

    __tablename__ = "jobs"
    seq: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    id: Mapped[str] = mapped_column(String(40), unique=True)
    kind: Mapped[str]
    state: Mapped[str] = mapped_column(index=True)
    request: Mapped[Document]
    created_utc: Mapped[str]
    started_utc: Mapped[str | None]
    ended_utc: Mapped[str | None]
    done: Mapped[int] = mapped_column(default=0)
    total: Mapped[int] = mapped_column(default=0)
    note: Mapped[str] = mapped_column(default="")
    result_url: Mapped[str | None]
    problem: Mapped[Document | None]
    idempotency_key: Mapped[str | None] = mapped_column(String(200), unique=True)


class FixationRow(TableRow):
    """A fixation; `document` is what REST shows, without the ids that are set later."""

    __tablename__ = "fixations"
    seq: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    id: Mapped[str] = mapped_column(String(40), unique=True)
    job_id: Mapped[str] = mapped_column(index=True)
    target_id: Mapped[str | None]
    cloud_id: Mapped[str | None]
    document: Mapped[Document]


class TargetRow(TableRow):
    """A target: a point that was fixated."""

    __tablename__ = "targets"
    seq: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    id: Mapped[str] = mapped_column(String(40), unique=True)
    label: Mapped[str]
    document: Mapped[Document]


class CloudRow(TableRow):
    """The point cloud of a fixation; its files are in the data directory under its id."""

    __tablename__ = "clouds"
    seq: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    id: Mapped[str] = mapped_column(String(40), unique=True)
    fixation_id: Mapped[str] = mapped_column(index=True)
    document: Mapped[Document]


class EventRow(TableRow):
    """An event."""

    __tablename__ = "events"
    id: Mapped[int] = mapped_column(primary_key=True)
    kind: Mapped[str]
    document: Mapped[Document]


Index("events_by_kind", EventRow.kind, EventRow.id)


class Store:
    """The database and the data directory; one server at a time may use it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._lock_fd = _lock_folder(folder)
        try:
            self._engine = _open_engine(folder / "foveacam.sqlite")
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

        Raise StorageFull when the disk is full or cannot be written, DeviceFault when it failed.
        """
        try:
            with Session(self._engine, expire_on_commit=False) as session, session.begin():
                yield session
        except OperationalError as error:
            number = _DISK_ERRORS.get(getattr(error.orig, "sqlite_errorcode", 0) & 0xFF)
            if number is None:
                raise
            if number == errno.EIO and shutil.disk_usage(self.folder).free < _LEAST_FREE_BYTES:
                number = errno.ENOSPC  # SQLite cannot create its files beside the database
            disk_error = OSError(number, str(error.orig))
            raise disk_fault(disk_error, what="the database", folder=self.folder) from error

    def subfolder(self, name: str) -> Path:
        """Return a folder of the data directory, made when missing."""
        path = self.folder / name
        path.mkdir(exist_ok=True)
        return path

    def close(self) -> None:
        """Close the database and release the data directory."""
        self._engine.dispose()
        os.close(self._lock_fd)


def _lock_folder(folder: Path) -> int:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock_fd = os.open(folder / "lock", os.O_RDWR | os.O_CREAT, 0o644)
    except OSError as error:
        raise InvalidInput(
            f"data directory {folder}: {error.strerror}; choose another with --data DIR or FOVEACAM_DATA",
            asked=str(folder),
            found=error.strerror,
            remedy="choose another with --data DIR or FOVEACAM_DATA",
        ) from error
    try:
        fcntl.flock(lock_fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        os.close(lock_fd)
        raise Busy(
            f"data directory {folder} is in use by another FoveaCam server; stop that one, or give this one "
            "its own with --data DIR",
            asked=str(folder),
            found="held by another server",
            remedy="stop the other server, or use --data DIR",
        ) from error
    return lock_fd


def _open_engine(path: Path) -> Engine:
    engine = create_engine(f"sqlite:///{path}", connect_args={"timeout": 5.0})

    @event.listens_for(engine, "connect")
    def _prepare(connection: DBAPIConnection, _entry: ConnectionPoolEntry) -> None:
        cursor = connection.cursor()
        cursor.execute("PRAGMA journal_mode=WAL")
        # A power cut may lose the last commits, never damage the file
        cursor.execute("PRAGMA synchronous=NORMAL")
        cursor.close()

    with engine.begin() as connection:
        found = int(connection.execute(text("PRAGMA user_version")).scalar_one())
        if found > SCHEMA_VERSION:
            raise InvalidInput(
                f"{path} was written by a newer version (schema {found}, this one knows {SCHEMA_VERSION}); "
                "update the program, or use --data DIR",
            )
        TableRow.metadata.create_all(connection)
        connection.execute(text(f"PRAGMA user_version = {SCHEMA_VERSION}"))
    return engine
