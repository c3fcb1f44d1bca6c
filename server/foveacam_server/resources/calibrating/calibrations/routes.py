"""Routes of calibrations: list, put in force, health, compare, import and export, trash, report."""

from typing import Annotated, Any, Literal

from fastapi import Body, Path, Query
from fastapi.responses import HTMLResponse, Response

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter, needs
from foveacam_server.foundation.computing.compute_queue import ComputeQueue
from foveacam_server.foundation.http.answers import (
    FILE_BYTES,
    LeaseHeader,
    file_responses,
    problems,
)
from foveacam_server.foundation.http.large_bodies import LargeBodyRoute
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.lease import Lease
from foveacam_server.resources.calibrating.calibrations.record_files import FileFormat
from foveacam_server.resources.calibrating.calibrations.records import CalibrationRecords
from foveacam_server.resources.calibrating.calibrations.schema import (
    CalibrationDocument,
    ComparisonDocument,
    HealthDocument,
)
from foveacam_server.resources.calibrating.calibrations.service import CalibrationService

router = GuardedRouter(
    "/calibrations",
    tags=["calibrations"],
    reading=Right.VIEW,
    changing=Right.OPERATE,
    route_class=LargeBodyRoute,
)


CalibrationId = Annotated[str, Path(max_length=64)]
WhichOne = Annotated[str, Query(pattern=r"^[0-9a-f]{1,64}$", description="id of a calibration")]
DistanceQuery = Annotated[float | None, Query(gt=0.0, le=1000.0, allow_inf_nan=False)]
_JSON_FILE = {
    200: {"content": {"application/json": {"schema": {"type": "object"}}}, "description": "the file"},
    **problems(404),
}


@router.get("", summary="All calibrations of this rig, newest first")
def every(
    calibration_service: Provided[CalibrationService],
    records: Provided[CalibrationRecords],
    removed: Annotated[Literal["true", "false"], Query(description="those in the trash")] = "false",
) -> list[CalibrationDocument]:
    """Return all calibrations known for this rig, or those that were discarded."""
    found = calibration_service.discarded() if removed == "true" else calibration_service.every()
    return [records.describe(calibration) for calibration in found]


@router.get("/current", summary="Calibration in force", responses=problems(409, 503))
async def current(
    records: Provided[CalibrationRecords], calibration: Provided[CalibrationService]
) -> CalibrationDocument:
    """Return the calibration in force; 409 without one, 503 while the rig opens."""
    return records.describe(calibration.require())


@router.get("/health", summary="Health of the calibration in force")
async def health(records: Provided[CalibrationRecords]) -> HealthDocument:
    """Return the health of the calibration in force, from the residuals of ordinary fixations."""
    return records.health()


@router.get("/compare", summary="Compare two", responses=problems(404))
async def compare(
    a: WhichOne, b: WhichOne, computing: Provided[ComputeQueue], records: Provided[CalibrationRecords]
) -> ComparisonDocument:
    """Return the differences of calibration b from a, in pixels of the pictures."""
    return await computing.run(lambda: records.compare(a, b))


@router.get(
    "/compare.png",
    summary="Compare two calibrations, as a picture",
    response_class=Response,
    responses=file_responses("image/png"),
)
async def compare_png(
    a: WhichOne, b: WhichOne, computing: Provided[ComputeQueue], records: Provided[CalibrationRecords]
) -> Response:
    """Return a picture of the differences of two calibrations over the field."""
    picture = await computing.run(lambda: records.compare_picture(a, b))
    return Response(picture, media_type="image/png")


@router.post(
    "/import",
    status_code=201,
    summary="Import a calibration from a file",
    responses=problems(409, 503),
    max_body_size=FILE_BYTES,
)
def import_file(
    document: Annotated[dict[str, Any], Body()],  # Any: a file of another program, checked where it is read
    records: Provided[CalibrationRecords],
    distance_m: DistanceQuery = None,
) -> CalibrationDocument:
    """Store the calibration of a file of this program, or of the authors' device bundle.

    A bundle lacks the distance of its markers: give `distance_m`.
    """
    return records.import_file(document, distance_m=distance_m)


@router.get("/{calibration_id}", summary="One calibration", responses=problems(404))
async def one(
    calibration_id: CalibrationId,
    records: Provided[CalibrationRecords],
    calibration: Provided[CalibrationService],
) -> CalibrationDocument:
    """Return one calibration."""
    return records.describe(calibration.get(calibration_id))


@router.delete(
    "/{calibration_id}", status_code=204, summary="Discard a calibration", responses=problems(404, 409)
)
def discard(calibration_id: CalibrationId, calibration: Provided[CalibrationService]) -> None:
    """Move a calibration to the trash, from which it can be restored; not one in force or shipped."""
    calibration.discard(calibration_id)


@router.post(
    "/{calibration_id}/restore", summary="Take a calibration out of the trash", responses=problems(404)
)
def restore(
    calibration_id: CalibrationId,
    records: Provided[CalibrationRecords],
    calibration: Provided[CalibrationService],
) -> CalibrationDocument:
    """Restore a calibration from the trash; the one in force stays in force."""
    return records.describe(calibration.restore(calibration_id))


@router.post("/{calibration_id}/activate", summary="Put a calibration in force", responses=problems(404, 409))
@needs(Right.ADMINISTER)
def activate(
    calibration_id: CalibrationId,
    lease: Provided[Lease],
    records: Provided[CalibrationRecords],
    calibration: Provided[CalibrationService],
    x_lease: LeaseHeader = None,
) -> CalibrationDocument:
    """Put a calibration in force, now and at every start of the server."""
    lease.check(x_lease)
    return records.describe(calibration.activate(calibration_id))


@router.get(
    "/{calibration_id}/report",
    summary="Report of a calibration, as a page",
    response_class=HTMLResponse,
    responses=problems(404),
)
async def report(
    calibration_id: CalibrationId, computing: Provided[ComputeQueue], records: Provided[CalibrationRecords]
) -> HTMLResponse:
    """Return a self-contained HTML page: measured figures beside the paper's, and all pictures."""
    return HTMLResponse(await computing.run(lambda: records.report(calibration_id)))


@router.get("/{calibration_id}/file", summary="One as a file", response_class=Response, responses=_JSON_FILE)
def download(
    calibration_id: CalibrationId,
    records: Provided[CalibrationRecords],
    file_format: Annotated[FileFormat, Query(alias="format")] = "foveacam",
) -> Response:
    """Return the calibration as a file of this program, or with its poses as the authors' device bundle."""
    content = records.file(calibration_id, file_format)
    name = f"{calibration_id}.json" if file_format == "foveacam" else f"{calibration_id}-bundle.json"
    return Response(
        content,
        media_type="application/json",
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )
