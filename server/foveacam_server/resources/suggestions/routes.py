"""Good targets for a first look."""

from typing import Annotated

from fastapi import APIRouter, Query

from foveacam_server.assembly.services import ServicesDep
from foveacam_server.foundation.answers import problems
from foveacam_server.resources.suggestions.schema import SuggestionDocument
from foveacam_server.resources.suggestions.service import MOST

router = APIRouter(prefix="/suggestions", tags=["suggestions"])

Count = Annotated[int, Query(ge=1, le=MOST)]


@router.get("", summary="Good targets for a first look", responses=problems(409, 503))
def suggest(services: ServicesDep, count: Count = 3) -> list[SuggestionDocument]:
    """Return targets of the live wide picture that have texture, stand out and are in reach of both eyes."""
    calibration = services.calibration.require()
    return services.suggestions.newest(calibration, count=count)
