"""Routes of faults: what fails or failed, and taking it off the list."""

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import problems
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.resources.devices.faults.schema import FaultDocument, FaultsDismissed
from foveacam_server.resources.devices.faults.service import FaultService

router = GuardedRouter("/faults", tags=["events"], reading=Right.VIEW, changing=Right.OPERATE)


@router.get("", summary="Faults and warnings since the start")
async def faults(fault_service: Provided[FaultService]) -> list[FaultDocument]:
    """Return errors first, the newest first within, 50 at most; those that were dismissed are left out."""
    return fault_service.describe()


@router.delete("", summary="Dismiss all that are over")
async def dismiss_over(faults: Provided[FaultService]) -> FaultsDismissed:
    """Take all faults that are over off the list, for everybody; one that comes again is listed again."""
    return faults.dismiss_over()


@router.delete("/{fault_id}", status_code=204, summary="Dismiss a fault", responses=problems(404))
async def dismiss(fault_id: str, faults: Provided[FaultService]) -> None:
    """Take a fault off the list, for everybody; it is listed again when it comes again."""
    faults.dismiss(fault_id)
