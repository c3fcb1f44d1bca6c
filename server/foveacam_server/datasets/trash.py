"""The trash of a folder of items: removed items stay in it until they are restored or deleted for good.

An item is at `.trash/<id>/<name>`. After a power failure or a kill it is in one of the two places.
"""

import os
import shutil
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from foveacam_pipeline.storage.disk import disk_errors, rename_durably

TRASH = ".trash"
DELETING = ".deleting-"
"""Prefix of items that are being deleted, which are never listed or restored."""
Move = Callable[[Path, Path], object]


class Trash:
    """Moves the items of `folder` to its trash and back; `noun` names an item in errors.

    `taken`: whether an item has this path. `Move` renames an item with its companion files.
    """

    def __init__(self, folder: Path, *, noun: str, taken: Callable[[Path], bool] = os.path.lexists) -> None:
        self._folder, self._noun, self._taken = folder, noun, taken
        self._moving = threading.Lock()  # two moves must not choose the same free name

    @property
    def homes(self) -> list[Path]:
        """The folders of the trash: each is named by an id and holds the items removed under it."""
        found = (self._folder / TRASH).glob("*")
        return [home for home in found if home.is_dir() and not home.name.startswith(DELETING)]

    def put(self, path: Path, item_id: str, *, move: Move = Path.rename) -> None:
        """Move an item to the trash, with a number after its name if that is used there."""
        with self._move("removing", path):
            target = self._free_path(self._folder / TRASH / item_id / path.name, path)
            rename_durably(path, target, rename=move)

    def restore(self, path: Path, *, move: Move = Path.rename) -> Path:
        """Move an item out of the trash, with a number after its name if that is used; return its path."""
        with self._move("restoring", path):
            target = self._free_path(self._folder / path.name, path)
            rename_durably(path, target, rename=move)
            with suppress(OSError):  # another item may have been removed under the same id
                path.parent.rmdir()
        return target

    def delete(self, item_id: str) -> None:
        """Delete for good the items removed under an id, with leftovers of an interrupted deletion."""
        home = self._folder / TRASH / item_id
        with self._move("deleting", home):
            home.rename(home.with_name(f"{DELETING}{item_id}"))  # else a kill leaves half an item to restore
        for gone in home.parent.glob(f"{DELETING}*"):
            shutil.rmtree(gone, ignore_errors=True)

    @contextmanager
    def _move(self, doing: str, path: Path) -> Iterator[None]:
        with self._moving, disk_errors(f"{doing} {self._noun} {path.name}", self._folder):
            yield

    def _free_path(self, wanted: Path, item: Path) -> Path:
        """Return `wanted`, with a number after its name if that is used."""
        suffix = "" if item.is_dir() else wanted.suffix
        target, number = wanted, 2
        while self._taken(target):
            target = wanted.with_name(f"{wanted.name.removesuffix(suffix)} ({number}){suffix}")
            number += 1
        return target
