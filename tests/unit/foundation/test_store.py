import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from sqlalchemy import text
from sqlalchemy.exc import IntegrityError

from foveacam_hardware.contract import Busy, DeviceFault, FoveaError, InvalidInput, StorageFull
from foveacam_server.foundation.database_errors import database_errors
from foveacam_server.foundation.store import DATABASE, JobRow, Store, StoreReader


def test_second_server_on_the_same_folder_is_refused(tmp_path: Path) -> None:
    with Store(tmp_path), pytest.raises(Busy, match="in use by another FoveaCam server"):
        Store(tmp_path)


def test_folder_is_free_again_after_closing(tmp_path: Path) -> None:
    Store(tmp_path).close()
    Store(tmp_path).close()


def test_folder_that_cannot_be_made_is_named_with_a_remedy(tmp_path: Path) -> None:
    in_the_way = tmp_path / "file"
    in_the_way.write_text("")
    with pytest.raises(InvalidInput, match=r"file.*--data"):
        Store(in_the_way / "data")


def test_database_keeps_a_write_ahead_log(tmp_path: Path) -> None:
    with Store(tmp_path) as store, store.session() as session:
        assert session.execute(text("PRAGMA journal_mode")).scalar_one() == "wal"


def overwrite(path: Path, begin: int, end: int | None) -> None:
    content = bytearray(path.read_bytes())
    content[begin:end] = np.random.default_rng(5).bytes(len(content[begin:end]))
    path.write_bytes(content)


DAMAGES: dict[str, Callable[[Path], object]] = {
    "another file": lambda path: path.write_bytes(b"no database" * 1000),
    "its head": lambda path: overwrite(path, 0, 4096),
    "all but its head": lambda path: overwrite(path, 4096, None),
    "cut short": lambda path: path.write_bytes(path.read_bytes()[:3000]),
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES.keys())
def test_a_damaged_database_names_its_file_and_what_can_replace_it(
    damage: Callable[[Path], object], tmp_path: Path
) -> None:
    Store(tmp_path).close()
    damage(tmp_path / DATABASE)
    for name in ("0002", "0003"):
        (tmp_path / f"{DATABASE}.before-{name}").touch()
    with pytest.raises(DeviceFault) as found:
        Store(tmp_path)
    message = str(found.value)
    for part in (str(tmp_path / DATABASE), "foveacam restore FILE.tar", f"{DATABASE}.before-0003"):
        assert part in message
    (tmp_path / "lock").unlink()  # another server may use the folder: the lock was released


def test_a_database_that_another_program_has_locked_is_busy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Store(tmp_path).close()
    with closing(sqlite3.connect(tmp_path / DATABASE, isolation_level=None)) as other:
        other.execute("BEGIN EXCLUSIVE")
        monkeypatch.setattr("foveacam_server.foundation.migrate.LOCKED_S", 0.05)
        with pytest.raises(Busy, match=f"{DATABASE} is locked; close the other program"):
            Store(tmp_path)


def test_a_table_that_is_missing_is_told_by_a_reader_too(tmp_path: Path) -> None:
    with closing(sqlite3.connect(tmp_path / DATABASE)) as database:
        database.execute("CREATE TABLE notes (text)")
    with pytest.raises(DeviceFault, match="no such table: jobs"), StoreReader(tmp_path).session() as session:
        session.query(JobRow).all()


def test_a_row_that_cannot_be_read_is_told(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        with store.session() as session:
            row = {"id": "job-1", "kind": "x", "state": "failed", "request": {}, "created_utc": ""}
            session.add(JobRow(**row))
            session.flush()
            session.execute(text("UPDATE jobs SET problem = '{\"title\": 7}'"))
        with pytest.raises(DeviceFault, match="a Problem that cannot be read"), store.session() as session:
            session.query(JobRow).all()


@pytest.mark.parametrize(
    ("code", "kind"),
    [
        (sqlite3.SQLITE_FULL, StorageFull),
        (sqlite3.SQLITE_READONLY_DBMOVED, StorageFull),
        (sqlite3.SQLITE_PERM, StorageFull),
        (sqlite3.SQLITE_IOERR_READ, DeviceFault),
        (sqlite3.SQLITE_CANTOPEN, DeviceFault),
        (sqlite3.SQLITE_BUSY_SNAPSHOT, Busy),
        (sqlite3.SQLITE_LOCKED, Busy),
        (sqlite3.SQLITE_CORRUPT_VTAB, DeviceFault),
        (sqlite3.SQLITE_NOTADB, DeviceFault),
        (sqlite3.SQLITE_PROTOCOL, DeviceFault),
    ],
)
def test_every_error_of_the_database_is_one_of_ours(
    code: int, kind: type[FoveaError], tmp_path: Path
) -> None:
    error = sqlite3.DatabaseError("told by SQLite")
    error.sqlite_errorcode = code
    with pytest.raises(kind), database_errors(tmp_path / DATABASE):
        raise error


def test_a_mistake_of_a_statement_stays_one(tmp_path: Path) -> None:
    row = {"id": "job-1", "kind": "x", "state": "failed", "request": {}, "created_utc": ""}
    with Store(tmp_path) as store, pytest.raises(IntegrityError), store.session() as session:
        session.add_all([JobRow(**row), JobRow(**row)])
