"""Schemas of batches: products of several captures at once."""

from typing import Annotated, Literal

from pydantic import Field

from foveacam_server.datasets.export_format import ExportFormat
from foveacam_server.foundation.schema import RequestModel, ResponseModel

MOST_CAPTURES = 500
Kind = Literal["depth", "mosaic", "export", "evaluate"]
CaptureIds = Annotated[
    list[Annotated[str, Field(min_length=1, max_length=255)]], Field(min_length=1, max_length=MOST_CAPTURES)
]


class BatchRequest(RequestModel):
    """Captures and kind of product of a batch; `to`: the format of an export.

    `cluster`: compute on the workers of the server's Dask cluster instead of this machine.
    """

    kind: Kind
    capture_ids: CaptureIds
    to: ExportFormat = "hugging-face"
    cluster: bool = False


class BatchClusterDocument(ResponseModel):
    """The Dask scheduler of the server's settings, for batches; `url`: null without one."""

    url: str | None


class BatchFailureDocument(ResponseModel):
    """A product that could not be made; `unit`: point or scan, null for a whole capture."""

    dataset: str
    unit: int | None
    reason: str


class BatchDocument(ResponseModel):
    """A batch. `planned`, `done`: its products; null before its first run has ended.

    Equal requests share one batch: a further run makes the missing products. `download_url`: the products as
    one ZIP file; null before there are any.
    """

    id: str
    kind: Kind
    capture_ids: list[str]
    job_id: str | None
    planned: int | None
    done: int | None
    failed: list[BatchFailureDocument]
    url: str
    picture_url: str | None
    download_url: str | None
