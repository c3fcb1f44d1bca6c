"""Route of suggestions: targets of the live wide picture that are good for a first look."""

from typing import Annotated, Protocol

from fastapi import Depends, Query

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import opened_services, problems
from foveacam_server.resources.looking.suggestions.schema import SuggestionDocument
from foveacam_server.resources.looking.suggestions.service import MOST, SuggestionService
from foveacam_server.rig.ports import CalibrationInForce

router = GuardedRouter("/suggestions", tags=["suggestions"], reading=Right.VIEW, changing=Right.OPERATE)


class SuggestionRouteServices(Protocol):
    """Services that these routes use."""

    suggestions: SuggestionService

    @property
    def calibration(self) -> CalibrationInForce:
        """Calibration in force."""
        ...


ServicesDep = Annotated[SuggestionRouteServices, Depends(opened_services)]

Count = Annotated[int, Query(ge=1, le=MOST)]


@router.get("", summary="Good targets for a first look", responses=problems(409, 503))
def suggest(services: ServicesDep, count: Count = 3) -> list[SuggestionDocument]:
    """Return targets of the live wide picture that have texture, stand out and are in reach of both eyes."""
    calibration = services.calibration.require()
    return services.suggestions.newest(calibration, count=count)
