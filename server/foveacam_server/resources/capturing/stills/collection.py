"""The stills of a data directory: held (waiting for a decision), kept, and in the trash.

Their pictures are drawn on request and cached on the disk.
"""

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from enum import StrEnum
from pathlib import Path
from typing import TypeVar

from foveacam_hardware.contract import Busy, Frame, InvalidInput, Role
from foveacam_pipeline.capture.dataset import DatasetPoint, ImageCodec, dataset_name
from foveacam_pipeline.capture.dataset.images import encode
from foveacam_pipeline.capture.dataset.lock import is_being_written
from foveacam_pipeline.storage.archive import read_stored
from foveacam_pipeline.storage.disk import disk_errors, rename_durably, write_file
from foveacam_server.datasets.collection import DatasetCollection, StoredCapture, point_of
from foveacam_server.datasets.drawings import frame_picture
from foveacam_server.foundation.errors import NotFound

STILLS = "stills"
HELD = ".held"
URL = "/api/v1/stills"
MOST_HELD = 8
"""Most stills that wait for a decision; further ones are refused."""
PREVIEW = "jpg"

T = TypeVar("T")


class StillState(StrEnum):
    """State of a still."""

    HELD = "held"
    """On the disk, neither kept nor discarded yet."""
    KEPT = "kept"
    REMOVED = "removed"
    """In the trash."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredStill:
    """One still and its state."""

    stored: StoredCapture
    state: StillState


class StillCollection:
    """Lists, keeps, removes and restores stills; a still is a folder, whose parent folder gives its state."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._kept = DatasetCollection(folder, noun="still", url=URL)
        self._held = DatasetCollection(folder / HELD, noun="still", url=URL)
        self._clear_leftovers()

    def every(self, state: StillState) -> list[StoredStill]:
        """Return the stills of one state, newest first."""
        found: dict[StillState, Callable[[], list[StoredCapture]]] = {
            StillState.HELD: self._held.every,
            StillState.KEPT: self._kept.every,
            StillState.REMOVED: self._kept.trash,
        }
        return [StoredStill(stored=kept, state=state) for kept in found[state]()]

    def get(self, still_id: str) -> StoredStill:
        """Return one held or kept still by its id, or raise `NotFound`."""
        for state in (StillState.HELD, StillState.KEPT):
            for found in self.every(state):
                if found.stored.id == still_id:
                    return found
        raise NotFound(f"there is no still {still_id}; see {URL} for those there are", asked=still_id)

    def read(self, still_id: str, read: Callable[[StoredStill], T]) -> T:
        """Return `read` of a still; read again if the still was moved meanwhile because it was kept."""
        found = self.get(still_id)
        try:
            return read(found)
        except (InvalidInput, FileNotFoundError):
            moved = self.get(still_id)
            if moved.stored.folder == found.stored.folder:
                raise
            return read(moved)

    def new_folder(self, name: str | None, *, waits: bool = True) -> Path:
        """Return the folder for a new still; None: named by the time. `waits`: it waits for a decision.

        Raise `InvalidInput` for an invalid or used name, `Busy` while too many wait for a decision.
        """
        waiting = len(self.every(StillState.HELD))
        if waits and waiting >= MOST_HELD:
            raise Busy(
                f"take a still: {waiting} wait to be kept or discarded",
                asked="take a still",
                found=f"{waiting} that were neither kept nor discarded",
                remedy="keep or discard some first",
            )
        if name is None:
            name = self._free_name(datetime.now(UTC).strftime("still %Y-%m-%d %H-%M-%S"))
        self._kept.new_folder(name)
        return self._held.new_folder(name)

    def keep(self, still_id: str, *, name: str | None = None) -> StoredStill:
        """Move a held still to the kept ones, under another name if one is given."""
        found = self.get(still_id)
        if found.state is StillState.KEPT:
            raise InvalidInput(
                asked=f"keep still {found.stored.name}",
                found="it is kept already",
                remedy="nothing is left to do",
            )
        folder = found.stored.folder
        target = self._kept.new_folder(folder.name if name is None else dataset_name(name))
        with disk_errors(f"keeping still {folder.name}", self.folder):
            rename_durably(folder, target)
        return self.get(still_id)

    def remove(self, still_id: str) -> StoredCapture:
        """Move a held or kept still to the trash."""
        found = self.get(still_id)
        if found.state is StillState.KEPT:
            return self._kept.remove(still_id)
        self._kept.put_in_trash(found.stored)
        return found.stored

    def restore(self, still_id: str) -> StoredStill:
        """Restore a still from the trash to the kept ones."""
        return StoredStill(stored=self._kept.restore(still_id), state=StillState.KEPT)

    def empty_trash(self) -> int:
        """Delete the stills in the trash; return how many."""
        return self._kept.empty_trash()

    def pictures(self, still_id: str) -> Path:
        """Return the folder of a still's drawn pictures."""
        return self._kept.pictures(still_id)

    @property
    def drawn(self) -> DatasetCollection:
        """The kept stills, with the folders of drawn pictures."""
        return self._kept

    def _free_name(self, wanted: str) -> str:
        """Return the name, with a number appended if it is used."""
        taken = {
            found.stored.name for state in (StillState.HELD, StillState.KEPT) for found in self.every(state)
        }
        name, number = wanted, 2
        while name in taken:
            name, number = f"{wanted} ({number})", number + 1
        return name

    def _clear_leftovers(self) -> None:
        """Delete the empty stills that killed programs left."""
        for found in self.every(StillState.HELD):
            dataset, folder = found.stored.dataset, found.stored.folder
            if dataset is not None and not len(dataset) and not is_being_written(folder):
                shutil.rmtree(folder, ignore_errors=True)


def still_picture(
    collection: StillCollection, found: StoredStill, camera: Role, *, form: str, frame: int | None
) -> Path:
    """Return the path of one camera's picture: `jpg` with 8 bits, `png` or `tiff` with full depth.

    `frame`: one of the stack, from 0, if all were stored; None: the mean, or the only one.
    """
    point = point_of(found.stored, 0)
    whole = _stored_file(point, camera, form=form, frame=frame)
    if whole is not None and (found.stored.folder / whole).exists():
        return found.stored.folder / whole
    name = f"{camera.value}-mean.{form}" if frame is None else f"{camera.value}-{frame}.{form}"
    path = collection.pictures(found.stored.id) / name
    if path.exists():
        return path
    if whole is not None:  # its files are only in the archive
        content = memoryview(read_stored(found.stored.folder, whole))
    else:
        taken = point.stacked(camera) if frame is None else point.frame(camera, stack=frame)
        content = _encoded(taken, form)
    with disk_errors(f"a picture of still {found.stored.name}", collection.folder):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_file(path, content)
    return path


def _stored_file(point: DatasetPoint, camera: Role, *, form: str, frame: int | None) -> str | None:
    """Return the still's stored file of this picture; None without one."""
    files = [stored for stored in point.frames if stored.role is camera]
    wanted = [stored for stored in files if stored.stack == frame] if frame is not None else files
    if form == PREVIEW or len(wanted) != 1:
        return None
    return wanted[0].file if wanted[0].file.endswith(f".{form}") else None


def _encoded(frame: Frame, form: str) -> memoryview:
    if form != PREVIEW:
        return encode(frame.image, ImageCodec(form))
    return memoryview(frame_picture(frame, form=PREVIEW))
