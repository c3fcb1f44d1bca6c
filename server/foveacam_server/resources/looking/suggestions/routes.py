"""Routes of suggestions: targets of the live wide picture that are good for a first look."""

from typing import Annotated

from fastapi import Query

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import LeaseHeader, problems
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.lease import Lease
from foveacam_server.resources.looking.suggestions.schema import SuggestionDocument
from foveacam_server.resources.looking.suggestions.service import MOST, SuggestionService
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.ports import CalibrationInForce

router = GuardedRouter(
    "/suggestions",
    tags=["suggestions"],
    reading=Right.VIEW,
    changing=Right.OPERATE,
    opens=(SuggestionService,),
)


Count = Annotated[int, Query(ge=1, le=MOST)]


@router.get("", summary="Good targets for a first look", responses=problems(409, 503))
def suggest(
    calibration_in_force: Provided[CalibrationInForce],
    suggestions: Provided[SuggestionService],
    count: Count = 3,
) -> list[SuggestionDocument]:
    """Return targets of the live wide picture that are textured, salient and within reach of both eyes."""
    calibration = calibration_in_force.require()
    return suggestions.newest(calibration, count=count)


@router.post("/checks", summary="Look at the suggested targets", responses=problems(409, 502, 503, 504))
def check(
    calibration_in_force: Provided[CalibrationInForce],
    suggestions: Provided[SuggestionService],
    hardware: Provided[HardwareThread],
    lease: Provided[Lease],
    count: Count = 3,
    x_lease: LeaseHeader = None,
) -> list[SuggestionDocument]:
    """Move the mirrors to suggestions, for 8 s at most; return those on which both foveae verge."""
    lease.check(x_lease)
    return suggestions.verify(calibration_in_force.require(), hardware, count=count)
