"""Writes a dataset that survives a crash: every acknowledged point is complete on disk and stays there.

    with DatasetWriter.create(folder, DatasetHeader(points=81, calibration=calibration)) as writer:
        while writer.next_point < 81:
            writer.add(CapturedPoint(place=..., shots=(Shot(frame=left), Shot(frame=right))))
        writer.finish()

`add` only queues a point; encoding and writing run on other threads.
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
    PointRecord,
    WriterProgress,
    normalize_point,
)
from foveacam_pipeline.storage.disk import disk_errors, sync_folder

logger = logging.getLogger(__name__)

RESUME_REMEDY = "then resume: what was acknowledged is safe"


@dataclass(frozen=True, slots=True, kw_only=True)
class WriterSettings:
    """Settings of a writer. `depth`: points that may wait for the disk. `encoders`: encoding threads.

    `on_acknowledged(index)` is called on the writer's thread for each acknowledged point. `again`: the remedy
    that an error states once the disk is repaired.
    """

    depth: int = 2
    encoders: int = 2
    on_acknowledged: Callable[[int], None] | None = None
    again: str = RESUME_REMEDY


DEFAULT = WriterSettings()


class DatasetWriter:
    """A dataset that is being written; opened by `create` or `resume`, ended by `finish` or `close`."""

    def __init__(
        self, folder: Path, document: DatasetDocument, lock: FolderLock, settings: WriterSettings
    ) -> None:
        """Open a folder, already locked, for writing. Raise OSError."""
        self._folder, self._document, self._lock = folder, document, lock
        journal = _prepare_folder(folder, document)
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
        self._committer = _PointCommitter(
            folder=folder,
            store=self._store,
            records=self._records,
            on_acknowledged=settings.on_acknowledged,
            again=settings.again,
        )
        self._queue = PointQueue(self._committer, depth=settings.depth)

    @classmethod
    def create(cls, folder: Path, header: DatasetHeader, settings: WriterSettings = DEFAULT) -> Self:
        """Begin a dataset in a folder that does not exist or is empty."""
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
            if is_new:  # no caller knows the folder yet
                shutil.rmtree(folder, ignore_errors=True)
            raise

    @classmethod
    def resume(cls, folder: Path, settings: WriterSettings = DEFAULT) -> Self:
        """Continue an interrupted or cancelled dataset at `next_point`."""
        document = read_document(folder)
        if document.state is DatasetState.COMPLETE:
            raise InvalidInput(f"dataset {folder} is complete; start another one")
        return cls._open(folder, document.with_state(DatasetState.RUNNING), settings)

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
        """The dataset's folder."""
        return self._folder

    @property
    def header(self) -> DatasetHeader:
        """The description of the dataset before its first point."""
        return self._document.header

    @property
    def next_point(self) -> int:
        """Index of the next point to add; a resumed dataset continues behind its last acknowledged point."""
        return self._next

    @property
    def progress(self) -> WriterProgress:
        """The numbers of planned, acknowledged and queued points."""
        return WriterProgress(
            planned=self.header.points,
            acknowledged=len(self._records),
            queued=self._queue.queued,
            written_bytes=self._committer.written_bytes,
            waited_s=self._queue.waited_s,
        )

    def add(self, point: CapturedPoint) -> None:
        """Queue the next point for the disk; wait while `depth` others are queued.

        The images must not change afterwards. A disk error, of this point or an earlier one, is raised as
        StorageFull or DeviceFault; a point out of turn or outside the plan is refused.
        """
        self._check_open()
        point = normalize_point(point)
        index = point.place.index
        if index != self._next or index >= self.header.points:
            raise InvalidInput(
                f"point {index} was added to {self._folder}, point {self._next} of {self.header.points} "
                "is next; go on at `next_point`"
            )
        self._queue.put(point)
        self._next += 1

    def check(self) -> None:
        """Raise the disk's error when it failed for a point that was added."""
        self._check_open()
        self._queue.check()

    def flush(self) -> None:
        """Wait until every added point is acknowledged. Raise StorageFull or DeviceFault."""
        self._check_open()
        self._queue.flush()

    def finish(self) -> None:
        """End the dataset: complete when it has every planned point, else partial."""
        self.flush()
        missing = self.header.points - len(self._records)
        if missing:
            self.close(f"{missing} of {self.header.points} points were not taken")
            return
        self._end(DatasetState.COMPLETE, "")

    def close(self, why: str) -> None:
        """End it early as a valid partial dataset that has every added point and can be resumed."""
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
        self._queue.close()
        try:
            with disk_errors(f"the end of dataset {self._folder.name}", self._folder, again=self._again):
                write_index(self._folder, self._records)
                self._document = self._document.with_state(state, why)
                write_document(self._folder, self._document)
        finally:
            self._store.close()
            self._lock.release()


@dataclass(slots=True, kw_only=True, eq=False)
class _PointCommitter:
    """Commits points to the store and records them, on the queue's thread."""

    folder: Path
    store: PointStore
    records: list[PointRecord]
    on_acknowledged: Callable[[int], None] | None
    again: str
    written_bytes: int = 0

    def begin(self, point: CapturedPoint) -> BegunPoint:
        return self.store.begin(point)

    def commit(self, begun: BegunPoint) -> None:
        index = begun.place.index
        what = f"point {index} ({begun.raw_bytes / 1e6:.1f} MB of images)"
        with disk_errors(what, self.folder, again=self.again):
            record = self.store.commit(begun)
        self.records.append(record)
        self.written_bytes += sum(frame.size_bytes for frame in record.frames)
        if self.on_acknowledged is not None:
            self.on_acknowledged(index)

    def drop(self, begun: BegunPoint) -> None:
        self.store.drop(begun)


def _prepare_folder(folder: Path, document: DatasetDocument) -> JournalContent:
    """Return the journal of a folder after removing leftovers and bringing index and document up to date."""
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
