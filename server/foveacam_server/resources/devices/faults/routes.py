"""Routes of faults: list them, dismiss them."""

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import problems
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.resources.devices.faults.schema import FaultDocument, FaultsDismissed
from foveacam_server.resources.devices.faults.service import FaultService

router = GuardedRouter("/faults", tags=["events"], reading=Right.VIEW, changing=Right.OPERATE)


@router.get("", summary="Faults and warnings since the start")
async def faults(fault_service: Provided[FaultService]) -> list[FaultDocument]:
    """Return at most 50 faults without the dismissed ones; errors first, each level newest first."""
    return fault_service.describe()


@router.delete("", summary="Dismiss all faults that are over")
async def dismiss_over(faults: Provided[FaultService]) -> FaultsDismissed:
    """Remove all faults that are over from the list, for everybody; one that recurs is listed again."""
    return faults.dismiss_over()


@router.delete("/{fault_id}", status_code=204, summary="Dismiss a fault", responses=problems(404))
async def dismiss(fault_id: str, faults: Provided[FaultService]) -> None:
    """Remove a fault from the list, for everybody; it is listed again when it recurs."""
    faults.dismiss(fault_id)
