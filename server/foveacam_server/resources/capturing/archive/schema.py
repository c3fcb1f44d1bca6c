"""Schemas of the archive."""

from foveacam_pipeline.storage.archive import ItemKind
from foveacam_server.foundation.schema import RequestModel, ResponseModel


class ArchiveRequest(RequestModel):
    """How to archive. `remove_local`: whether only what is small stays on this machine afterwards."""

    remove_local: bool = False


class ArchiveOrder(ArchiveRequest):
    """The stored request of a job."""

    kind: ItemKind
    item_id: str


class ArchiveDocument(ResponseModel):
    """The archive of this server; `url`: null without one."""

    url: str | None
