"""Translates SQLite's errors of an unusable database: damaged, locked, or on a failing disk."""

import errno
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sqlalchemy.exc import DatabaseError, DataError, IntegrityError, NotSupportedError, ProgrammingError

from foveacam_hardware.contract import Busy, DeviceFault, FoveaError
from foveacam_pipeline.storage.disk import disk_fault

_DISK_ERRORS = {
    sqlite3.SQLITE_FULL: errno.ENOSPC,
    sqlite3.SQLITE_READONLY: errno.EROFS,
    sqlite3.SQLITE_PERM: errno.EACCES,
    sqlite3.SQLITE_IOERR: errno.EIO,
    sqlite3.SQLITE_CANTOPEN: errno.EIO,
}
_LOCKED = (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)
_MISTAKES = (
    *(IntegrityError, ProgrammingError, DataError, NotSupportedError),
    *(sqlite3.IntegrityError, sqlite3.ProgrammingError, sqlite3.DataError, sqlite3.NotSupportedError),
)
"""Errors of a statement, which are not translated."""
_LEAST_FREE_BYTES = 65_536
"""Free space below which an I/O error counts as a full disk."""
RESTORE = "restore a backup with foveacam restore FILE.tar --data NEW"


@contextmanager
def database_errors(path: Path) -> Iterator[None]:
    """Translate the errors of the database at `path`.

    Raise StorageFull when the disk is full or cannot be written, Busy when another program has locked the
    database, DeviceFault when it is damaged, is of another program, or its disk failed. Errors of a statement
    are left alone.
    """
    try:
        yield
    except _MISTAKES:
        raise
    except (DatabaseError, sqlite3.DatabaseError) as error:
        cause = error.orig if isinstance(error, DatabaseError) else error
        raise _translated(cause or error, path) from error


def unreadable_row(what: str, found: str) -> DeviceFault:
    """Return the error of a row whose content this program cannot read."""
    return DeviceFault(
        f"the database holds {what} that cannot be read ({found})", found=found, remedy=RESTORE
    )


def _translated(cause: BaseException, path: Path) -> FoveaError:
    code = getattr(cause, "sqlite_errorcode", 0) & 0xFF
    if code in _LOCKED:
        return Busy(
            f"the database {path} is locked",
            asked=str(path),
            found="locked",
            remedy="close the other program that has it open, such as a shell of SQLite, then try again",
        )
    number = _DISK_ERRORS.get(code)
    if number is None:
        return _damaged(cause, path)
    if number == errno.EIO and _free_bytes(path.parent) < _LEAST_FREE_BYTES:
        number = errno.ENOSPC  # SQLite cannot create its files beside the database
    return disk_fault(OSError(number, str(cause)), what="the database", folder=path.parent)


def _damaged(cause: BaseException, path: Path) -> DeviceFault:
    """Return the error of a damaged database: its file, SQLite's finding, and what can replace it."""
    copies = sorted(path.parent.glob(f"{path.name}.before-*"), key=lambda copy: copy.stat().st_mtime)
    remedy = RESTORE
    if copies:
        remedy += f", or put {copies[-1].name}, the copy from before the last update, in its place"
    return DeviceFault(
        f"the database {path} cannot be used ({cause})",
        asked=str(path),
        found=str(cause),
        remedy=remedy,
    )


def _free_bytes(folder: Path) -> float:
    try:
        return shutil.disk_usage(folder).free
    except OSError:
        return float("inf")
