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
    """A product computed from captures: mosaics or references."""

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
    """Queue a capture as a job; an unusable name or plan or a full disk is refused before it starts."""
    lease.check(x_lease)
    job = await run_in_threadpool(captures.start, request, idempotency_key=idempotency_key)
    return await job_answer(jobs, job, prefer=prefer, result=captures.get)


@router.post(
    "/estimates",
    summary="Estimate a plan",
    responses=problems(409, 503, 504),
)
@needs(Right.VIEW)
async def estimate(
    request: EstimateRequest, captures: Provided[CaptureService], computing: Provided[ComputeQueue]
) -> EstimateDocument:
    """Return time, size, free disk space, warnings, and the outline of every view in the wide image."""
    asked = await run_in_threadpool(captures.plan_to_estimate, request)
    return await computing.run_apart(estimate_plan, asked)


@router.get("", summary="Captures, newest first")
def every(
    captures: Provided[CaptureService],
    text: Annotated[str, Query(max_length=200, description="words of name, label, id or state")] = "",
    removed: Annotated[Literal["true", "false"], Query(description="those in the trash")] = "false",
) -> list[CaptureDocument]:
    """Return all captures, or those that contain every word of `text`."""
    return captures.search(text=text, removed=removed == "true")


@router.delete("/trash", summary="Empty the trash")
@needs(Right.ADMINISTER)
def empty_trash(captures: Provided[CaptureService]) -> TrashEmptied:
    """Delete the captures in the trash for good."""
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
    """Change a capture's label or licence."""
    return captures.edit(capture_id, change)


@router.delete(
    "/{capture_id}", status_code=204, summary="Put a capture in the trash", responses=problems(404, 409)
)
def remove(
    capture_id: CaptureId,
    captures: Provided[CaptureService],
    products: Provided[CaptureProducts],
) -> None:
    """Move a capture to the trash, from which it can be restored."""
    for product in products:
        product.check_idle(capture_id, "remove its capture")
    captures.remove(capture_id)


@router.post(
    "/{capture_id}/restore",
    summary="Restore a capture from the trash",
    responses=problems(404),
)
def restore(capture_id: CaptureId, captures: Provided[CaptureService]) -> CaptureDocument:
    """Restore a capture from the trash."""
    return captures.restore(capture_id)


@router.post(
    "/{capture_id}/resume",
    status_code=202,
    summary="Resume a partial capture",
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
    """Queue the rest of a capture, from exactly the next point, with its own plan and calibration."""
    lease.check(x_lease)
    job = await run_in_threadpool(captures.resume, capture_id, idempotency_key=idempotency_key)
    return await job_answer(jobs, job, prefer=prefer, result=captures.get)


@router.post(
    "/{capture_id}/pause",
    summary="Pause a running capture",
    responses=problems(404, 409),
)
def pause(
    capture_id: CaptureId,
    lease: Provided[Lease],
    captures: Provided[CaptureService],
    x_lease: LeaseHeader = None,
) -> CaptureDocument:
    """Pause after the present point; the rig stays reserved for the capture."""
    lease.check(x_lease)
    return captures.pause(capture_id)


@router.post(
    "/{capture_id}/continue",
    summary="Continue a paused capture",
    responses=problems(404, 409),
)
def go_on(
    capture_id: CaptureId,
    lease: Provided[Lease],
    captures: Provided[CaptureService],
    x_lease: LeaseHeader = None,
) -> CaptureDocument:
    """Continue a paused capture; also confirms that the requested manual action is done."""
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
    """Send the dataset's folder with unchanged files."""
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
    """Draw the capture's points so far."""
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
    """Return the captured points, with their places on the contact sheet, and the skipped ones."""
    return PointsDocument.of(readable_dataset(captures.collection.get(capture_id)))


@router.get(
    "/{capture_id}/points/{index}/{role}.{form}",
    summary="Picture of one camera at a point",
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
    """Return one picture at full size, 8 bits; the mean of a stack."""
    point = point_of(captures.collection.get(capture_id), index)
    content = frame_picture(point.stacked(Role(role), bracket=int(bracket)), form=form)
    return Response(content, media_type=media_type(form))


@router.post(
    "/{capture_id}/check",
    summary="Verify the dataset's files",
    responses=problems(404),
    dependencies=[LONG_READ],
)
def check_files(capture_id: CaptureId, captures: Provided[CaptureService]) -> CaptureChecked:
    """Read every file again and list the faults, as `foveacam dataset check` does: seconds per gigabyte."""
    kept = captures.collection.get(capture_id)
    faults = check_dataset(kept.folder)
    return CaptureChecked(id=kept.id, sound=not faults, faults=faults)
