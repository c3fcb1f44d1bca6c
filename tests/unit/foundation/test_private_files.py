"""What a server keeps can be read by its owner alone: folder, database, copies, backups."""

import logging
import os
import sqlite3
import stat
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from foveacam_pipeline.workers.progress import SILENT
from foveacam_server.foundation.backup.archive import back_up
from foveacam_server.foundation.backup.restore import restore
from foveacam_server.foundation.private_files import warn_if_readable
from foveacam_server.foundation.store import DATABASE, JobRow, Store

FIRST_VERSION = Path(__file__).parents[2] / "data" / "database-0.1-first.sql"


@pytest.fixture(autouse=True)
def _usual_umask() -> Iterator[None]:
    before = os.umask(0o022)
    yield
    os.umask(before)


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


def shared(folder: Path) -> dict[str, int]:
    """Return what others could read of a folder's content."""
    return {path.name: mode(path) for path in folder.rglob("*") if path.is_file() and mode(path) & 0o077}


def written(store: Store) -> None:
    """Write a row, so that the files beside the database are there."""
    with store.session() as session:
        session.add(JobRow(id="job-1", kind="test", state="queued", request={}, created_utc="2026"))


def test_a_new_data_directory_is_its_owners_alone(tmp_path: Path) -> None:
    folder = tmp_path / "data"
    with Store(folder) as store:
        written(store)
        names = {path.name for path in folder.iterdir()}
        assert {DATABASE, f"{DATABASE}-wal", f"{DATABASE}-shm"} <= names
        assert mode(folder) == 0o700 and shared(folder) == {}


def test_a_data_directory_that_others_could_read_is_closed_and_that_is_logged_once(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    folder = tmp_path / "data"
    with Store(folder) as store:
        written(store)
        folder.chmod(0o755)
        for path in folder.iterdir():
            path.chmod(0o644)
    with caplog.at_level(logging.WARNING), Store(folder):
        assert mode(folder) == 0o700 and mode(folder / DATABASE) == 0o600
    assert [record.getMessage() for record in caplog.records] == [
        f"{folder} could be read by others (mode 755); it has mode 700 now"
    ]
    caplog.clear()
    Store(folder).close()
    assert caplog.records == []


def test_a_folder_that_all_users_share_is_left_and_reported(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    folder = tmp_path / "shared"
    folder.mkdir()
    folder.chmod(0o1777)
    Store(folder).close()
    assert mode(folder) == 0o1777 and mode(folder / DATABASE) == 0o600
    assert "cannot be closed: it is shared by all users" in caplog.text


def test_the_copy_before_a_migration_is_its_owners_alone(tmp_path: Path) -> None:
    with closing(sqlite3.connect(tmp_path / DATABASE)) as database:
        database.executescript(FIRST_VERSION.read_text())
    Store(tmp_path).close()
    (copy,) = tmp_path.glob(f"{DATABASE}.before-*")
    assert mode(copy) == 0o600


def test_a_backup_and_what_it_restores_are_their_owners_alone(tmp_path: Path) -> None:
    folder, archive, restored = tmp_path / "data", tmp_path / "rig.tar", tmp_path / "restored"
    with Store(folder) as store:
        written(store)
        (store.subfolder("calibrations") / "one.json").write_text("{}")
    back_up(folder, archive, created_utc="2026", watch=SILENT)
    assert mode(archive) == 0o600
    restore(archive, restored, watch=SILENT)
    assert mode(restored) == 0o700 and shared(restored) == {}


@pytest.mark.parametrize(("given", "warned"), [(0o600, False), (0o640, False), (0o644, True)])
def test_a_secret_that_every_user_may_read_is_reported(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, given: int, warned: bool
) -> None:
    key = tmp_path / "key.pem"
    key.touch()
    key.chmod(given)
    warn_if_readable(key, what="the key of the certificate")
    assert ("chmod 600" in caplog.text) == warned
