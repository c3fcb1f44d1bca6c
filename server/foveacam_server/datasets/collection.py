"""The datasets of a folder (captures or stills): found by id or name, moved to the trash and restored."""

import shutil
import threading
import unicodedata
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from foveacam_hardware.contract import Busy, FoveaError, InvalidInput
from foveacam_pipeline.capture.dataset import Dataset, dataset_name
from foveacam_pipeline.capture.dataset.document import DOCUMENT
from foveacam_pipeline.capture.dataset.journal import JOURNAL
from foveacam_pipeline.capture.dataset.lock import is_being_written
from foveacam_pipeline.capture.dataset.reader import DatasetPoint
from foveacam_pipeline.storage.disk import check_name
from foveacam_server.datasets.trash import Trash
from foveacam_server.foundation.errors import NotFound

CAPTURES = "captures"
CAPTURES_URL = "/api/v1/captures"
PICTURES = ".pictures"
_Stamp = tuple[int, int, int, int, bool]


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredCapture:
    """One capture on the disk. `trouble`: why it cannot be read; then `dataset` is None."""

    id: str
    folder: Path
    dataset: Dataset | None
    removed: bool = False
    trouble: str = ""

    @property
    def name(self) -> str:
        """The capture's name: its folder's name."""
        return self.folder.name


class DatasetCollection:
    """Lists, removes and restores captures; the folders are the only record of them."""

    def __init__(self, folder: Path, *, noun: str = "capture", url: str = CAPTURES_URL) -> None:
        self.folder = folder
        self._noun, self._url = noun, url
        folder.mkdir(parents=True, exist_ok=True)
        self._trash = Trash(folder, noun=noun)
        self._lock = threading.Lock()
        self._known: dict[Path, tuple[_Stamp, StoredCapture]] = {}
        self._on_delete: list[Callable[[str], None]] = []

    def on_delete(self, callback: Callable[[str], None]) -> None:
        """Call `callback` with the id of every capture that is deleted for good."""
        self._on_delete.append(callback)

    def new_folder(self, name: str) -> Path:
        """Return the folder for a new capture; raise `InvalidInput` for an invalid or used name."""
        path = self.folder / dataset_name(name)
        check_name(path, name=name)
        taken = {other.name.casefold() for other in self.folder.iterdir()}
        if path.name.casefold() in taken:
            raise InvalidInput(
                f"there is a {self._noun} {name!r} already",
                asked=f"a {self._noun} named {name!r}",
                found="there is one already",
                remedy=f"choose another name{self._or_resume}",
            )
        return path

    def every(self) -> list[StoredCapture]:
        """Return all captures, newest first."""
        found = [self._load(path) for path in sorted(self._folders(self.folder))]
        return _with_unique_ids(sorted(found, key=_created, reverse=True))

    def trash(self) -> list[StoredCapture]:
        """Return the captures in the trash, newest first."""
        found = [
            replace(self._load(path, removed=True), id=home.name)
            for home in self._trash.homes
            for path in self._folders(home)
        ]
        return sorted(found, key=_created, reverse=True)

    def get(self, capture_id: str) -> StoredCapture:
        """Return one capture by its id or raise `NotFound`."""
        return self._by_id(self.every(), capture_id, where=self._url)

    def named(self, name: str) -> StoredCapture:
        """Return one capture by its name or id, or raise `NotFound`."""
        wanted = unicodedata.normalize("NFC", name)
        for stored in self.every():
            if wanted in (stored.name, stored.id):
                return stored
        raise NotFound(f"there is no {self._noun} {name!r} in {self.folder}", asked=name)

    def remove(self, capture_id: str) -> StoredCapture:
        """Move a capture to the trash; raise `Busy` while any program writes it."""
        stored = self.get(capture_id)
        if is_being_written(stored.folder):
            raise Busy(
                f"{self._noun} {stored.name} is being written",
                asked=f"remove {self._noun} {stored.name}",
                found="a program is writing it",
                remedy="wait until it ends, or cancel it there",
            )
        self.put_in_trash(stored)
        return stored

    def put_in_trash(self, stored: StoredCapture) -> None:
        """Move a capture, which may be in another folder of this disk, to the trash of this collection."""
        self._trash.put(stored.folder, stored.id)

    def restore(self, capture_id: str) -> StoredCapture:
        """Restore a capture from the trash, with a number after its name if that is used."""
        stored = self._by_id(self.trash(), capture_id, where=f"the trash of {self._url}")
        target = self._trash.restore(stored.folder)
        return next(each for each in self.every() if each.folder == target)

    def empty_trash(self) -> int:
        """Delete the captures in the trash; return how many."""
        removed = self.trash()
        for capture_id in {stored.id for stored in removed}:
            self._trash.delete(capture_id)
            shutil.rmtree(self.pictures(capture_id), ignore_errors=True)
            for callback in self._on_delete:
                callback(capture_id)
        return len(removed)

    def pictures(self, capture_id: str) -> Path:
        """Return the folder of a capture's drawn pictures."""
        return self.folder / PICTURES / capture_id

    @property
    def _or_resume(self) -> str:
        return ", or resume that one" if self._noun == "capture" else ""

    def _by_id(self, found: list[StoredCapture], wanted: str, *, where: str) -> StoredCapture:
        for stored in found:
            if stored.id == wanted:
                return stored
        raise NotFound(f"there is no {self._noun} {wanted}; see {where} for those there are", asked=wanted)

    def _folders(self, home: Path) -> list[Path]:
        return [path for path in home.iterdir() if not path.name.startswith(".") and path.is_dir()]

    def _load(self, path: Path, *, removed: bool = False) -> StoredCapture:
        """Return the capture of a folder, read again only when the folder changed."""
        stamp = _stamp(path)
        with self._lock:
            known = self._known.get(path)
        if known is not None and known[0] == stamp:
            return known[1]
        try:
            dataset = Dataset.open(path)
            stored = StoredCapture(
                id=dataset.document.header.id, folder=path, dataset=dataset, removed=removed
            )
        except FoveaError as error:
            stored = StoredCapture(
                id=path.name, folder=path, dataset=None, removed=removed, trouble=str(error)
            )
        with self._lock:
            self._known[path] = stamp, stored
        return stored


def _with_unique_ids(captures: list[StoredCapture]) -> list[StoredCapture]:
    """Give copies of a capture, which share its id, their folder's name as id."""
    seen: set[str] = set()
    found = []
    for stored in captures:
        found.append(replace(stored, id=stored.name) if stored.id in seen else stored)
        seen.add(stored.id)
    return found


def _created(stored: StoredCapture) -> str:
    return "" if stored.dataset is None else stored.dataset.document.header.created_utc


def _stamp(path: Path) -> _Stamp:
    numbers = []
    for name in (DOCUMENT, JOURNAL):
        try:
            found = (path / name).stat()
            numbers += [found.st_mtime_ns, found.st_size]
        except OSError:
            numbers += [0, 0]
    return numbers[0], numbers[1], numbers[2], numbers[3], is_being_written(path)


def readable_dataset(stored: StoredCapture) -> Dataset:
    """Return the dataset of a capture; raise `InvalidInput` for a damaged one."""
    if stored.dataset is None:
        raise InvalidInput(f"capture {stored.name} cannot be read: {stored.trouble}")
    return stored.dataset


def brackets_of(dataset: Dataset | None) -> list[int]:
    """Return the indices of the exposures of which any camera has frames."""
    return sorted({frame.bracket for point in dataset or () for frame in point.frames})


def point_of(stored: StoredCapture, index: int) -> DatasetPoint:
    """Return a point by its number in the plan; raise `InvalidInput` when it was not captured."""
    dataset = readable_dataset(stored)
    point = next((point for point in dataset if point.index == index), None)
    if point is None:
        raise InvalidInput(
            f"capture {stored.name}: point {index} was asked for, it has {len(dataset)} points of"
            f" {dataset.document.header.points}; ask for one that was taken"
        )
    return point
