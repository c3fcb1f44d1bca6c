"""Exports of captures on the disk, at `.exports/ID/KIND` beside the datasets: a ZIP file and its record.

An export is made in `.exports/ID/making` and moved to its place by a rename, so that what is listed is whole.
"""

import shutil
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from pydantic import BaseModel

from foveacam_pipeline.storage.disk import disk_errors
from foveacam_server.datasets.collection import CAPTURES_URL
from foveacam_server.datasets.export_format import ExportFormat
from foveacam_server.datasets.product_folders import product_home, remove_product, replace_product
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.whole_file import read_document, write_document

EXPORTS = ".exports"
"""Folder beside the datasets."""
MAKING, MADE = "making", "made"
RECORD, FORM, VERSION = "export.json", "foveacam-export", 1


class ExportRecord(BaseModel):
    """The content of export.json. `key`: hash of all that it depends on; `file`: name of the ZIP file."""

    capture_id: str
    name: str
    kind: ExportFormat
    key: str
    points: int
    file: str


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredExport:
    """One finished export. It has no label, so that retention applies to it whatever its dataset's is."""

    record: ExportRecord
    path: Path
    size_bytes: int
    made_ns: int
    label: str = ""

    @property
    def id(self) -> str:
        """Id among the exports of all captures."""
        return f"{self.record.capture_id}:{self.record.kind}"

    @property
    def name(self) -> str:
        """Name of its dataset, and its format."""
        return f"{self.record.name}, {self.record.kind}"

    @property
    def created_utc(self) -> str:
        """When it was made."""
        return datetime.fromtimestamp(self.made_ns / 1e9, tz=UTC).isoformat(timespec="seconds")


class ExportCollection:
    """Finds, finishes and removes exports by their capture's id and their format."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def making(self, capture_id: str) -> Path:
        """Return the folder in which an export of a capture is made."""
        return product_home(self._folder, capture_id) / MAKING

    def made(self, capture_id: str, kind: ExportFormat) -> StoredExport | None:
        """Return a finished export; None without one."""
        return _read(product_home(self._folder, capture_id) / kind)

    def require(self, capture_id: str, kind: ExportFormat) -> StoredExport:
        """Return a finished export or raise `NotFound`."""
        found = self.made(capture_id, kind)
        if found is None:
            raise NotFound(
                f"capture {capture_id} has no export to {kind}",
                asked=f"the export of {capture_id} to {kind}",
                found="none was made",
                remedy=f'make one: POST {exports_url(capture_id)} {{"kind": "{kind}"}}',
            )
        return found

    def every(self) -> list[StoredExport]:
        """Return the finished exports of all captures."""
        found = (_read(path.parent) for path in sorted(self._folder.glob(f"*/*/{RECORD}")))
        return [export for export in found if export is not None and export.path.parent.name != MADE]

    def prepare(self, capture_id: str) -> Path:
        """Return an empty folder to make an export in. Raise as `disk_errors`."""
        making = self.making(capture_id)
        with disk_errors("an export", self._folder.parent):
            shutil.rmtree(making, ignore_errors=True)
            making.mkdir(parents=True)
        return making

    def finish(self, capture_id: str, kind: ExportFormat) -> None:
        """Replace the former export of a format by the finished one. Raise as `disk_errors`."""
        making = self.making(capture_id)
        with disk_errors("the finished export", self._folder.parent):
            replace_product(making / MADE, making.with_name(kind))

    def clear(self, capture_id: str) -> None:
        """Delete what an export of a capture left unfinished."""
        shutil.rmtree(self.making(capture_id), ignore_errors=True)

    def clear_all(self) -> None:
        """Delete what a server that was killed left unfinished."""
        for making in self._folder.glob(f"*/{MAKING}"):
            shutil.rmtree(making, ignore_errors=True)

    def remove(self, capture_id: str, kind: ExportFormat) -> None:
        """Delete one export."""
        remove_product(product_home(self._folder, capture_id) / kind, what="an export")

    def remove_all(self, capture_id: str) -> None:
        """Delete the exports of a capture."""
        remove_product(product_home(self._folder, capture_id), what="the exports")

    def remove_by_id(self, export_id: str) -> None:
        """Delete one export by its id among all."""
        for found in self.every():
            if found.id == export_id:
                self.remove(found.record.capture_id, found.record.kind)


def exports_url(capture_id: str) -> str:
    """Return the URL of a capture's exports."""
    return f"{CAPTURES_URL}/{capture_id}/exports"


def write_record(folder: Path, record: ExportRecord) -> None:
    """Write the record of a finished export. Raise as `disk_errors`."""
    document = {"format": FORM, "version": VERSION, **record.model_dump(mode="json")}
    write_document(folder / RECORD, document, what="an export's record")


def _read(folder: Path) -> StoredExport | None:
    path = folder / RECORD
    try:
        record = read_document(path, ExportRecord, form=FORM, version=VERSION)
        packed = folder / record.file
        return StoredExport(
            record=record,
            path=packed,
            size_bytes=packed.stat().st_size,
            made_ns=path.stat().st_mtime_ns,
        )
    except (OSError, ValueError):
        return None
