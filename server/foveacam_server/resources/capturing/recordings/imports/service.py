"""Adds recordings from elsewhere: uploads and files of folders, with their events."""

import asyncio
from collections.abc import AsyncIterator, Callable, Sequence
from pathlib import Path

from foveacam_server.resources.capturing.recordings.collection import RecordingCollection, StoredRecording
from foveacam_server.resources.capturing.recordings.documents import recording_document
from foveacam_server.resources.capturing.recordings.imports.folders import IMPORT, RecordingFolders
from foveacam_server.resources.capturing.recordings.imports.schema import (
    FoldersDocument,
    OpenRequest,
    UploadDocument,
    UploadRequest,
)
from foveacam_server.resources.capturing.recordings.imports.uploads import (
    PART_BYTES,
    FreeBytes,
    Upload,
    UploadService,
)
from foveacam_server.resources.capturing.recordings.schema import RecordingDocument

Report = Callable[[StoredRecording], None]
"""Callback for each added recording."""


class ImportService:
    """Imports recordings by upload or from folders, with their events."""

    def __init__(
        self,
        collection: RecordingCollection,
        *,
        folders: Sequence[Path],
        free_bytes: FreeBytes,
        report: Report,
    ) -> None:
        self._collection = collection
        self._folders = RecordingFolders([collection.folder.parent / IMPORT, *folders])
        self._uploads = UploadService(collection, free_bytes=free_bytes)
        self._report = report

    def folders(self) -> FoldersDocument:
        """Return the folders and their recordings."""
        return self._folders.describe({stored.path.resolve() for stored in self._collection.every()})

    def open(self, request: OpenRequest) -> RecordingDocument:
        """Add a recording of a folder in place."""
        path = self._folders.resolve(request.path)
        stored = self._collection.link(path, name=request.name or path.stem)
        self._report(stored)
        return recording_document(stored)

    def begin(self, request: UploadRequest) -> UploadDocument:
        """Begin an upload."""
        return _document(self._uploads.begin(request))

    def upload(self, upload_id: str) -> UploadDocument:
        """Return an upload."""
        return _document(self._uploads.get(upload_id))

    async def add(self, upload_id: str, *, at: int, parts: AsyncIterator[bytes]) -> UploadDocument:
        """Write one part of an upload."""
        upload = await self._uploads.add(upload_id, at=at, parts=parts)
        if upload.recording is not None:
            await asyncio.to_thread(self._report, upload.recording)
        return _document(upload)

    def abandon(self, upload_id: str) -> None:
        """Cancel an upload."""
        self._uploads.abandon(upload_id)


def _document(upload: Upload) -> UploadDocument:
    stored = upload.recording
    return UploadDocument(
        id=upload.id,
        name=upload.name,
        size_bytes=upload.size_bytes,
        received_bytes=upload.received_bytes,
        part_bytes=PART_BYTES,
        recording=None if stored is None else recording_document(stored),
    )
