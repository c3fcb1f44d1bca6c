"""Backups: made beside a running server, restored whole or not at all."""

import hashlib
import io
import json
import os
import shutil
import sqlite3
import tarfile
import threading
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

from foveacam_hardware.contract import Cancelled, FoveaError, InvalidInput, StorageFull
from foveacam_pipeline.workers.progress import SILENT, SilentProgress
from foveacam_server.cli import app
from foveacam_server.foundation.backup.archive import MANIFEST, BackupManifest, back_up
from foveacam_server.foundation.backup.restore import restore
from foveacam_server.foundation.store import DATABASE, JobRow, Store

FILES = {
    "captures/desk/dataset.json": b"{}",
    "captures/desk/points.jsonl": b'{"point": 0}\n',
    "captures/desk/0000-left.png": bytes(range(256)) * 5000,
    "calibrations/one.json": b'{"id": "one"}',
    "recordings/empty.fcap": b"",
}


def write_files(folder: Path) -> None:
    for name, content in FILES.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)


@pytest.fixture
def data(tmp_path: Path) -> Iterator[Path]:
    """A data directory that a server has open, with a commit that only its write-ahead log has."""
    folder = tmp_path / "data"
    with Store(folder) as store:
        write_files(folder)
        (folder / "captures/desk/.0001-left.png.part").write_bytes(b"unfinished")
        with store.session() as session:
            session.add(JobRow(id="job-1", kind="test", state="ended", request={}, created_utc="2026"))
        yield folder


@pytest.fixture
def archive(data: Path, tmp_path: Path) -> Path:
    path = tmp_path / "rig.tar"
    back_up(data, path, created_utc="2026-01-01T00:00:00Z", watch=SILENT)
    return path


def files_of(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and path.relative_to(folder).parts[0] not in (DATABASE, "lock")
    }


def test_a_backup_of_an_open_data_directory_is_restored_elsewhere_to_the_last_byte(
    archive: Path, tmp_path: Path
) -> None:
    manifest = restore(archive, tmp_path / "other", watch=SILENT)
    restored = files_of(tmp_path / "other")
    assert restored == FILES
    hashes = {file.path: file.sha256 for file in manifest.files if file.path != DATABASE}
    assert hashes == {name: hashlib.sha256(content).hexdigest() for name, content in FILES.items()}
    with Store(tmp_path / "other") as store, store.session() as session:
        assert [row.id for row in session.query(JobRow)] == ["job-1"]


@pytest.mark.parametrize("secret", ["sign_in.key", "token", "first_admin_link"])
def test_a_backup_holds_no_secret_of_the_server(data: Path, tmp_path: Path, secret: str) -> None:
    (data / secret).write_text("0123456789abcdef")
    back_up(data, tmp_path / "rig.tar", created_utc="", watch=SILENT)
    with tarfile.open(tmp_path / "rig.tar") as tar:
        assert secret not in tar.getnames()
    assert b"0123456789abcdef" not in (tmp_path / "rig.tar").read_bytes()


def test_what_was_cut_short_by_a_kill_is_made_again(data: Path, tmp_path: Path) -> None:
    (tmp_path / ".rig.tar.part").write_bytes(b"half a backup")
    (tmp_path / ".other.part").mkdir()
    (tmp_path / ".other.part" / "half").touch()
    back_up(data, tmp_path / "rig.tar", created_utc="", watch=SILENT)
    restore(tmp_path / "rig.tar", tmp_path / "other", watch=SILENT)
    assert files_of(tmp_path / "other") == FILES
    assert not list(tmp_path.glob(".*.part"))


def test_documents_come_before_what_they_name(archive: Path) -> None:
    with tarfile.open(archive) as tar:
        names = tar.getnames()
    assert names[0] == DATABASE
    assert names[-1] == MANIFEST
    assert names.index("captures/desk/points.jsonl") < names.index("captures/desk/0000-left.png")


def test_files_that_grow_and_vanish_meanwhile_do_no_harm(data: Path, tmp_path: Path) -> None:
    growing, going = data / "recordings" / "z.fcap", data / "recordings" / "zz.fcap"
    growing.write_bytes(b"x" * 1000)
    going.write_bytes(b"y")

    class Meanwhile(SilentProgress):
        def progress(self, done: int, *, total: int, note: str = "") -> None:
            going.unlink(missing_ok=True)
            with growing.open("ab") as file:
                file.write(b"x" * 1000)

    path = tmp_path / "rig.tar"
    back_up(data, path, created_utc="", watch=Meanwhile())
    restore(path, tmp_path / "other", watch=SILENT)
    restored = files_of(tmp_path / "other")
    assert len(restored.pop("recordings/z.fcap")) >= 1000
    assert restored == FILES


def test_a_database_in_use_is_copied_as_it_was_at_one_moment(data: Path, tmp_path: Path) -> None:
    ended = threading.Event()

    def keep_adding() -> None:
        with closing(sqlite3.connect(data / DATABASE, timeout=5.0)) as connection:
            number = 10
            while not ended.is_set():
                with connection:  # two rows in one transaction
                    for _ in range(2):
                        connection.execute("INSERT INTO events VALUES (?, 'pair', '{}')", (number,))
                        number += 1

    adding = threading.Thread(target=keep_adding)
    adding.start()
    try:
        for turn in range(5):
            back_up(data, tmp_path / f"{turn}.tar", created_utc="", watch=SILENT)
    finally:
        ended.set()
        adding.join()
    for turn in range(5):
        restore(tmp_path / f"{turn}.tar", tmp_path / f"{turn}", watch=SILENT)
        with closing(sqlite3.connect(tmp_path / f"{turn}" / DATABASE)) as connection:
            assert connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
            (pairs,) = connection.execute("SELECT COUNT(*) FROM events WHERE kind = 'pair'").fetchone()
        assert pairs % 2 == 0


def test_a_backup_that_was_cut_anywhere_is_refused(archive: Path, tmp_path: Path) -> None:
    whole = archive.read_bytes()
    with tarfile.open(archive) as tar:
        end = tar.getmember(MANIFEST).offset_data + tar.getmember(MANIFEST).size
    draws = np.random.default_rng(1)
    for cut in [0, 1, 511, 512, end - 1, *draws.integers(end, size=45)]:
        archive.write_bytes(whole[:cut])
        with pytest.raises(InvalidInput, match="is no backup, or was cut short"):
            restore(archive, tmp_path / "other", watch=SILENT)
        assert not (tmp_path / "other").exists()


def test_a_byte_that_has_changed_is_found(archive: Path, tmp_path: Path) -> None:
    with tarfile.open(archive) as tar:
        place = tar.getmember("captures/desk/0000-left.png").offset_data + 77
    content = bytearray(archive.read_bytes())
    content[place] ^= 1
    archive.write_bytes(content)
    with pytest.raises(InvalidInput, match=r"is damaged: captures/desk/0000-left\.png differs from its hash"):
        restore(archive, tmp_path / "other", watch=SILENT)
    assert not (tmp_path / "other").exists()


def rewritten(archive: Path, change: Callable[[dict[str, object]], None]) -> None:
    """Change the manifest of a backup."""
    with tarfile.open(archive) as tar:
        members = [(member, tar.extractfile(member)) for member in tar]
        contents = [(member, file.read()) for member, file in members if file is not None]
    with tarfile.open(archive, "w") as tar:
        for member, content in contents:
            if member.name == MANIFEST:
                document = json.loads(content)
                change(document)
                content = json.dumps(document).encode()
                member.size = len(content)
            tar.addfile(member, io.BytesIO(content))


def test_a_backup_of_a_newer_version_names_both(archive: Path, tmp_path: Path) -> None:
    rewritten(archive, lambda document: document.update(program="99.0", revision="9999"))
    newer = r"made by a newer version \(99\.0, database 9999\).*update the program"
    with pytest.raises(InvalidInput, match=newer):
        restore(archive, tmp_path / "other", watch=SILENT)
    rewritten(archive, lambda document: document.update(version=2))
    with pytest.raises(InvalidInput, match="its manifest is not valid"):
        restore(archive, tmp_path / "other", watch=SILENT)


@pytest.mark.parametrize("name", ["../outside", "/outside", "a/../../outside"])
def test_no_member_leads_out_of_the_directory(tmp_path: Path, name: str) -> None:
    archive = tmp_path / "evil.tar"
    with tarfile.open(archive, "w") as tar:
        member = tarfile.TarInfo(name)
        member.size = 1
        tar.addfile(member, io.BytesIO(b"x"))
    with pytest.raises(InvalidInput, match="which is no file of a backup"):
        restore(archive, tmp_path / "deep" / "other", watch=SILENT)
    assert [path.name for path in tmp_path.rglob("outside")] == []


def link(kind: bytes) -> tarfile.TarInfo:
    member = tarfile.TarInfo("captures/link")
    member.type, member.linkname = kind, "missing"
    return member


def pax(**headers: str) -> tarfile.TarInfo:
    member = tarfile.TarInfo("captures/one")
    member.pax_headers = {name.replace("_", "."): value for name, value in headers.items()}
    return member


def named(name: str, *, mtime: float = 0.0) -> tarfile.TarInfo:
    member = tarfile.TarInfo(name)
    member.mtime = mtime
    return member


EVIL_MEMBERS = {
    "a hard link": [link(tarfile.LNKTYPE)],
    "a symbolic link": [link(tarfile.SYMTYPE)],
    "a fifo": [link(tarfile.FIFOTYPE)],
    "a device": [link(tarfile.CHRTYPE)],
    "a folder": [link(tarfile.DIRTYPE)],
    "a sparse file of old GNU tar": [link(tarfile.GNUTYPE_SPARSE)],
    "a sparse file of PAX 0.1": [pax(GNU_sparse_size="1099511627776", GNU_sparse_map="0,0")],
    "a sparse file of PAX with numbers that are none": [pax(GNU_sparse_size="1", GNU_sparse_map="x")],
    "a name twice": [named("a"), named("a")],
    "a file below a file": [named("a"), named("a/b")],
    "another spelling": [named("./a")],
    "a control character": [named("a\nb")],
    "a time beyond the calendar": [named("a", mtime=1e18)],
    "a size beyond the archive": [pax(size="1099511627776")],
}


@pytest.mark.parametrize("members", EVIL_MEMBERS.values(), ids=EVIL_MEMBERS.keys())
def test_what_no_backup_holds_is_refused_before_anything_is_written(
    members: list[tarfile.TarInfo], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    archive = tmp_path / "evil.tar"
    with tarfile.open(archive, "w", format=tarfile.PAX_FORMAT) as tar:
        for member in members:
            tar.addfile(member)
    monkeypatch.setattr(Path, "mkdir", lambda *_args, **_more: pytest.fail("something was written"))
    with pytest.raises(InvalidInput, match=r"evil\.tar is no backup, or was cut short"):
        restore(archive, tmp_path / "other", watch=SILENT)


def test_a_file_of_another_size_than_its_manifest_says_is_refused_before_anything_is_written(
    archive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def enlarge(document: dict[str, object]) -> None:
        files = document["files"]
        assert isinstance(files, list)
        files[0]["size"] += 1

    rewritten(archive, enlarge)
    monkeypatch.setattr(Path, "mkdir", lambda *_args, **_more: pytest.fail("something was written"))
    with pytest.raises(InvalidInput, match=f"{DATABASE}: .* bytes, by its manifest"):
        restore(archive, tmp_path / "other", watch=SILENT)


def test_a_backup_that_does_not_fit_is_refused_before_a_file_is_written(
    archive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shutil, "disk_usage", lambda _path: SimpleNamespace(free=1000))
    with pytest.raises(StorageFull, match="nothing was restored; free some space"):
        restore(archive, tmp_path / "other", watch=SILENT)
    assert not list(tmp_path.glob("*other*"))


def test_a_damaged_header_is_refused_and_never_met_by_another_error(
    archive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "sync", lambda: None)
    whole = archive.read_bytes()
    with tarfile.open(archive) as tar:
        heads = [member.offset for member in tar]
    draws = np.random.default_rng(2)
    for _ in range(50):
        content = bytearray(whole)
        head = int(draws.choice(heads))
        for place in draws.integers(0, 500, size=int(draws.integers(1, 4))):
            content[head + place] = draws.integers(256)
        block = content[head : head + 512]
        block[148:156] = b" " * 8  # the check sum of the header, so that what is damaged gets past it
        content[head + 148 : head + 156] = b"%06o\0 " % sum(block)
        archive.write_bytes(content)
        try:
            restore(archive, tmp_path / "other", watch=SILENT)
        except InvalidInput:
            assert not (tmp_path / "other").exists()
        else:  # a field that no backup depends on, such as the owner
            shutil.rmtree(tmp_path / "other")


def test_nothing_is_overwritten(data: Path, archive: Path, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="exists already; choose another name"):
        back_up(data, archive, created_utc="", watch=SILENT)
    with pytest.raises(InvalidInput, match="has something in it"):
        restore(archive, data, watch=SILENT)
    with pytest.raises(InvalidInput, match=f"is no data directory of a server: it has no {DATABASE}"):
        back_up(tmp_path, tmp_path / "new.tar", created_utc="", watch=SILENT)
    with pytest.raises(InvalidInput, match="does not exist"):
        restore(tmp_path / "nothing.tar", tmp_path / "other", watch=SILENT)


def test_what_is_cancelled_or_meets_a_full_disk_leaves_nothing(
    data: Path, archive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Cancelling(SilentProgress):
        def cancelled(self) -> bool:
            return True

    cancelled = Cancelling()
    before = sorted(tmp_path.iterdir())
    with pytest.raises(Cancelled):
        back_up(data, tmp_path / "new.tar", created_utc="", watch=cancelled)
    with pytest.raises(Cancelled):
        restore(archive, tmp_path / "other", watch=cancelled)

    def full(_fd: int = 0) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(StorageFull, match=r"the backup new\.tar .*the disk is full"):
        back_up(data, tmp_path / "new.tar", created_utc="", watch=SILENT)
    monkeypatch.setattr(os, "sync", full)
    with pytest.raises(StorageFull, match=r"the backup rig\.tar .*the disk is full"):
        restore(archive, tmp_path / "other", watch=SILENT)
    assert sorted(tmp_path.iterdir()) == before


def test_both_are_commands(data: Path, tmp_path: Path) -> None:
    archive, other = str(tmp_path / "rig.tar"), str(tmp_path / "other")
    made = CliRunner().invoke(app, ["backup", archive, "--data", str(data), "--json"])
    assert json.loads(made.output)["files"] == len(FILES) + 1
    told = CliRunner().invoke(app, ["restore", archive, "--data", other])
    assert f"{len(FILES) + 1} files" in told.output
    assert files_of(Path(other)) == FILES
    with pytest.raises(FoveaError, match="exists already"):
        CliRunner().invoke(app, ["backup", archive, "--data", str(data)], catch_exceptions=False)
    with tarfile.open(archive) as tar:
        manifest = tar.extractfile(MANIFEST)
        assert manifest is not None
        assert BackupManifest.model_validate_json(manifest.read()).revision is not None
