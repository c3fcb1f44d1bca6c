"""Routes of the stop; they need no lease, no queue and no database."""

import asyncio
from concurrent.futures import ThreadPoolExecutor

from foveacam_server.accounts.requests import PeerDep, PrincipalDep
from foveacam_server.accounts.rights import Right, who_at
from foveacam_server.accounts.route_rights import GuardedRouter, needs
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.rig.schema import StopAnswer, StopDocument
from foveacam_server.rig.stop import StopSwitch

router = GuardedRouter("/stop", tags=["stop"], reading=Right.VIEW, changing=Right.OPERATE)


@router.get("", summary="Is the stop engaged?")
async def state(stop: Provided[StopSwitch]) -> StopDocument:
    """Return whether the stop is engaged, since when and by whom."""
    return stop.state


@router.post("", summary="Stop: park the mirrors now")
@needs(Right.OPERATE, stops=True)
async def engage(
    stopping: Provided[ThreadPoolExecutor], stop: Provided[StopSwitch], principal: PrincipalDep, peer: PeerDep
) -> StopAnswer:
    """Park the mirrors, cancel every job, and refuse all moves until released.

    Returns when the mirrors' controller has confirmed, or its driver has timed out.
    """
    return await asyncio.wrap_future(stopping.submit(stop.engage, who_at(principal, peer)))


@router.delete("", summary="Release the stop")
async def release(stop: Provided[StopSwitch], principal: PrincipalDep, peer: PeerDep) -> StopDocument:
    """Allow moves again."""
    return stop.release(who_at(principal, peer))
