"""Schemas of exports: datasets in the formats of other programs."""

from typing import Literal

from foveacam_server.datasets.export_format import ExportFormat
from foveacam_server.foundation.schema import JobProgress, Problem, RequestModel, ResponseModel


class DatasetExportRequest(RequestModel):
    """The format to which a dataset is exported."""

    kind: ExportFormat


class MadeExport(ResponseModel):
    """A finished export: one ZIP file. `outdated`: the dataset or this program has changed since."""

    made_utc: str
    points: int
    size_bytes: int
    outdated: bool
    download_url: str


class DatasetExport(ResponseModel):
    """The export of a capture to one format. `largest_bytes`: its size at most; null where it is impossible.

    `refusal`: why none can be made now.
    """

    kind: ExportFormat
    state: Literal["none", "building", "complete"]
    job_id: str | None
    progress: JobProgress | None
    largest_bytes: int | None
    refusal: Problem | None
    made: MadeExport | None
    url: str


class DatasetExports(ResponseModel):
    """The exports of a capture, one for each format."""

    capture_id: str
    name: str
    exports: list[DatasetExport]
    url: str
