"""Sends captures, recordings and stills to the archive and fetches them, as jobs parallel to all others."""

import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Protocol
from urllib.parse import quote

from foveacam_hardware.contract import Busy, InvalidInput
from foveacam_pipeline.storage.archive import (
    ArchiveItem,
    ArchiveRecord,
    BytesWatcher,
    ItemKind,
    fetch_item,
    open_store,
    read_record,
    remove_large_files,
    upload_item,
)
from foveacam_server.foundation.job_table import Job
from foveacam_server.foundation.jobs import JobContext, JobRunner
from foveacam_server.foundation.names import utc_now
from foveacam_server.foundation.schema import ResponseModel
from foveacam_server.resources.capturing.archive.schema import ArchiveDocument, ArchiveOrder, ArchiveRequest

ARCHIVE, FETCH = "archive", "fetch"
_KB = 1000
NO_ARCHIVE = "this server has no archive"
_REMEDY = "start it with --archive s3://bucket/prefix"


class ArchiveSource(Protocol):
    """Access of the archive to one kind of this server's captures, recordings or stills."""

    def archive_item(self, item_id: str) -> ArchiveItem:
        """Return an item that is complete; raise NotFound, Busy or InvalidInput."""
        ...

    def before_removal(self, item_id: str) -> None:
        """Prepare an item for the removal of its large files from the disk."""
        ...

    def report_change(self, item_id: str, message: str) -> None:
        """Emit the event that an item has changed."""
        ...

    def document(self, item_id: str) -> ResponseModel:
        """Return REST's document of an item."""
        ...


class ArchiveService:
    """Sends items to the archive of this server and fetches them; `url`: None without an archive."""

    def __init__(self, url: str | None, sources: Mapping[ItemKind, ArchiveSource], jobs: JobRunner) -> None:
        self._url = None if url is None else open_store(url).url
        self._sources, self._jobs = sources, jobs
        self._lock = threading.Lock()
        self._busy: set[tuple[ItemKind, str]] = set()
        jobs.handle(ARCHIVE, self._archive, parallel=True, at_once=2)
        jobs.handle(FETCH, self._fetch, parallel=True, at_once=2)

    def describe(self) -> ArchiveDocument:
        """Return the address of the archive."""
        return ArchiveDocument(url=self._url)

    def archive(
        self, kind: ItemKind, item_id: str, request: ArchiveRequest, *, idempotency_key: str | None
    ) -> Job:
        """Queue an upload; raise at once where it cannot be done now."""
        if self._url is None:
            raise InvalidInput(f"archive {item_id}: {NO_ARCHIVE}", found=NO_ARCHIVE, remedy=_REMEDY)
        item = self._sources[kind].archive_item(item_id)
        order = ArchiveOrder(**request.model_dump(), kind=kind, item_id=item_id)
        note = f"{item.name} to the archive"
        return self._jobs.submit(ARCHIVE, order, idempotency_key=idempotency_key, note=note)

    def fetch(self, kind: ItemKind, item_id: str, *, idempotency_key: str | None) -> Job:
        """Queue a download of the files that are only in the archive."""
        item = self._sources[kind].archive_item(item_id)
        _record_of(item)
        order = ArchiveOrder(kind=kind, item_id=item_id)
        note = f"{item.name} from the archive"
        return self._jobs.submit(FETCH, order, idempotency_key=idempotency_key, note=note)

    def document(self, kind: ItemKind, item_id: str) -> ResponseModel:
        """Return REST's document of an item."""
        return self._sources[kind].document(item_id)

    def _archive(self, context: JobContext) -> str:
        order = context.job.parse_request(ArchiveOrder)
        source = self._sources[order.kind]
        with self._alone(order):
            item = source.archive_item(order.item_id)
            record = upload_item(self._url or "", item, utc=utc_now(), watch=_watcher(context, item))
            message = f"{item.name} is in the archive"
            if order.remove_local:
                source.before_removal(order.item_id)
                freed_mb = remove_large_files(item, record) / 1e6
                message += f"; {freed_mb:.1f} MB were removed here"
            source.report_change(order.item_id, message)
        return _url_of(order)

    def _fetch(self, context: JobContext) -> str:
        order = context.job.parse_request(ArchiveOrder)
        source = self._sources[order.kind]
        with self._alone(order):
            item = source.archive_item(order.item_id)
            record = _record_of(item)
            files = {name: item.files[name] for name in record.manifest.files if name in item.files}
            fetch_item(record, files, watch=_watcher(context, item))
            source.report_change(order.item_id, f"{item.name} was fetched from the archive")
        return _url_of(order)

    @contextmanager
    def _alone(self, order: ArchiveOrder) -> Iterator[None]:
        """Reserve an item for one job; raise Busy for a second one."""
        key = order.kind, order.item_id
        with self._lock:
            if key in self._busy:
                raise Busy(
                    f"{order.item_id} is being archived or fetched already",
                    asked=f"archive or fetch {order.item_id}",
                    found="another job does so",
                    remedy="wait for that job, or cancel it",
                )
            self._busy.add(key)
        try:
            yield
        finally:
            with self._lock:
                self._busy.discard(key)


def _record_of(item: ArchiveItem) -> ArchiveRecord:
    record = read_record(item.record)
    if record is None:
        raise InvalidInput(
            f"fetch {item.name}: it is not archived; all of it is here",
            asked=f"fetch {item.name}",
            found="it is not archived",
        )
    return record


def _watcher(context: JobContext, item: ArchiveItem) -> BytesWatcher:
    """Return a callback that reports a job's progress, once per percent, and raises when it is cancelled."""
    reported = -1

    def watch(done_bytes: int, total_bytes: int) -> None:
        nonlocal reported
        context.check()
        total = max(1, total_bytes // _KB)
        done = min(done_bytes // _KB, total)
        if (percent := 100 * done // total) != reported:
            reported = percent
            context.progress(done, total=total, note=f"{item.name}, kB")

    return watch


def _url_of(order: ArchiveOrder) -> str:
    return f"/api/v1/{order.kind}/{quote(order.item_id, safe='')}"
