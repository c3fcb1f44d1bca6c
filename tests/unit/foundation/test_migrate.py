"""Migrations of the database, from a file that the first usable version of the server wrote."""

import json
import sqlite3
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from alembic.operations import Operations
from alembic.script import ScriptDirectory
from sqlalchemy import create_engine, text

from foveacam_hardware.contract import InvalidInput, StorageFull
from foveacam_server.accounts.tables import AuditRow, ServiceTokenRow, SignInRow, UserRow
from foveacam_server.foundation import migrate as migrating
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.job_table import JobTable
from foveacam_server.foundation.migrate import migrate, migration_config
from foveacam_server.foundation.store import Store, TableRow
from foveacam_server.resources.looking.clouds.collection import CloudCollection
from foveacam_server.resources.looking.fixations.documents import describe_target
from foveacam_server.resources.looking.fixations.table import FixationTable, TargetTable
from foveacam_server.resources.looking.measurements.table import MeasurementTable

FIRST_VERSION = Path(__file__).parents[2] / "data" / "database-0.1-first.sql"
ROWS = (UserRow, SignInRow, ServiceTokenRow, AuditRow)
"""Rows of modules that nothing else here imports."""
TABLES = ("jobs", "events", "fixations", "targets", "clouds")


@pytest.fixture
def first_database(tmp_path: Path) -> Path:
    """Return the database of a folder as the first version left it after four fixations."""
    path = tmp_path / "foveacam.sqlite"
    with closing(sqlite3.connect(path)) as database:
        database.executescript(FIRST_VERSION.read_text())
    return path


def _rows(path: Path, table: str) -> list[tuple[object, ...]]:
    with closing(sqlite3.connect(path)) as database:
        return database.execute(f"SELECT * FROM {table}").fetchall()  # noqa: S608 - names of this file


def test_every_row_of_the_first_version_survives_and_is_read(first_database: Path, tmp_path: Path) -> None:
    before = {table: _rows(first_database, table) for table in TABLES}
    with Store(tmp_path) as store:
        states = [fixation.state for fixation in FixationTable(store).newest(10)]
        targets = [describe_target(target) for target in TargetTable(store).every()]
        clouds = CloudCollection(store).newest(10)
        jobs, events = JobTable(store).newest(10), EventLog(store)
        try:
            newest = events.after(0)
        finally:
            events.close()
        assert MeasurementTable(store).every() == []
    assert states == ["lost", "out_of_range", "lost", "verged"]
    assert [(target.label, target.basis, round(target.distance_m or 0, 3)) for target in targets] == [
        ("Target 1", "both_foveae", 7.996)
    ]
    stored = json.loads(str(before["targets"][0][3]))
    assert targets[0].as_json() | stored == targets[0].as_json()  # shown as the first version stored it
    assert [cloud.points for cloud in clouds] == [42527]
    assert [job.state for job in jobs] == ["succeeded"] * 4
    assert len(newest) == len(before["events"])
    assert {table: _rows(first_database, table) for table in TABLES} == before


def test_a_copy_is_kept_of_what_was_migrated(first_database: Path, tmp_path: Path) -> None:
    before = _rows(first_database, "events")
    Store(tmp_path).close()
    Store(tmp_path).close()  # the second time there is nothing to migrate
    copies = sorted(path.name for path in tmp_path.glob("*.before-*"))
    assert copies == [f"foveacam.sqlite.before-{_newest()}"]
    assert _rows(tmp_path / copies[0], "events") == before


def test_a_new_database_is_not_copied(tmp_path: Path) -> None:
    Store(tmp_path).close()
    assert not list(tmp_path.glob("*.before-*"))


def test_a_database_that_has_measurements_but_no_revision_keeps_them(
    first_database: Path, tmp_path: Path
) -> None:
    with closing(sqlite3.connect(first_database)) as database, database:
        database.execute(
            "CREATE TABLE measurements (seq INTEGER NOT NULL PRIMARY KEY, id VARCHAR(40) NOT NULL UNIQUE,"
            " label VARCHAR NOT NULL, document JSON NOT NULL)"
        )
        database.execute("INSERT INTO measurements VALUES (1, 'mea-1', 'A length', '{}')")
    Store(tmp_path).close()
    assert _rows(first_database, "measurements") == [(1, "mea-1", "A length", "{}")]
    assert _rows(first_database, "alembic_version") == [(_newest(),)]


def test_migrations_make_the_tables_that_the_server_uses(tmp_path: Path) -> None:
    path = tmp_path / "foveacam.sqlite"
    migrate(path)
    with create_engine(f"sqlite:///{path}").connect() as connection:
        assert {row.metadata for row in ROWS} == {TableRow.metadata}
        assert compare_metadata(MigrationContext.configure(connection), TableRow.metadata) == []


def test_a_database_of_a_newer_version_is_refused_and_left_as_it_is(tmp_path: Path) -> None:
    with Store(tmp_path) as store, store.session() as session:
        session.execute(text("UPDATE alembic_version SET version_num = '9999'"))
    for _ in range(2):  # the first refusal released the folder
        with pytest.raises(InvalidInput, match="newer version"):
            Store(tmp_path)
    assert _rows(tmp_path / "foveacam.sqlite", "alembic_version") == [("9999",)]


def test_databases_of_one_process_are_made_at_the_same_time(tmp_path: Path) -> None:
    paths = [tmp_path / f"{number}.sqlite" for number in range(12)]
    with ThreadPoolExecutor(6) as pool:
        list(pool.map(migrate, paths))
    assert all(_rows(path, "alembic_version") == [(_newest(),)] for path in paths)


def test_a_migration_that_fails_leaves_the_database_as_it_was(
    first_database: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    schema = _rows(first_database, "sqlite_master")

    def fail(*_args: object, **_options: object) -> None:
        raise sqlite3.IntegrityError

    monkeypatch.setattr(Operations, "create_table", fail)
    with pytest.raises(sqlite3.IntegrityError):
        Store(tmp_path)
    assert _rows(first_database, "sqlite_master") == schema


def test_a_full_disk_is_told_before_anything_is_changed(
    first_database: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fill(_path: Path, _copy: Path) -> None:
        error = sqlite3.OperationalError("database or disk is full")
        error.sqlite_errorcode = sqlite3.SQLITE_FULL
        raise error

    monkeypatch.setattr(migrating, "copy_database", fill)
    with pytest.raises(StorageFull, match="database"):
        Store(tmp_path)
    with closing(sqlite3.connect(first_database)) as database:
        assert not database.execute("SELECT 1 FROM sqlite_master WHERE name = 'alembic_version'").fetchall()


def _newest() -> str | None:
    return ScriptDirectory.from_config(migration_config()).get_current_head()


def test_tokens_get_the_user_who_made_them_as_their_owner(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "foveacam.sqlite"
    migrate(path)
    makers = {"a": "ada", "b": "a", "c": "this machine", "d": "gone"}
    with closing(sqlite3.connect(path)) as database, database:
        database.execute("ALTER TABLE service_tokens DROP COLUMN owner")
        database.execute("UPDATE alembic_version SET version_num = '0003'")
        database.execute(
            "INSERT INTO users (name, role, disabled, created_utc) VALUES ('ada', 'admin', 0, '2026')"
        )
        for name, maker in makers.items():
            database.execute(
                "INSERT INTO service_tokens (id, name, prefix, secret_hash, scopes, created_by, created_utc)"
                " VALUES (?, ?, 'fcd_', ?, '[]', ?, '2026')",
                (name, name, name, maker),
            )
    migrate(path)
    with closing(sqlite3.connect(path)) as database:
        owners = dict(database.execute("SELECT name, owner FROM service_tokens").fetchall())
    assert owners == {"a": "ada", "b": "ada", "c": None, "d": None}
    assert "the token d was made by gone, who is no user any more" in caplog.text
    assert caplog.text.count("no user any more") == 1
