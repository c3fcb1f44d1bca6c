"""The recordings of a data directory: one file each, found by id; removed ones are in the trash."""

import errno
import os
import re
import shutil
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from pydantic import BaseModel, ValidationError

from foveacam_hardware.contract import FoveaError, InvalidInput
from foveacam_pipeline.capture.dataset import dataset_name
from foveacam_pipeline.capture.recording.reader import Recording, archive_record_path
from foveacam_pipeline.capture.recording.session import STATISTICS
from foveacam_pipeline.capture.recording.values import OLD_SUFFIX, SUFFIX
from foveacam_pipeline.storage.archive import RECORD, read_record
from foveacam_pipeline.storage.disk import check_name, disk_errors, disk_fault
from foveacam_server.datasets.trash import Trash
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.names import new_id, utc_now
from foveacam_server.resources.capturing.recordings.information import contents_of
from foveacam_server.resources.capturing.recordings.notes import (
    RecordingNotes,
    id_without_notes,
    layout_path,
    notes_path,
    read_notes,
    write_notes,
)
from foveacam_server.resources.capturing.recordings.schema import RecordingContents, StreamCounts

RECORDINGS = "recordings"
FILMS = ".films"
NUMBER = re.compile(r"[0-9]{4,9}")
"""The number at the end of a numbered recording's name."""
_Stamp = tuple[int, int, int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredRecording:
    """One recording on the disk.

    `contents`: None when it cannot be read, because of `trouble`. `counts`: its recorder's counts by stream;
    empty in a recording that was cut off.
    """

    path: Path
    notes: RecordingNotes
    size_bytes: int
    contents: RecordingContents | None
    counts: dict[str, StreamCounts] = field(default_factory=dict)
    removed: bool = False
    trouble: str = ""

    @property
    def id(self) -> str:
        """The recording's id."""
        return self.notes.id

    @property
    def name(self) -> str:
        """The recording's name: its file's stem."""
        return self.path.stem


class RecordingCollection:
    """Lists, removes and restores recordings; the files are the only record of them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        self._trash = Trash(folder, noun="recording", taken=_is_taken)
        self._lock = threading.Lock()
        self._known: dict[Path, tuple[_Stamp, StoredRecording]] = {}

    def new_file(self, name: str, *, numbered: bool = False) -> Path:
        """Return the path for a new recording; raise `InvalidInput` for an invalid or used name.

        `numbered`: the first free number of at least four digits follows the name.
        """
        used = {path.stem.casefold() for path in _files(self.folder)}
        stem = dataset_name(_numbered(name, used) if numbered else name)
        if stem.casefold() in used:
            raise InvalidInput(
                f"there is a recording {name!r} already",
                asked=f"a recording named {name!r}",
                found="there is one already",
                remedy="choose another name",
            )
        path = self.folder / f"{stem}{SUFFIX}"
        check_name(path, name=name)
        return path

    def check_writable(self) -> None:
        """Raise `StorageFull` when no file can be made in the folder."""
        if not os.access(self.folder, os.W_OK | os.X_OK):
            raise disk_fault(
                OSError(errno.EACCES, os.strerror(errno.EACCES)), what="a recording", folder=self.folder
            )

    def add(self, file: Path, *, name: str) -> StoredRecording:
        """Move a file of this disk to the recordings; raise `InvalidInput` for one that holds no frames."""
        return self._adopt(file, name, lambda path: file.rename(path))

    def link(self, file: Path, *, name: str) -> StoredRecording:
        """Add a recording whose file stays in its folder; raise as `add`."""
        return self._adopt(file, name, lambda path: path.symlink_to(file))

    def every(self, *, but: Path | None = None) -> list[StoredRecording]:
        """Return all recordings except `but`, which is being written; newest first."""
        return _newest_first([self._load(path) for path in _files(self.folder) if path != but])

    def trash(self) -> list[StoredRecording]:
        """Return the recordings in the trash, newest first."""
        return _newest_first(
            [self._load(path, removed=True) for home in self._trash.homes for path in _files(home)]
        )

    def get(self, recording_id: str, *, but: Path | None = None) -> StoredRecording:
        """Return one recording by its id or raise `NotFound`."""
        return _by_id(self.every(but=but), recording_id, where="/api/v1/recordings")

    def set_label(self, stored: StoredRecording, *, label: str) -> None:
        """Change a recording's label."""
        write_notes(stored.path, stored.notes.model_copy(update={"label": label}))

    def remove(self, stored: StoredRecording) -> None:
        """Move a recording to the trash."""
        self._trash.put(stored.path, stored.id, move=partial(_move, notes_of=stored))

    def restore(self, recording_id: str) -> StoredRecording:
        """Restore a recording from the trash, with a number after its name if that is used."""
        stored = _by_id(self.trash(), recording_id, where="/api/v1/recordings?removed=true")
        self._trash.restore(stored.path, move=partial(_move, notes_of=stored))
        return self.get(recording_id)

    def empty_trash(self) -> int:
        """Delete the recordings in the trash; return how many."""
        removed = self.trash()
        for home in {stored.path.parent for stored in removed}:
            self._trash.delete(home.name)
            shutil.rmtree(self.films(home.name), ignore_errors=True)
        return len(removed)

    def films(self, recording_id: str) -> Path:
        """Return the folder of a recording's films."""
        return self.folder / FILMS / recording_id

    def _adopt(self, file: Path, name: str, place: Callable[[Path], object]) -> StoredRecording:
        """Check a file, put it in its place, and return it without reading it again."""
        held, counts, trouble = _read(file)
        if held is None:
            raise InvalidInput(f"recording {name}: {trouble}", found=trouble, remedy="choose a recording")
        _check_frames(file, held, name=name)
        path = self.new_file(name)
        with disk_errors(f"adding recording {name}", self.folder):
            place(path)
        notes = RecordingNotes(id=new_id("rec"), created_utc=held.recorded or utc_now())
        write_notes(path, notes)
        stamp, moved = _stamp(path), held.model_copy(update={"file": str(path)})
        stored = StoredRecording(path=path, notes=notes, size_bytes=stamp[1], contents=moved, counts=counts)
        return self._remember(stamp, stored)

    def _load(self, path: Path, *, removed: bool = False) -> StoredRecording:
        """Return the recording of a file, read again only when it or its notes changed."""
        stamp = _stamp(path)
        with self._lock:
            known = self._known.get(path)
        if known is not None and known[0] == stamp:
            return known[1]
        notes = read_notes(path)
        held, counts, trouble = _read(path)
        if notes is None:
            recorded = None if held is None else held.recorded
            notes = RecordingNotes(id=id_without_notes(path), created_utc=recorded or "")
        stored = StoredRecording(
            path=path,
            notes=notes,
            size_bytes=stamp[1] if held is None else held.bytes,
            contents=held,
            counts=counts,
            removed=removed,
            trouble=trouble,
        )
        return self._remember(stamp, stored)

    def _remember(self, stamp: _Stamp, stored: StoredRecording) -> StoredRecording:
        with self._lock:
            self._known[stored.path] = stamp, stored
        return stored


def _numbered(name: str, used: set[str]) -> str:
    """Return the name with the number after the highest that is used with it."""
    before = f"{name} ".lstrip().casefold()
    numbers = [stem.removeprefix(before) for stem in used if stem.startswith(before)]
    highest = max((int(number) for number in numbers if NUMBER.fullmatch(number)), default=0)
    return f"{name} {highest + 1:04d}".lstrip()


def _check_frames(file: Path, held: RecordingContents, *, name: str) -> None:
    """Raise `InvalidInput`, naming the channels, for a recording without frames."""
    if any(stream.frames for stream in held.streams.values()):
        return
    with Recording(file) as recording:
        found = ", ".join(recording.topics) or "no channel"
    raise InvalidInput(
        f"recording {name}: it holds no frame of a camera; its channels are: {found}",
        asked="a recording of cameras",
        found=found,
        remedy="choose a file that foveacam or the authors' application recorded",
    )


def _counts(record: Mapping[str, str]) -> dict[str, StreamCounts]:
    """Return the counts of a recorder's statistics, as far as they can be read."""
    found = {}
    for stream, text in record.items():
        with suppress(ValidationError):
            found[stream] = StreamCounts.model_validate_json(text)
    return found


class _AboutRecording(BaseModel):
    """The archive's record of a recording."""

    contents: RecordingContents
    counts: dict[str, StreamCounts]


def _read(path: Path) -> tuple[RecordingContents | None, dict[str, StreamCounts], str]:
    """Return the contents and the recorder's counts of a file, or why it cannot be read.

    For a file that is only in the archive they are read from its local record, so that it is listed without
    the archive.
    """
    archived = None if path.exists() else read_record(archive_record_path(path))
    if archived is not None:
        with suppress(ValidationError):
            about = _AboutRecording.model_validate(archived.manifest.about)
            return about.contents.model_copy(update={"file": str(path)}), about.counts, ""
    try:
        with Recording(path) as recording:
            return contents_of(recording), _counts(recording.metadata.get(STATISTICS, {})), ""
    except FoveaError as error:
        return None, {}, str(error)


def _files(home: Path) -> list[Path]:
    archived = {path.with_name(path.name.removesuffix(f".{RECORD}")) for path in home.glob(f"*.{RECORD}")}
    here = {path for path in home.iterdir() if path.is_file() or path.is_symlink()}
    return [  # a link to a missing file is listed with that fault
        path
        for path in here | archived
        if path.suffix in (SUFFIX, OLD_SUFFIX) and not path.name.startswith(".")
    ]


def _is_taken(path: Path) -> bool:
    return os.path.lexists(path) or archive_record_path(path).exists()


def _move(path: Path, target: Path, *, notes_of: StoredRecording) -> None:
    """Rename a recording with its notes, which keep its id. Raise `OSError`, or as `write_notes`."""
    notes, moved = notes_path(path), notes_path(target)
    moved.unlink(missing_ok=True)
    try:
        moved.hardlink_to(notes)  # needs no space, so works on a full disk
    except OSError:
        write_notes(target, notes_of.notes)
    with suppress(FileNotFoundError):
        archive_record_path(path).rename(archive_record_path(target))
    if os.path.lexists(path):  # otherwise the file is only in the archive
        path.rename(target)
    notes.unlink(missing_ok=True)
    with suppress(FileNotFoundError):
        layout_path(path).rename(layout_path(target))


def _newest_first(found: list[StoredRecording]) -> list[StoredRecording]:
    return sorted(found, key=lambda stored: stored.notes.created_utc, reverse=True)


def _by_id(found: list[StoredRecording], recording_id: str, *, where: str) -> StoredRecording:
    for stored in found:
        if stored.id == recording_id:
            return stored
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
