"""The captures of a data directory: folders by name, found by id; what was removed waits in the trash."""

import shutil
import threading
import unicodedata
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from foveacam_hardware.contract import Busy, FoveaError, InvalidInput
from foveacam_pipeline.capture.dataset import Dataset, dataset_name
from foveacam_pipeline.capture.dataset.document import DOCUMENT
from foveacam_pipeline.capture.dataset.journal import JOURNAL
from foveacam_pipeline.capture.dataset.lock import is_being_written
from foveacam_pipeline.storage.disk import disk_errors
from foveacam_server.capturing.mosaic_collection import MosaicCollection
from foveacam_server.errors import NotFound

CAPTURES = "captures"
TRASH = ".trash"
PICTURES = ".pictures"
MOSAICS = ".mosaics"
_Stamp = tuple[int, int, int, int, bool]


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredCapture:
    """One capture as it lies on the disk. `trouble`: why it cannot be read; then there is no dataset."""

    id: str
    folder: Path
    dataset: Dataset | None
    removed: bool = False
    trouble: str = ""

    @property
    def name(self) -> str:
        """Its name, which is its folder's."""
        return self.folder.name


class CaptureCollection:
    """Finds, removes and restores captures; the folders themselves are the record."""

    def __init__(self, folder: Path, *, noun: str = "capture", url: str = "/api/v1/captures") -> None:
        self.folder = folder
        self._noun, self._url = noun, url
        folder.mkdir(parents=True, exist_ok=True)
        self._lock = threading.Lock()
        self._known: dict[Path, tuple[_Stamp, StoredCapture]] = {}

    def new_folder(self, name: str) -> Path:
        """Return the folder for a new capture; raise InvalidInput for a name that is none, or is taken."""
        path = self.folder / dataset_name(name)
        taken = {other.name.casefold() for other in self.folder.iterdir()}
        if path.name.casefold() in taken:
            raise InvalidInput(
                f"there is a {self._noun} {name!r} already; choose another name{self._or_resume}",
                asked=f"a {self._noun} named {name!r}",
                found="there is one already",
                remedy=f"choose another name{self._or_resume}",
            )
        return path

    def every(self) -> list[StoredCapture]:
        """Return all captures, newest first."""
        found = [self._kept(path) for path in sorted(self._folders(self.folder))]
        return _told_apart(sorted(found, key=_created, reverse=True))

    def trash(self) -> list[StoredCapture]:
        """Return what was removed and can be restored, newest first."""
        homes = [home for home in (self.folder / TRASH).glob("*") if home.is_dir()]
        found = [
            replace(self._kept(path, removed=True), id=home.name)
            for home in homes
            for path in self._folders(home)
        ]
        return sorted(found, key=_created, reverse=True)

    def get(self, capture_id: str) -> StoredCapture:
        """Return one capture by its id or raise NotFound."""
        return self._by_id(self.every(), capture_id, where=self._url)

    def named(self, name: str) -> StoredCapture:
        """Return one capture by its name or its id, or raise NotFound."""
        wanted = unicodedata.normalize("NFC", name)
        for kept in self.every():
            if wanted in (kept.name, kept.id):
                return kept
        raise NotFound(f"there is no {self._noun} {name!r} in {self.folder}", asked=name)

    def remove(self, capture_id: str) -> StoredCapture:
        """Move a capture to the trash; raise `Busy` while any program writes it."""
        kept = self.get(capture_id)
        if is_held(kept.folder):
            raise Busy(
                f"{self._noun} {kept.name} is being written; wait until it ends, or cancel it there",
                asked=f"remove {self._noun} {kept.name}",
                found="a program is writing it",
                remedy="wait until it ends, or cancel it there",
            )
        home = self.folder / TRASH / kept.id
        with disk_errors(f"removing {self._noun} {kept.name}", self.folder):
            home.mkdir(parents=True, exist_ok=True)
            kept.folder.rename(home / kept.name)
        return kept

    def restore(self, capture_id: str) -> StoredCapture:
        """Take a capture out of the trash again, under its name, or one beside it where that is taken."""
        kept = self._by_id(self.trash(), capture_id, where=f"the trash of {self._url}")
        target = self.folder / kept.name
        number = 2
        while target.exists():
            target = self.folder / f"{kept.name} ({number})"
            number += 1
        with disk_errors(f"restoring {self._noun} {kept.name}", self.folder):
            home = kept.folder.parent
            kept.folder.rename(target)
            with suppress(OSError):  # a copy of it may have come after it
                home.rmdir()
        return next(each for each in self.every() if each.folder == target)

    def empty_trash(self) -> int:
        """Delete for good what was removed; return how many."""
        removed = self.trash()
        for kept in removed:
            shutil.rmtree(kept.folder.parent, ignore_errors=True)
            shutil.rmtree(self.pictures(kept.id), ignore_errors=True)
            MosaicCollection(self.folder / MOSAICS).remove(kept.id)
        return len(removed)

    def pictures(self, capture_id: str) -> Path:
        """Return the folder of pictures that were drawn of a capture."""
        return self.folder / PICTURES / capture_id

    @property
    def _or_resume(self) -> str:
        return ", or resume that one" if self._noun == "capture" else ""

    def _by_id(self, found: list[StoredCapture], wanted: str, *, where: str) -> StoredCapture:
        for kept in found:
            if kept.id == wanted:
                return kept
        raise NotFound(f"there is no {self._noun} {wanted}; see {where} for those there are", asked=wanted)

    def _folders(self, home: Path) -> list[Path]:
        return [path for path in home.iterdir() if not path.name.startswith(".") and path.is_dir()]

    def _kept(self, path: Path, *, removed: bool = False) -> StoredCapture:
        """Return what lies in a folder, read anew only when it changed."""
        stamp = _stamp(path)
        with self._lock:
            known = self._known.get(path)
        if known is not None and known[0] == stamp:
            return known[1]
        try:
            dataset = Dataset.open(path)
            kept = StoredCapture(id=dataset.document.header.id, folder=path, dataset=dataset, removed=removed)
        except FoveaError as error:
            kept = StoredCapture(id=path.name, folder=path, dataset=None, removed=removed, trouble=str(error))
        with self._lock:
            self._known[path] = stamp, kept
        return kept


def _told_apart(captures: list[StoredCapture]) -> list[StoredCapture]:
    """Name copies of a folder, which hold its id as well, by their own folders."""
    seen: set[str] = set()
    found = []
    for kept in captures:
        found.append(replace(kept, id=kept.name) if kept.id in seen else kept)
        seen.add(kept.id)
    return found


def _created(kept: StoredCapture) -> str:
    return "" if kept.dataset is None else kept.dataset.document.header.created_utc


def _stamp(path: Path) -> _Stamp:
    numbers = []
    for name in (DOCUMENT, JOURNAL):
        try:
            found = (path / name).stat()
            numbers += [found.st_mtime_ns, found.st_size]
        except OSError:
            numbers += [0, 0]
    return numbers[0], numbers[1], numbers[2], numbers[3], is_being_written(path)
