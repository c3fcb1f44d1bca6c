"""Exports captures to the formats of other programs, as jobs in child processes; serves the files."""

from typing import Literal

from foveacam_hardware.contract import FoveaError
from foveacam_server.datasets.collection import StoredCapture
from foveacam_server.datasets.derived_products import (
    DerivedProduct,
    DerivedProductJobs,
    DerivedProductTools,
    Run,
)
from foveacam_server.datasets.export_format import ExportFormat
from foveacam_server.foundation.errors import problem_of
from foveacam_server.foundation.job_table import Job
from foveacam_server.foundation.schema import JobDocument, Problem
from foveacam_server.resources.capturing.exports.collection import (
    EXPORTS,
    ExportCollection,
    ExportRecord,
    StoredExport,
    exports_url,
)
from foveacam_server.resources.capturing.exports.needs import EXPORT_FORMATS, bytes_needed, export_keys
from foveacam_server.resources.capturing.exports.process import ExportOrder
from foveacam_server.resources.capturing.exports.schema import (
    DatasetExport,
    DatasetExportRequest,
    DatasetExports,
    MadeExport,
)

NOUN = "export"
PROCESS = "foveacam_server.resources.capturing.exports.process"


class ExportService:
    """The exports of this data directory's captures: make, list, serve, remove."""

    def __init__(self, tools: DerivedProductTools) -> None:
        self._captures = tools.captures
        self.collection = ExportCollection(tools.captures.collection.folder / EXPORTS)
        self.collection.clear_all()
        tools.captures.collection.on_delete(self.collection.remove_all)
        self._making = DerivedProductJobs(DerivedProduct(noun=NOUN, process=PROCESS, make=self._make), tools)

    def start(
        self, capture_id: str, request: DatasetExportRequest, *, idempotency_key: str | None = None
    ) -> Job:
        """Queue an export; raise at once when it is impossible or might not fit on the disk."""
        return self._making.start(
            capture_id,
            request,
            check=lambda kept: self._current(kept, request.kind) or self._check(kept, request.kind),
            idempotency_key=idempotency_key,
        )

    def get(self, capture_id: str) -> DatasetExports:
        """Return the exports of a capture, one for each format; raise NotFound."""
        kept = self._captures.collection.get(capture_id)
        made = {kind: self.collection.made(capture_id, kind) for kind in EXPORT_FORMATS}
        keys = _keys(kept) if any(made.values()) else {}
        arguments, job = self._making.running_arguments(capture_id), self._making.running_job(capture_id)
        running = arguments and DatasetExportRequest.model_validate_json(arguments).kind
        return DatasetExports(
            capture_id=capture_id,
            name=kept.name,
            exports=[
                self._describe(kept, kind, found, job=job if running == kind else None, key=keys.get(kind))
                for kind, found in made.items()
            ],
            url=exports_url(capture_id),
        )

    def get_one(self, capture_id: str, kind: ExportFormat) -> DatasetExport:
        """Return the export of a capture to one format; raise NotFound for a capture that is not there."""
        return next(found for found in self.get(capture_id).exports if found.kind == kind)

    def require(self, capture_id: str, kind: ExportFormat) -> StoredExport:
        """Return a finished export; raise NotFound."""
        self._captures.collection.get(capture_id)
        return self.collection.require(capture_id, kind)

    def remove(self, capture_id: str, kind: ExportFormat) -> None:
        """Remove one export of a capture; raise `Busy` while one is being made."""
        self._captures.collection.get(capture_id)
        self.check_idle(capture_id, "remove an export")
        self.collection.remove(capture_id, kind)
        self._making.emit("removed", "an export was removed", capture_id)

    def check_idle(self, capture_id: str, asked: str) -> None:
        """Raise Busy while an export of this capture is being made."""
        self._making.check_idle(capture_id, asked)

    def is_in_use(self, export_id: str) -> bool:
        """Return whether an export of the same capture is being made; the id is that among all exports."""
        return self._making.running_job(export_id.rpartition(":")[0]) is not None

    def _make(self, kept: StoredCapture, arguments: str, run: Run) -> str:
        kind = DatasetExportRequest.model_validate_json(arguments).kind
        url = f"{exports_url(kept.id)}/{kind}"
        if self._current(kept, kind) is not None:
            return url
        title, dataset = f"{kept.name}-{kind}", self._making.ended_dataset(kept)
        record = ExportRecord(
            capture_id=kept.id,
            name=kept.name,
            kind=kind,
            key=export_keys(kept.folder)[kind],
            points=len(dataset),
            file=f"{title}.zip",
        )
        try:
            out = self.collection.prepare(kept.id)
            order = ExportOrder(dataset=kept.folder, out=out, title=title, record=record)
            run([order.model_dump_json()])
            self.collection.finish(kept.id, kind)
        finally:
            self.collection.clear(kept.id)
        return url

    def _current(self, kept: StoredCapture, kind: ExportFormat) -> StoredExport | None:
        """Return the finished export, if neither the dataset nor this program has changed since."""
        found = self.collection.made(kept.id, kind)
        return found if found is not None and found.record.key == _keys(kept).get(kind) else None

    def _describe(
        self,
        kept: StoredCapture,
        kind: ExportFormat,
        found: StoredExport | None,
        *,
        job: JobDocument | None,
        key: str | None,
    ) -> DatasetExport:
        url, (largest_bytes, refusal) = f"{exports_url(kept.id)}/{kind}", self._outlook(kept, kind)
        complete: Literal["none", "complete"] = "none" if found is None else "complete"
        return DatasetExport(
            kind=kind,
            state=complete if job is None else "building",
            job_id=None if job is None else job.id,
            progress=None if job is None else job.progress,
            largest_bytes=largest_bytes,
            refusal=refusal,
            made=None if found is None else _made_export(found, url, outdated=found.record.key != key),
            url=url,
        )

    def _outlook(self, kept: StoredCapture, kind: ExportFormat) -> tuple[int | None, Problem | None]:
        """Return the largest size of an export, or why none is possible."""
        try:
            return self._check(kept, kind), None
        except FoveaError as error:
            return None, problem_of(error).document()

    def _check(self, kept: StoredCapture, kind: ExportFormat) -> int:
        dataset = self._making.ended_dataset(kept)
        return bytes_needed(dataset, kind, folder=self._captures.collection.folder)


def _keys(kept: StoredCapture) -> dict[ExportFormat, str]:
    """Return the keys of a capture's exports; none for a damaged capture."""
    try:
        return export_keys(kept.folder)
    except FoveaError:
        return {}


def _made_export(found: StoredExport, url: str, *, outdated: bool) -> MadeExport:
    return MadeExport(
        made_utc=found.created_utc,
        points=found.record.points,
        size_bytes=found.size_bytes,
        outdated=outdated,
        download_url=f"{url}.zip?made={found.made_ns:x}",
    )
