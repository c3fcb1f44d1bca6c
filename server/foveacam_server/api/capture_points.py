"""What a capture holds, looked at: its points, what each camera saw, and whether all is as it was written."""

from typing import Annotated, Literal

from fastapi import APIRouter, Path, Query, Response

from foveacam_hardware.contract import Role
from foveacam_pipeline.capture.dataset import check_dataset
from foveacam_server.api.answers import file_responses, problems
from foveacam_server.api.capture_models import CaptureChecked, PointsDocument
from foveacam_server.api.captures import CaptureId, Form, media_type
from foveacam_server.capturing.points import point_of, point_picture, points_document, readable_dataset
from foveacam_server.quantities import Index
from foveacam_server.runtime.services import ServicesDep
from foveacam_server.runtime.store import Document

router = APIRouter(prefix="/captures", tags=["captures"])

PointIndex = Annotated[Index, Path()]
Bracket = Annotated[str, Query(pattern=r"^\d{1,2}$", description="which exposure, from 0")]


@router.get(
    "/{capture_id}/points", summary="Its points", response_model=PointsDocument, responses=problems(404)
)
def points(capture_id: CaptureId, services: ServicesDep) -> Document:
    """Return the points that were taken, with their places on the contact sheet, and those passed over."""
    return points_document(readable_dataset(services.captures.shelf.get(capture_id)))


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
    services: ServicesDep,
    bracket: Bracket = "0",
) -> Response:
    """Return one picture at full size, 8 bits; of a stack its mean."""
    point = point_of(services.captures.shelf.get(capture_id), index)
    content = point_picture(point, Role(role), bracket=int(bracket), form=form)
    return Response(content, media_type=media_type(form))


@router.post(
    "/{capture_id}/check",
    summary="Is all as it was written",
    response_model=CaptureChecked,
    responses=problems(404),
)
def check_files(capture_id: CaptureId, services: ServicesDep) -> Document:
    """Read every file again and say what is wrong, as `foveacam dataset check` does: seconds a gigabyte."""
    kept = services.captures.shelf.get(capture_id)
    faults = check_dataset(kept.folder)
    return {"id": kept.id, "sound": not faults, "faults": faults}
