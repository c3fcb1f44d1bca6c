"""Schemas of the archive."""

from foveacam_pipeline.storage.archive import ItemKind
from foveacam_server.foundation.schema import RequestModel, ResponseModel


class ArchiveRequest(RequestModel):
    """How to archive. `remove_local`: whether the large files are removed from this machine afterwards."""

    remove_local: bool = False


class ArchiveOrder(ArchiveRequest):
    """Request of an archive job, as stored."""

    kind: ItemKind
    item_id: str


class ArchiveDocument(ResponseModel):
    """The archive of this server; `url`: null without one."""

    url: str | None
