"""Routes of imported recordings: uploaded in parts, or opened in a folder of the server's machine."""

from typing import Annotated

from fastapi import Path, Query, Request

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import problems
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.resources.capturing.recordings.imports.schema import (
    GIB,
    LARGEST_BYTES,
    FoldersDocument,
    OpenRequest,
    UploadDocument,
    UploadRequest,
)
from foveacam_server.resources.capturing.recordings.imports.uploads import PART_BYTES
from foveacam_server.resources.capturing.recordings.schema import RecordingDocument
from foveacam_server.resources.capturing.recordings.service import RecordingService

router = GuardedRouter("/recordings", tags=["recordings"], reading=Right.VIEW, changing=Right.OPERATE)


UploadId = Annotated[str, Path(max_length=100)]
_PART = {
    "requestBody": {
        "required": True,
        "content": {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}},
    }
}


@router.get("/folders", summary="Recordings in folders of the server's machine")
def folders(recordings: Provided[RecordingService]) -> FoldersDocument:
    """List what can be opened in the data directory's `import` and in FOVEACAM_RECORDING_FOLDERS."""
    return recordings.imports.folders()


@router.post("/open", status_code=201, summary="Open a recording in place", responses=problems(502))
def open_file(request: OpenRequest, recordings: Provided[RecordingService]) -> RecordingDocument:
    """Add a recording from one of the folders; its file stays there and is only read."""
    return recordings.imports.open(request)


@router.post(
    "/uploads",
    status_code=201,
    summary=f"Begin to send a recording of at most {LARGEST_BYTES // GIB} GiB",
    responses=problems(409, 502),
)
def begin_upload(request: UploadRequest, recordings: Provided[RecordingService]) -> UploadDocument:
    """Begin an upload; refused at once where the name is used, or the disk lacks space."""
    return recordings.imports.begin(request)


@router.get("/uploads/{upload_id}", summary="Progress of an upload", responses=problems(404))
def upload(upload_id: UploadId, recordings: Provided[RecordingService]) -> UploadDocument:
    """Return an upload, to resume it after a lost connection."""
    return recordings.imports.upload(upload_id)


@router.put(
    "/uploads/{upload_id}",
    summary="Send a part of a recording",
    responses=problems(404, 409, 502),
    openapi_extra=_PART,
    max_body_size=PART_BYTES,
)
async def add_part(
    upload_id: UploadId,
    request: Request,
    recordings: Provided[RecordingService],
    at: Annotated[int, Query(ge=0, le=10**15, description="byte of the file with which the part begins")],
) -> UploadDocument:
    """Append a part of at most 8 MiB; after the last one the file is checked and added."""
    return await recordings.imports.add(upload_id, at=at, parts=request.stream())


@router.delete("/uploads/{upload_id}", status_code=204, summary="Abandon an upload", responses=problems(404))
def abandon(upload_id: UploadId, recordings: Provided[RecordingService]) -> None:
    """Cancel an upload and delete its received parts."""
    recordings.imports.abandon(upload_id)
