"""The recordings of a data directory: files by name, found by id; what was removed waits in the trash."""

import shutil
import threading
from dataclasses import dataclass, replace
from pathlib import Path

from foveacam_hardware.contract import FoveaError, InvalidInput
from foveacam_pipeline.capture.dataset import dataset_name
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.capture.recording.values import OLD_SUFFIX, SUFFIX
from foveacam_pipeline.storage.disk import disk_errors
from foveacam_server.errors import NotFound
from foveacam_server.recordings.contents import contents
from foveacam_server.recordings.notes import (
    RecordingNotes,
    id_without_notes,
    notes_path,
    read_notes,
    write_notes,
)
from foveacam_server.runtime.store import Document

RECORDINGS = "recordings"
TRASH = ".trash"
FILMS = ".films"
_Stamp = tuple[int, int, int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredRecording:
    """One recording on the disk. `contents`: what it holds; None when it cannot be read, for `trouble`."""

    path: Path
    notes: RecordingNotes
    size_bytes: int
    contents: Document | None
    removed: bool = False
    trouble: str = ""

    @property
    def id(self) -> str:
        """Its id."""
        return self.notes.id

    @property
    def name(self) -> str:
        """Its name, which is its file's."""
        return self.path.stem


class RecordingCollection:
    """Finds, removes and restores recordings; the files themselves are the record."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        self._lock = threading.Lock()
        self._known: dict[Path, tuple[_Stamp, StoredRecording]] = {}

    def new_file(self, name: str) -> Path:
        """Return the file of a new recording; raise InvalidInput for a name that is none, or is taken."""
        stem = dataset_name(name)
        if stem.casefold() in {path.stem.casefold() for path in _files(self.folder)}:
            raise InvalidInput(
                f"there is a recording {name!r} already; choose another name",
                asked=f"a recording named {name!r}",
                found="there is one already",
                remedy="choose another name",
            )
        return self.folder / f"{stem}{SUFFIX}"

    def every(self, *, but: Path | None = None) -> list[StoredRecording]:
        """Return all recordings, newest first; `but`: one that is being written."""
        return _newest_first([self._kept(path) for path in _files(self.folder) if path != but])

    def trash(self) -> list[StoredRecording]:
        """Return what was removed and can be restored, newest first."""
        homes = [home for home in (self.folder / TRASH).glob("*") if home.is_dir()]
        return _newest_first([self._kept(path, removed=True) for home in homes for path in _files(home)])

    def get(self, recording_id: str, *, but: Path | None = None) -> StoredRecording:
        """Return one recording by its id or raise NotFound."""
        return _by_id(self.every(but=but), recording_id, where="/api/v1/recordings")

    def describe(self, kept: StoredRecording, *, label: str) -> None:
        """Change the label."""
        write_notes(kept.path, replace(kept.notes, label=label))

    def remove(self, kept: StoredRecording) -> None:
        """Move a recording to the trash."""
        home = self.folder / TRASH / kept.id
        with disk_errors(f"removing recording {kept.name}", self.folder):
            home.mkdir(parents=True, exist_ok=True)
            _move(kept, home / kept.path.name)

    def restore(self, recording_id: str) -> StoredRecording:
        """Take a recording out of the trash, under its name, or one beside it where that is taken."""
        kept = _by_id(self.trash(), recording_id, where="/api/v1/recordings?removed=true")
        target, number = self.folder / kept.path.name, 2
        while target.exists():
            target = self.folder / f"{kept.name} ({number}){kept.path.suffix}"
            number += 1
        with disk_errors(f"restoring recording {kept.name}", self.folder):
            home = kept.path.parent
            _move(kept, target)
            home.rmdir()
        return self.get(recording_id)

    def empty_trash(self) -> int:
        """Delete for good what was removed; return how many."""
        removed = self.trash()
        for kept in removed:
            shutil.rmtree(kept.path.parent, ignore_errors=True)
            shutil.rmtree(self.films(kept.id), ignore_errors=True)
        return len(removed)

    def films(self, recording_id: str) -> Path:
        """Return the folder of films that were made of a recording."""
        return self.folder / FILMS / recording_id

    def _kept(self, path: Path, *, removed: bool = False) -> StoredRecording:
        """Return what a file holds, read anew only when it or its notes changed."""
        stamp = _stamp(path)
        with self._lock:
            known = self._known.get(path)
        if known is not None and known[0] == stamp:
            return known[1]
        notes = read_notes(path)
        held, trouble = _read(path)
        if notes is None:
            recorded = None if held is None else held["recorded"]
            notes = RecordingNotes(id=id_without_notes(path), created_utc=recorded or "")
        kept = StoredRecording(
            path=path, notes=notes, size_bytes=stamp[1], contents=held, removed=removed, trouble=trouble
        )
        with self._lock:
            self._known[path] = stamp, kept
        return kept


def _read(path: Path) -> tuple[Document | None, str]:
    try:
        with Recording(path) as recording:
            return contents(recording), ""
    except FoveaError as error:
        return None, str(error)


def _files(home: Path) -> list[Path]:
    return [
        path
        for path in home.iterdir()
        if path.suffix in (SUFFIX, OLD_SUFFIX) and not path.name.startswith(".") and path.is_file()
    ]


def _move(kept: StoredRecording, target: Path) -> None:
    """Rename a recording with its notes, which keep its id. Raise `OSError`, or as `write_notes`."""
    notes, moved = notes_path(kept.path), notes_path(target)
    moved.unlink(missing_ok=True)
    try:
        moved.hardlink_to(notes)  # takes no room: also on a full disk something can be thrown away
    except OSError:
        write_notes(target, kept.notes)
    kept.path.rename(target)
    notes.unlink(missing_ok=True)


def _newest_first(found: list[StoredRecording]) -> list[StoredRecording]:
    return sorted(found, key=lambda kept: kept.notes.created_utc, reverse=True)


def _by_id(found: list[StoredRecording], recording_id: str, *, where: str) -> StoredRecording:
    for kept in found:
        if kept.id == recording_id:
            return kept
    raise NotFound(
        f"there is no recording {recording_id}; see {where} for those there are", asked=recording_id
    )


def _stamp(path: Path) -> _Stamp:
    numbers: list[int] = []
    for one in (path, notes_path(path)):
        try:
            found = one.stat()
            numbers += [found.st_mtime_ns, found.st_size]
        except OSError:
            numbers += [0, 0]
    return numbers[0], numbers[1], numbers[2], numbers[3]
