"""An archive of datasets, recordings and stills on S3-compatible storage: upload, fetch, reading in place.

Below the archive's URL an item lies in `KIND/ID/`: each file at `SHA256/NAME`, so that a file once stored is
never changed, and `manifest.json`, which is written last and names them all.
"""

from foveacam_pipeline.storage.archive.items import (
    ArchiveItem,
    BytesWatcher,
    fetch_item,
    find_item,
    list_archive,
    remove_large_files,
    upload_item,
)
from foveacam_pipeline.storage.archive.manifest import (
    RECORD,
    ArchivedFile,
    ArchiveManifest,
    ArchiveRecord,
    ItemKind,
    SparseCopy,
    read_record,
    read_stored,
    write_record,
)
from foveacam_pipeline.storage.archive.store import ArchiveStore, checked_url, open_store

__all__ = [
    "RECORD",
    "ArchiveItem",
    "ArchiveManifest",
    "ArchiveRecord",
    "ArchiveStore",
    "ArchivedFile",
    "BytesWatcher",
    "ItemKind",
    "SparseCopy",
    "checked_url",
    "fetch_item",
    "find_item",
    "list_archive",
    "open_store",
    "read_record",
    "read_stored",
    "remove_large_files",
    "upload_item",
    "write_record",
]
