"""Calibrations: which one is in force, how old it is, how far to trust it."""

from fastapi import APIRouter

from foveacam_server.api.answers import problems
from foveacam_server.api.models import CalibrationDocument
from foveacam_server.runtime.documents import calibration_document
from foveacam_server.runtime.services import ServicesDep
from foveacam_server.runtime.store import Document

router = APIRouter(prefix="/calibrations", tags=["calibrations"])


@router.get(
    "", summary="All calibrations of this rig, newest first", response_model=list[CalibrationDocument]
)
async def every(services: ServicesDep) -> list[Document]:
    """Return all calibrations known for this rig."""
    return [calibration_document(calibration) for calibration in services.calibration.every()]


@router.get(
    "/current", summary="The one in force", response_model=CalibrationDocument, responses=problems(409)
)
async def current(services: ServicesDep) -> Document:
    """Return the calibration in force; 409 while there is none."""
    return calibration_document(services.calibration.require())


@router.get(
    "/{calibration_id}",
    summary="One calibration",
    response_model=CalibrationDocument,
    responses=problems(404),
)
async def one(calibration_id: str, services: ServicesDep) -> Document:
    """Return one calibration."""
    return calibration_document(services.calibration.get(calibration_id))
