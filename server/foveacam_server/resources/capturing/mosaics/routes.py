"""Routes of a capture's mosaic: compute it, its tiles and files, its surface in the 3D scene."""

from pathlib import Path
from typing import Annotated, Literal

from fastapi import Header, Query
from fastapi import Path as InPath
from fastapi.responses import JSONResponse, Response
from starlette.concurrency import run_in_threadpool

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.datasets.capture_id import CaptureId
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.http.answers import (
    IdempotencyHeader,
    PreferHeader,
    file_responses,
    job_answer,
    problems,
)
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.http.stored_file import StoredFile, stored_file_responses
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.quantities import Index
from foveacam_server.foundation.schema import JobDocument
from foveacam_server.resources.capturing.mosaics.collection import FILES, FORMS
from foveacam_server.resources.capturing.mosaics.schema import MosaicDocument, MosaicRequest
from foveacam_server.resources.capturing.mosaics.service import MosaicService

router = GuardedRouter(
    "/captures/{capture_id}/mosaic", tags=["mosaics"], reading=Right.VIEW, changing=Right.OPERATE
)


Layer = Literal["picture", "depth"]
Level = Annotated[int, InPath(ge=0, le=32)]
TileIndex = Annotated[Index, InPath()]
Made = Annotated[str | None, Query(max_length=40, description="version of the mosaic, from its document")]
IfNoneMatch = Annotated[str | None, Header(max_length=400, description="what the caller has kept")]
_MEDIA = {"jpg": "image/jpeg", "png": "image/png"}
_FOR_GOOD = "private, max-age=31536000, immutable"
"""Cache header of a URL with a mosaic's version: its content never changes."""
_ASK_AGAIN = "no-cache"
_TILE = file_responses("image/jpeg") | {304: {"description": "the caller has it"}}


@router.post(
    "",
    status_code=202,
    summary="Make a capture's mosaic",
    response_model=JobDocument,
    responses={
        200: {"model": MosaicDocument, "description": "ended in time"},
        **problems(404, 409, 502, 503, 504),
    },
)
async def make(
    capture_id: CaptureId,
    mosaics: Provided[MosaicService],
    jobs: Provided[JobRunner],
    request: MosaicRequest | None = None,
    prefer: PreferHeader = None,
    idempotency_key: IdempotencyHeader = None,
) -> JSONResponse:
    """Queue a mosaic, or the rest of an unfinished one, as a job without the rig; refuse an impossible one.

    An older mosaic of the capture stays until the new one is finished.
    """
    job = await run_in_threadpool(
        mosaics.start, capture_id, request or MosaicRequest(), idempotency_key=idempotency_key
    )
    return await job_answer(jobs, job, prefer=prefer, result=lambda _: mosaics.get(capture_id))


@router.get("", summary="A capture's mosaic", responses=problems(404))
def one(capture_id: CaptureId, mosaics: Provided[MosaicService]) -> MosaicDocument:
    """Return the mosaic's state, its job's progress, and its estimated size or why none is possible."""
    return mosaics.get(capture_id)


@router.delete("", status_code=204, summary="Remove a capture's mosaic", responses=problems(404, 409))
def remove(capture_id: CaptureId, mosaics: Provided[MosaicService]) -> None:
    """Remove the files of the mosaic, also of an unfinished one; the capture stays."""
    mosaics.remove(capture_id)


@router.put(
    "/in_scene",
    summary="Show the mosaic in 3D",
    responses=problems(404, 409, 503),
)
def show(capture_id: CaptureId, mosaics: Provided[MosaicService]) -> MosaicDocument:
    """Show the mosaic's surface in the 3D scene, replacing another mosaic's."""
    mosaics.show(capture_id)
    return mosaics.get(capture_id)


@router.delete(
    "/in_scene",
    summary="Take the mosaic out of the 3D scene",
    responses=problems(404),
)
def hide(capture_id: CaptureId, mosaics: Provided[MosaicService]) -> MosaicDocument:
    """Remove the mosaic's surface from the 3D scene, if it is there."""
    mosaics.hide(capture_id)
    return mosaics.get(capture_id)


@router.get(
    "/tiles/{layer}.dzi",
    summary="A layer as Deep Zoom",
    response_class=StoredFile,
    responses=stored_file_responses("application/xml"),
)
def descriptor(capture_id: CaptureId, layer: Layer, mosaics: Provided[MosaicService]) -> StoredFile:
    """Return the Deep Zoom descriptor; its tiles are beside it, as Deep Zoom requires."""
    path = mosaics.collection.file(capture_id, f"{FILES[layer]}.dzi")
    return StoredFile(path, media_type="application/xml", headers={"Cache-Control": _ASK_AGAIN})


@router.get(
    "/tiles/{layer}_files/{level}/{x}_{y}.{form}",
    summary="One tile",
    response_class=StoredFile,
    responses=_TILE,
)
def tile(
    capture_id: CaptureId,
    layer: Layer,
    level: Level,
    x: TileIndex,
    y: TileIndex,
    form: Literal["jpg", "png"],
    mosaics: Provided[MosaicService],
    made: Made = None,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Return one tile: JPEG of the picture, PNG of the depth."""
    if form != FORMS[layer]:
        raise NotFound(f"tiles of the {layer} are {FORMS[layer]} files", asked=f"a {form} file")
    path = mosaics.collection.tile(capture_id, layer, level=level, column=x, row=y)
    return _sent(path, mosaics, capture_id, made=made, kept=if_none_match)


@router.get(
    "/{picture}.png",
    summary="Overview, or depth as colours",
    response_class=StoredFile,
    responses=file_responses("image/png"),
)
def picture_of(
    capture_id: CaptureId,
    picture: Literal["overview", "depth"],
    mosaics: Provided[MosaicService],
    made: Made = None,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Return the whole picture at 2048 px at most, or the heat map of depth with its scale."""
    path = mosaics.collection.file(capture_id, f"{picture}.png")
    return _sent(path, mosaics, capture_id, made=made, kept=if_none_match)


@router.get(
    "/mesh.glb",
    summary="The surface as GLB",
    response_class=StoredFile,
    responses=stored_file_responses("model/gltf-binary"),
)
def glb(capture_id: CaptureId, mosaics: Provided[MosaicService], made: Made = None) -> StoredFile:
    """Return the textured surface of the whole field, in metres, +y up."""
    path = mosaics.collection.file(capture_id, "mesh.glb")
    return StoredFile(path, media_type="model/gltf-binary", filename=f"{capture_id}-mosaic.glb")


@router.get(
    "/cloud.ply",
    summary="The points as PLY",
    response_class=StoredFile,
    responses=stored_file_responses("application/octet-stream"),
)
def ply(capture_id: CaptureId, mosaics: Provided[MosaicService], made: Made = None) -> StoredFile:
    """Return x, y, z (m, rig frame), colour and sigma of every point."""
    path = mosaics.collection.file(capture_id, "cloud.ply")
    return StoredFile(path, media_type="application/octet-stream", filename=f"{capture_id}-mosaic.ply")


def _sent(
    path: Path, mosaics: MosaicService, capture_id: str, *, made: str | None, kept: str | None
) -> Response:
    """Send a file; a URL with the mosaic's version may be cached for good."""
    version = mosaics.collection.require(capture_id).version
    tag = f'"{version}"'
    headers = {"ETag": tag, "Cache-Control": _FOR_GOOD if made == version else _ASK_AGAIN}
    if kept is not None and tag in kept:
        return Response(status_code=304, headers=headers)
    try:
        content = path.read_bytes()  # read completely now: the file may be removed at any moment
    except FileNotFoundError:
        raise NotFound(f"{path.name} went with its mosaic", asked=path.name) from None
    return Response(content, media_type=_MEDIA[path.suffix[1:]], headers=headers)
