"""Writes a dataset so that it survives anything: what was acknowledged is on the disk, whole, and stays.

    with DatasetWriter.create(folder, Header(points=81, calibration=calibration)) as writer:
        while writer.next_point < 81:
            writer.add(Point(place=..., shots=(Shot(frame=left), Shot(frame=right), Shot(frame=wide))))
        writer.finish()

`add` only hands over; encoding and the disk have threads of their own.
"""

import logging
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from foveacam_hardware.contract import DeviceFault, FoveaError, InvalidInput, StorageFull
from foveacam_pipeline.capture.dataset.document import (
    DOCUMENT,
    DatasetDocument,
    DatasetHeader,
    new_document,
    read_document,
    write_document,
)
from foveacam_pipeline.capture.dataset.index import write_index
from foveacam_pipeline.capture.dataset.journal import JournalContent, read_journal
from foveacam_pipeline.capture.dataset.lock import FolderLock
from foveacam_pipeline.capture.dataset.point_queue import PointQueue
from foveacam_pipeline.capture.dataset.point_store import (
    IMAGES,
    BegunPoint,
    PointStore,
    remove_unacknowledged,
)
from foveacam_pipeline.capture.dataset.values import (
    CapturedPoint,
    DatasetState,
    PlanPosition,
    PointRecord,
    WriterProgress,
    checked_point,
)
from foveacam_pipeline.storage.disk import disk_errors, sync_folder

logger = logging.getLogger(__name__)

RESUME = "then resume: what was acknowledged is safe"


@dataclass(frozen=True, slots=True, kw_only=True)
class WriterSettings:
    """How a writer works. `depth`: points that may wait for the disk. `encoders`: threads that make files.

    `on_kept(index)` is called on the writer's thread when a point is acknowledged. `again`: what is to be
    done once a disk that refused is mended.
    """

    depth: int = 2
    encoders: int = 2
    on_kept: Callable[[int], None] | None = None
    again: str = RESUME


DEFAULT = WriterSettings()


class DatasetWriter:
    """A dataset that is being written; made by `create` or `resume`, ended by `finish` or `close`."""

    def __init__(
        self, folder: Path, document: DatasetDocument, lock: FolderLock, settings: WriterSettings
    ) -> None:
        """Take over a folder that is locked. Raise OSError."""
        self._folder, self._document, self._lock = folder, document, lock
        journal = _prepared(folder, document)
        self._records = list(journal.records)
        self._next = len(self._records)
        self._ended = False
        self._again = settings.again
        header = document.header
        self._store = PointStore(
            folder,
            journal,
            codec=header.codec,
            calibration=header.calibration,
            encoders=settings.encoders,
        )
        self._keeper = _Keeper(
            folder=folder,
            store=self._store,
            records=self._records,
            on_kept=settings.on_kept,
            again=settings.again,
        )
        self._hand_over = PointQueue(self._keeper, depth=settings.depth)

    @classmethod
    def create(cls, folder: Path, header: DatasetHeader, settings: WriterSettings = DEFAULT) -> Self:
        """Begin a dataset in a folder that does not exist, or is empty."""
        document = new_document(header)
        if folder.exists() and any(not path.name.startswith(".") for path in folder.iterdir()):
            raise InvalidInput(
                f"{folder} holds files already; give another name, or resume the dataset that it holds"
            )
        is_new = not folder.exists()
        with disk_errors(f"dataset {folder.name}", folder.parent):
            folder.mkdir(parents=True, exist_ok=True)
            sync_folder(folder.parent)
        try:
            return cls._open(folder, document, settings)
        except (StorageFull, DeviceFault):
            if is_new:  # nobody was told of it
                shutil.rmtree(folder, ignore_errors=True)
            raise

    @classmethod
    def resume(cls, folder: Path, settings: WriterSettings = DEFAULT) -> Self:
        """Go on with a dataset that was interrupted or cancelled, at `next_point`."""
        document = read_document(folder)
        if document.state is DatasetState.COMPLETE:
            raise InvalidInput(f"dataset {folder} is complete; start another one")
        return cls._open(folder, document.ended(DatasetState.RUNNING), settings)

    @classmethod
    def _open(cls, folder: Path, document: DatasetDocument, settings: WriterSettings) -> Self:
        with disk_errors(f"dataset {folder.name}", folder, again=settings.again):
            lock = FolderLock(folder)
            try:
                return cls(folder, document, lock, settings)
            except BaseException:
                lock.release()
                raise

    @property
    def folder(self) -> Path:
        """Where the dataset lies."""
        return self._folder

    @property
    def header(self) -> DatasetHeader:
        """What was known of the dataset before its first point."""
        return self._document.header

    @property
    def next_point(self) -> int:
        """Index of the point to add next; from 0, or behind the last one acknowledged when resumed."""
        return self._next

    @property
    def progress(self) -> WriterProgress:
        """How far it is."""
        return WriterProgress(
            planned=self.header.points,
            acknowledged=len(self._records),
            queued=self._hand_over.queued,
            written_bytes=self._keeper.written_bytes,
            waited_s=self._hand_over.waited_s,
        )

    def add(self, point: CapturedPoint) -> None:
        """Hand the next point over to the disk; wait while it is busy with `depth` others.

        The images must not change afterwards. An error of the disk, of this point or an earlier one, comes
        back as StorageFull or DeviceFault; points that are out of turn or out of the plan are refused.
        """
        self._check_open()
        point = checked_point(point)
        index = point.place.index
        if index != self._next or index >= self.header.points:
            raise InvalidInput(
                f"point {index} was added to {self._folder}, point {self._next} of {self.header.points} "
                "is next; go on at `next_point`"
            )
        self._hand_over.put(point)
        self._next += 1

    def skip(self, place: PlanPosition, *, why: str) -> None:
        """Pass over the next point, for a reason that the dataset will tell."""
        self.add(CapturedPoint(place=place, skipped=why))

    def check(self) -> None:
        """Raise the disk's error when it has failed a point that was added."""
        self._check_open()
        self._hand_over.check()

    def flush(self) -> None:
        """Wait until every point added is acknowledged. Raise StorageFull or DeviceFault."""
        self._check_open()
        self._hand_over.flush()

    def finish(self) -> None:
        """End the dataset: complete when every planned point is there, else partial."""
        self.flush()
        missing = self.header.points - len(self._records)
        if missing:
            self.close(f"{missing} of {self.header.points} points were not taken")
            return
        self._end(DatasetState.COMPLETE, "")

    def close(self, why: str) -> None:
        """End it where it is, keeping what was added: a valid partial dataset that can be resumed."""
        if not self._ended:
            self._end(DatasetState.PARTIAL, why)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._ended:
            return
        why = "it was not finished" if error is None else str(error) or type(error).__name__
        try:
            self.close(why)
        except FoveaError as worse:
            if error is None:
                raise
            logger.warning("dataset %s was not closed well: %s", self._folder, worse)

    def _check_open(self) -> None:
        if self._ended:
            raise InvalidInput(f"dataset {self._folder} was ended already; resume it to go on")

    def _end(self, state: DatasetState, why: str) -> None:
        self._ended = True
        self._hand_over.close()
        try:
            with disk_errors(f"the end of dataset {self._folder.name}", self._folder, again=self._again):
                write_index(self._folder, self._records)
                self._document = self._document.ended(state, why)
                write_document(self._folder, self._document)
        finally:
            self._store.close()
            self._lock.release()


@dataclass(slots=True, kw_only=True, eq=False)
class _Keeper:
    """What the hand-over's thread does with a point."""

    folder: Path
    store: PointStore
    records: list[PointRecord]
    on_kept: Callable[[int], None] | None
    again: str
    written_bytes: int = 0

    def begin(self, point: CapturedPoint) -> BegunPoint:
        return self.store.begin(point)

    def keep(self, begun: BegunPoint) -> None:
        index = begun.place.index
        what = f"point {index} ({begun.raw_bytes / 1e6:.1f} MB of images)"
        with disk_errors(what, self.folder, again=self.again):
            record = self.store.commit(begun)
        self.records.append(record)
        self.written_bytes += sum(frame.size_bytes for frame in record.frames)
        if self.on_kept is not None:
            self.on_kept(index)

    def drop(self, begun: BegunPoint) -> None:
        self.store.drop(begun)


def _prepared(folder: Path, document: DatasetDocument) -> JournalContent:
    """Return the journal of a folder that holds just what it says; bring index and document up to it."""
    fresh = not (folder / DOCUMENT).exists()
    if fresh:
        write_document(folder, document)
    (folder / IMAGES).mkdir(exist_ok=True)
    journal = read_journal(folder, dataset_id=document.header.id)
    _check_files(folder, journal.records)
    remove_unacknowledged(folder, journal.records)
    write_index(folder, journal.records)
    if not fresh:
        write_document(folder, document)
    return journal


def _check_files(folder: Path, records: tuple[PointRecord, ...]) -> None:
    for record in records:
        for frame in record.frames:
            path = folder / frame.file
            size = path.stat().st_size if path.is_file() else None
            if size != frame.size_bytes:
                found = "is gone" if size is None else f"has {size} bytes, not {frame.size_bytes}"
                raise InvalidInput(
                    f"{path}, taken at point {record.place.index}, {found}; restore it from a copy, "
                    f"or start another dataset ({DOCUMENT} stays as it is)"
                )
