"""Routes of stills (a stack of frames of every camera): take, list, keep, discard, pictures, download."""

from pathlib import Path as FilePath
from typing import Annotated, Literal

from fastapi import Path, Query
from fastapi.responses import JSONResponse, StreamingResponse
from starlette.concurrency import run_in_threadpool

from foveacam_hardware.contract import Role
from foveacam_pipeline.capture.dataset import check_dataset
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter, needs
from foveacam_server.datasets.collection import readable_dataset
from foveacam_server.datasets.download import zip_stream
from foveacam_server.datasets.drawings import anaglyph_picture, capture_picture
from foveacam_server.foundation.http.answers import (
    LONG_READ,
    IdempotencyHeader,
    LeaseHeader,
    PreferHeader,
    file_responses,
    job_answer,
    problems,
)
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.http.stored_file import StoredFile, stored_file_responses
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.lease import Lease
from foveacam_server.foundation.schema import JobDocument, TrashEmptied
from foveacam_server.resources.capturing.stills.collection import StillState, StoredStill, still_picture
from foveacam_server.resources.capturing.stills.schema import (
    CameraName,
    StateName,
    StillCheck,
    StillDocument,
    StillKeepRequest,
    StillPatch,
    StillRequest,
)
from foveacam_server.resources.capturing.stills.service import StillService

router = GuardedRouter("/stills", tags=["stills"], reading=Right.VIEW, changing=Right.OPERATE)


StillId = Annotated[str, Path(max_length=100)]
Form = Literal["jpg", "png", "tiff"]
_MEDIA = {"jpg": "image/jpeg", "png": "image/png", "tiff": "image/tiff"}


@router.post(
    "",
    status_code=202,
    summary="Take a still",
    response_model=JobDocument,
    responses={
        200: {"model": StillDocument, "description": "ended in time"},
        **problems(409, 502, 503, 504),
    },
)
async def create(
    request: StillRequest,
    lease: Provided[Lease],
    stills: Provided[StillService],
    jobs: Provided[JobRunner],
    prefer: PreferHeader = None,
    idempotency_key: IdempotencyHeader = None,
    x_lease: LeaseHeader = None,
) -> JSONResponse:
    """Queue a still as a job. If a camera stalls, the job fails and names it; the frames so far are held."""
    lease.check(x_lease)
    job = await run_in_threadpool(stills.start, request, idempotency_key=idempotency_key)
    return await job_answer(jobs, job, prefer=prefer, result=stills.get)


@router.get("", summary="Stills, newest first")
def every(
    stills: Provided[StillService],
    text: Annotated[str, Query(max_length=200, description="words of name, label or id")] = "",
    state: Annotated[StateName, Query(description="held: neither kept nor discarded")] = "kept",
) -> list[StillDocument]:
    """Return all stills of one state, or those that contain every word of `text`."""
    return stills.search(text=text, state=StillState(state))


@router.delete("/trash", summary="Empty the trash")
@needs(Right.ADMINISTER)
def empty_trash(stills: Provided[StillService]) -> TrashEmptied:
    """Delete the stills in the trash for good."""
    return TrashEmptied(deleted=stills.collection.empty_trash())


@router.get("/{still_id}", summary="One still", responses=problems(404))
def one(still_id: StillId, stills: Provided[StillService]) -> StillDocument:
    """Return one still, held or kept."""
    return stills.get(still_id)


@router.patch("/{still_id}", summary="Describe a still", responses=problems(404, 409))
def patch(still_id: StillId, change: StillPatch, stills: Provided[StillService]) -> StillDocument:
    """Change a still's label or licence."""
    return stills.edit(still_id, change)


@router.post(
    "/{still_id}/keep",
    summary="Keep a still that is held",
    responses=problems(404, 409, 502),
)
def keep(
    still_id: StillId, stills: Provided[StillService], change: StillKeepRequest | None = None
) -> StillDocument:
    """Keep a held still, under another name if one is given."""
    return stills.keep(still_id, change or StillKeepRequest())


@router.delete(
    "/{still_id}", status_code=204, summary="Discard or remove a still", responses=problems(404, 409)
)
def remove(still_id: StillId, stills: Provided[StillService]) -> None:
    """Move a still to the trash, from which it can be restored."""
    stills.remove(still_id)


@router.post(
    "/{still_id}/restore",
    summary="Restore a still from the trash",
    responses=problems(404),
)
def restore(still_id: StillId, stills: Provided[StillService]) -> StillDocument:
    """Restore a still from the trash; a discarded one is kept afterwards."""
    return stills.restore(still_id)


@router.post(
    "/{still_id}/check", summary="Verify every file", responses=problems(404), dependencies=[LONG_READ]
)
def check_files(still_id: StillId, stills: Provided[StillService]) -> StillCheck:
    """Read every file of the still's dataset again, and list those that have changed since it was written."""
    faults = check_dataset(stills.collection.get(still_id).stored.folder)
    return StillCheck(id=still_id, sound=not faults, faults=faults)


@router.get(
    "/{still_id}/download.zip",
    summary="The still's dataset as one ZIP file",
    response_class=StreamingResponse,
    responses=file_responses("application/zip"),
    dependencies=[LONG_READ],
)
def download(still_id: StillId, stills: Provided[StillService]) -> StreamingResponse:
    """Send the dataset's folder with unchanged files."""
    kept = stills.collection.get(still_id).stored
    readable_dataset(kept)
    headers = {"Content-Disposition": f'attachment; filename="{kept.id}.zip"'}
    return StreamingResponse(zip_stream(kept.folder), media_type="application/zip", headers=headers)


@router.get(
    "/{still_id}/cameras/{camera}.{form}",
    summary="Picture of one camera",
    response_class=StoredFile,
    responses=stored_file_responses("image/jpeg"),
)
def picture(
    still_id: StillId,
    camera: CameraName,
    form: Form,
    stills: Provided[StillService],
    frame: Annotated[
        str | None,
        Query(pattern=r"^\d{1,2}$", description="one of the stack, from 0; usually their mean"),
    ] = None,
) -> StoredFile:
    """Send a preview of 8 bits (jpg), or the picture of full depth (png, tiff)."""
    collection = stills.collection
    number = None if frame is None else int(frame)
    path = collection.read(
        still_id, lambda found: still_picture(collection, found, Role(camera), form=form, frame=number)
    )
    name = f"{still_id}-{camera}.{form}"
    return StoredFile(path, media_type=_MEDIA[form], filename=name, content_disposition_type="inline")


@router.get(
    "/{still_id}/{drawn}.{form}",
    summary="Where the foveae looked, or both in red and cyan",
    response_class=StoredFile,
    responses=stored_file_responses("image/jpeg"),
)
def drawing_of(
    still_id: StillId,
    drawn: Literal["thumbnail", "coverage", "anaglyph"],
    form: Literal["jpg", "png"],
    stills: Provided[StillService],
) -> StoredFile:
    """Draw a small wide view with both outlines, a large one, or the rectified pair."""
    collection = stills.collection

    def draw(found: StoredStill) -> FilePath:
        if drawn == "anaglyph":
            return anaglyph_picture(collection.drawn, found.stored, index=0, bracket=0, form=form)
        return capture_picture(collection.drawn, found.stored, drawn, form=form)

    return StoredFile(collection.read(still_id, draw), media_type=_MEDIA[form])
