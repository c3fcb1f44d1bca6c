"""Routes of measurements: measure at pixels of views, list, rename, remove, export."""

from typing import Annotated

from fastapi import Path
from fastapi.responses import Response

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import problems
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.resources.looking.measurements.export import csv_text
from foveacam_server.resources.looking.measurements.schema import (
    MeasurementDocument,
    MeasurementPatch,
    MeasurementRequest,
)
from foveacam_server.resources.looking.measurements.service import MeasurementService

router = GuardedRouter(tags=["measurements"], reading=Right.VIEW, changing=Right.OPERATE)


MeasurementId = Annotated[str, Path(pattern=r"^mea-[0-9a-f]{1,32}$")]


@router.post("/measurements", status_code=201, summary="Measure", responses=problems(404, 409, 503))
def create(
    request: MeasurementRequest, measurements: Provided[MeasurementService], response: Response
) -> MeasurementDocument:
    """Measure a point, a length, a plane or a profile at pixels of views, and store it."""
    document = measurements.create(request)
    response.headers["Location"] = f"/api/v1/measurements/{document.id}"
    return document


@router.get("/measurements", summary="All measurements, newest first")
def every(measurements: Provided[MeasurementService]) -> list[MeasurementDocument]:
    """Return all measurements."""
    return measurements.every()


@router.get(
    "/measurements.csv",
    summary="All measurements as CSV",
    response_class=Response,
    responses={200: {"content": {"text/csv": {"schema": {"type": "string"}}}, "description": "the table"}},
)
def as_csv(measurements: Provided[MeasurementService]) -> Response:
    """Return one line per measurement, newest first; samples of profiles are in the JSON export only."""
    headers = {"Content-Disposition": 'attachment; filename="measurements.csv"'}
    return Response(csv_text(measurements.every()), media_type="text/csv", headers=headers)


@router.get("/measurements.json", summary="All measurements as a JSON file")
def as_json(measurements: Provided[MeasurementService], response: Response) -> list[MeasurementDocument]:
    """Return all measurements, to be saved as a file."""
    response.headers["Content-Disposition"] = 'attachment; filename="measurements.json"'
    return measurements.every()


@router.get("/measurements/{measurement_id}", summary="One measurement", responses=problems(404))
def one(measurement_id: MeasurementId, measurements: Provided[MeasurementService]) -> MeasurementDocument:
    """Return one measurement."""
    return measurements.get(measurement_id)


@router.patch("/measurements/{measurement_id}", summary="Rename a measurement", responses=problems(404))
def rename(
    measurement_id: MeasurementId, patch: MeasurementPatch, measurements: Provided[MeasurementService]
) -> MeasurementDocument:
    """Give a measurement another label."""
    return measurements.rename(measurement_id, patch.label)


@router.delete(
    "/measurements/{measurement_id}",
    status_code=204,
    summary="Remove a measurement",
    responses=problems(404),
)
def remove(measurement_id: MeasurementId, measurements: Provided[MeasurementService]) -> None:
    """Remove a measurement; the look that it was made in stays."""
    measurements.remove(measurement_id)
