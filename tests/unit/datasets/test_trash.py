import os
import shutil
import threading
from pathlib import Path

import pytest

from foveacam_hardware.contract import DeviceFault, StorageFull
from foveacam_pipeline.storage import disk
from foveacam_server.datasets.trash import Trash

PATIENCE_S = 10.0


class Killed(BaseException):
    """Ends a program between two steps."""


def item(folder: Path, name: str, content: str = "") -> Path:
    path = folder / name
    path.mkdir(parents=True)
    (path / "content").write_text(content)
    return path


def contents(trash: Trash) -> dict[str, list[str]]:
    """Return what the items of each id hold."""
    return {
        home.name: sorted((path / "content").read_text() for path in home.iterdir()) for home in trash.homes
    }


def test_an_item_is_restored_as_it_was(tmp_path: Path) -> None:
    trash = Trash(tmp_path, noun="item")
    trash.put(item(tmp_path, "one", "first"), "id-1")
    assert contents(trash) == {"id-1": ["first"]}
    restored = trash.restore(trash.homes[0] / "one")
    assert (restored, (restored / "content").read_text()) == (tmp_path / "one", "first")
    assert trash.homes == []


def test_nothing_is_overwritten_in_the_trash_nor_beside_it(tmp_path: Path) -> None:
    trash = Trash(tmp_path, noun="item")
    for content in ("first", "second"):  # a copy of an item has its id
        trash.put(item(tmp_path, "one", content), "id-1")
    assert contents(trash) == {"id-1": ["first", "second"]}
    item(tmp_path, "one", "third")
    for path in sorted(trash.homes[0].iterdir()):
        trash.restore(path)
    found = {path.parent.name: path.read_text() for path in tmp_path.glob("*/content")}
    assert found == {"one": "third", "one (2)": "first", "one (2) (2)": "second"}


def test_the_number_of_a_used_name_stands_before_a_file_s_suffix(tmp_path: Path) -> None:
    trash = Trash(tmp_path, noun="file")
    for _ in range(2):
        (tmp_path / "a.b.fcap").touch()
        trash.put(tmp_path / "a.b.fcap", "id-1")
    assert {path.name for path in trash.homes[0].iterdir()} == {"a.b.fcap", "a.b (2).fcap"}


def test_items_that_are_restored_at_once_get_names_of_their_own(tmp_path: Path) -> None:
    trash = Trash(tmp_path, noun="file")
    for number in range(8):
        (tmp_path / "one.fcap").write_text(str(number))
        trash.put(tmp_path / "one.fcap", f"id-{number}")
    threads = [threading.Thread(target=trash.restore, args=(home / "one.fcap",)) for home in trash.homes]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(PATIENCE_S)
    assert sorted(path.read_text() for path in tmp_path.glob("*.fcap")) == [str(n) for n in range(8)]


def test_a_move_that_is_cut_short_leaves_the_item_where_it_was(tmp_path: Path) -> None:
    trash, path = Trash(tmp_path, noun="item"), item(tmp_path, "one", "first")

    def killed_before(_path: Path, _target: Path) -> None:
        raise Killed

    with pytest.raises(Killed):
        trash.put(path, "id-1", move=killed_before)
    assert (path / "content").read_text() == "first"
    assert contents(trash) == {"id-1": []}
    trash.put(path, "id-1")
    assert contents(trash) == {"id-1": ["first"]}


def test_a_move_is_durable_in_both_folders_when_it_returns(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    synced: list[Path] = []
    monkeypatch.setattr(disk, "sync_folder", synced.append)
    trash = Trash(tmp_path, noun="item")
    trash.put(item(tmp_path, "one"), "id-1")
    home = trash.homes[0]
    trash.restore(home / "one")
    assert synced == [home, tmp_path, tmp_path, home]


def test_a_deletion_that_is_cut_short_leaves_nothing_to_restore_and_is_ended_by_the_next(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    trash = Trash(tmp_path, noun="item")
    for number in (1, 2):
        trash.put(item(tmp_path, f"item {number}"), f"id-{number}")

    def killed(_path: Path, *, ignore_errors: bool) -> None:
        raise Killed

    with monkeypatch.context() as patched:
        patched.setattr(shutil, "rmtree", killed)
        with pytest.raises(Killed):
            trash.delete("id-1")
    assert list(contents(trash)) == ["id-2"]
    trash.delete("id-2")
    assert list((tmp_path / ".trash").iterdir()) == []


@pytest.mark.parametrize(("number", "error"), [(30, StorageFull), (28, StorageFull), (5, DeviceFault)])
def test_what_the_disk_refuses_is_told_and_the_item_stays(
    number: int, error: type[Exception], tmp_path: Path
) -> None:
    trash, path = Trash(tmp_path, noun="item"), item(tmp_path, "one", "first")

    def refuse(_path: Path, _target: Path) -> None:
        raise OSError(number, os.strerror(number))

    with pytest.raises(error, match="removing item one"):
        trash.put(path, "id-1", move=refuse)
    assert (path / "content").read_text() == "first"
