"""Routes of captures (raster datasets): estimate, start, pause, list, points, drawings, download."""

from typing import Annotated, Literal, Protocol, TypeAlias

from fastapi import Path, Query, Response
from fastapi.responses import JSONResponse, StreamingResponse
from starlette.concurrency import run_in_threadpool

from foveacam_hardware.contract import Role
from foveacam_pipeline.capture.dataset import check_dataset
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter, needs
from foveacam_server.datasets.capture_id import CaptureId
from foveacam_server.datasets.collection import point_of, readable_dataset
from foveacam_server.datasets.download import zip_stream
from foveacam_server.datasets.drawings import anaglyph_picture, capture_picture, frame_picture
from foveacam_server.foundation.computing.compute_queue import ComputeQueue
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
from foveacam_server.foundation.quantities import Index
from foveacam_server.foundation.schema import JobDocument, TrashEmptied
from foveacam_server.resources.capturing.captures.estimates import estimate_plan
from foveacam_server.resources.capturing.captures.schema import (
    CaptureChecked,
    CaptureDocument,
    CapturePatch,
    CaptureRequest,
    EstimateDocument,
    EstimateRequest,
    PointsDocument,
)
from foveacam_server.resources.capturing.captures.service import CaptureService

router = GuardedRouter("/captures", tags=["captures"], reading=Right.VIEW, changing=Right.OPERATE)


class CaptureProduct(Protocol):
    """A product that is computed of captures: mosaics or references."""

    def check_idle(self, capture_id: str, asked: str) -> None:
        """Raise `Busy` while the product of this capture is being computed."""
        ...


CaptureProducts: TypeAlias = tuple[CaptureProduct, ...]
Picture = Literal["thumbnail", "sheet", "coverage"]
Form = Literal["jpg", "png"]
PointIndex = Annotated[Index, Path()]
Bracket = Annotated[str, Query(pattern=r"^\d{1,2}$", description="which exposure, from 0")]
_IMAGES = stored_file_responses("image/jpeg")


@router.post(
    "",
    status_code=202,
    summary="Capture a plan",
    response_model=JobDocument,
    responses={
        200: {"model": CaptureDocument, "description": "ended in time"},
        **problems(409, 502, 503, 504),
    },
)
async def create(
    request: CaptureRequest,
    lease: Provided[Lease],
    captures: Provided[CaptureService],
    jobs: Provided[JobRunner],
    prefer: PreferHeader = None,
    idempotency_key: IdempotencyHeader = None,
    x_lease: LeaseHeader = None,
) -> JSONResponse:
    """Queue a capture as a job; a name, a plan or a disk that will not do is refused before it starts."""
    lease.check(x_lease)
    job = await run_in_threadpool(captures.start, request, idempotency_key=idempotency_key)
    return await job_answer(jobs, job, prefer=prefer, result=captures.get)


@router.post(
    "/estimates",
    summary="What a plan takes",
    responses=problems(409, 503, 504),
)
@needs(Right.VIEW)
async def estimate(
    request: EstimateRequest, captures: Provided[CaptureService], computing: Provided[ComputeQueue]
) -> EstimateDocument:
    """Return time, size and room on the disk, warnings, and where every view lies in the wide image."""
    asked = await run_in_threadpool(captures.plan_to_estimate, request)
    return await computing.run_apart(estimate_plan, asked)


@router.get("", summary="Captures, newest first")
def every(
    captures: Provided[CaptureService],
    text: Annotated[str, Query(max_length=200, description="words of name, label, id or state")] = "",
    removed: Annotated[Literal["true", "false"], Query(description="those in the trash")] = "false",
) -> list[CaptureDocument]:
    """Return all captures, or those that hold every word of `text`."""
    return captures.search(text=text, removed=removed == "true")


@router.delete("/trash", summary="Empty the trash")
@needs(Right.ADMINISTER)
def empty_trash(captures: Provided[CaptureService]) -> TrashEmptied:
    """Delete for good what was removed."""
    return TrashEmptied(deleted=captures.collection.empty_trash())


@router.get("/{capture_id}", summary="One capture", responses=problems(404))
def one(capture_id: CaptureId, captures: Provided[CaptureService]) -> CaptureDocument:
    """Return one capture; while it runs, with its progress."""
    return captures.get(capture_id)


@router.patch(
    "/{capture_id}",
    summary="Describe a capture",
    responses=problems(404, 409),
)
def patch(capture_id: CaptureId, change: CapturePatch, captures: Provided[CaptureService]) -> CaptureDocument:
    """Change its label or its licence."""
    return captures.edit(capture_id, change)


@router.delete(
    "/{capture_id}", status_code=204, summary="Put a capture in the trash", responses=problems(404, 409)
)
def remove(
    capture_id: CaptureId,
    captures: Provided[CaptureService],
    products: Provided[CaptureProducts],
) -> None:
    """Move it to the trash, from which it can be restored."""
    for product in products:
        product.check_idle(capture_id, "remove its capture")
    captures.remove(capture_id)


@router.post(
    "/{capture_id}/restore",
    summary="Take a capture out of the trash",
    responses=problems(404),
)
def restore(capture_id: CaptureId, captures: Provided[CaptureService]) -> CaptureDocument:
    """Undo its removal."""
    return captures.restore(capture_id)


@router.post(
    "/{capture_id}/resume",
    status_code=202,
    summary="Go on with a partial capture",
    response_model=JobDocument,
    responses={
        200: {"model": CaptureDocument, "description": "ended in time"},
        **problems(404, 409, 502, 503, 504),
    },
)
async def resume(
    capture_id: CaptureId,
    lease: Provided[Lease],
    captures: Provided[CaptureService],
    jobs: Provided[JobRunner],
    prefer: PreferHeader = None,
    idempotency_key: IdempotencyHeader = None,
    x_lease: LeaseHeader = None,
) -> JSONResponse:
    """Queue the rest of a capture, from the exact next point, with its own plan and calibration."""
    lease.check(x_lease)
    job = await run_in_threadpool(captures.resume, capture_id, idempotency_key=idempotency_key)
    return await job_answer(jobs, job, prefer=prefer, result=captures.get)


@router.post(
    "/{capture_id}/pause",
    summary="Let a running capture wait",
    responses=problems(404, 409),
)
def pause(
    capture_id: CaptureId,
    lease: Provided[Lease],
    captures: Provided[CaptureService],
    x_lease: LeaseHeader = None,
) -> CaptureDocument:
    """Wait after the present point; the rig stays reserved for the capture."""
    lease.check(x_lease)
    return captures.pause(capture_id)


@router.post(
    "/{capture_id}/continue",
    summary="Let a paused capture go on",
    responses=problems(404, 409),
)
def go_on(
    capture_id: CaptureId,
    lease: Provided[Lease],
    captures: Provided[CaptureService],
    x_lease: LeaseHeader = None,
) -> CaptureDocument:
    """Continue; also confirms that what was asked for by hand is done."""
    lease.check(x_lease)
    return captures.go_on(capture_id)


@router.get(
    "/{capture_id}/download.zip",
    summary="The dataset as one ZIP file",
    response_class=StreamingResponse,
    responses=file_responses("application/zip"),
    dependencies=[LONG_READ],
)
def download(capture_id: CaptureId, captures: Provided[CaptureService]) -> StreamingResponse:
    """Send the dataset's folder, files as they are."""
    kept = captures.collection.get(capture_id)
    readable_dataset(kept)
    headers = {"Content-Disposition": f'attachment; filename="{kept.id}.zip"'}
    return StreamingResponse(zip_stream(kept.folder), media_type="application/zip", headers=headers)


@router.get(
    "/{capture_id}/{picture}.{form}",
    summary="Thumbnail, contact sheet or coverage",
    response_class=StoredFile,
    responses=_IMAGES,
)
async def picture_of(
    capture_id: CaptureId,
    picture: Picture,
    form: Form,
    captures: Provided[CaptureService],
    computing: Provided[ComputeQueue],
) -> StoredFile:
    """Draw the capture as far as it has come."""
    collection = captures.collection
    path = await computing.run(
        lambda: capture_picture(collection, collection.get(capture_id), picture, form=form)
    )
    return StoredFile(path, media_type=media_type(form))


@router.get(
    "/{capture_id}/anaglyphs/{index}.{form}",
    summary="One point in red and cyan",
    response_class=StoredFile,
    responses=_IMAGES,
)
def anaglyph(
    capture_id: CaptureId,
    index: PointIndex,
    form: Form,
    captures: Provided[CaptureService],
    bracket: Bracket = "0",
) -> StoredFile:
    """Return both foveae of a point, rectified: left in red, right in green and blue."""
    collection = captures.collection
    path = anaglyph_picture(
        collection, collection.get(capture_id), index=index, bracket=int(bracket), form=form
    )
    return StoredFile(path, media_type=media_type(form))


def media_type(form: Form) -> str:
    """Return the media type of a picture."""
    return "image/png" if form == "png" else "image/jpeg"


@router.get("/{capture_id}/points", summary="Its points", responses=problems(404))
def points(capture_id: CaptureId, captures: Provided[CaptureService]) -> PointsDocument:
    """Return the points that were taken, with their places on the contact sheet, and those passed over."""
    return PointsDocument.of(readable_dataset(captures.collection.get(capture_id)))


@router.get(
    "/{capture_id}/points/{index}/{role}.{form}",
    summary="What one camera saw at a point",
    response_class=Response,
    responses=file_responses("image/jpeg"),
)
def picture(
    capture_id: CaptureId,
    index: PointIndex,
    role: Literal["left", "right", "wide"],
    form: Form,
    captures: Provided[CaptureService],
    bracket: Bracket = "0",
) -> Response:
    """Return one picture at full size, 8 bits; of a stack its mean."""
    point = point_of(captures.collection.get(capture_id), index)
    content = frame_picture(point.stacked(Role(role), bracket=int(bracket)), form=form)
    return Response(content, media_type=media_type(form))


@router.post(
    "/{capture_id}/check",
    summary="Is all as it was written",
    responses=problems(404),
    dependencies=[LONG_READ],
)
def check_files(capture_id: CaptureId, captures: Provided[CaptureService]) -> CaptureChecked:
    """Read every file again and say what is wrong, as `foveacam dataset check` does: seconds a gigabyte."""
    kept = captures.collection.get(capture_id)
    faults = check_dataset(kept.folder)
    return CaptureChecked(id=kept.id, sound=not faults, faults=faults)
