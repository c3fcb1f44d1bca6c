"""Routes of the stop; they need no lease, no queue and no database."""

import asyncio
from concurrent.futures import ThreadPoolExecutor
from typing import Annotated, Protocol

from fastapi import Depends

from foveacam_server.accounts.requests import PeerDep, PrincipalDep
from foveacam_server.accounts.rights import Right, who_at
from foveacam_server.accounts.route_rights import GuardedRouter, needs
from foveacam_server.foundation.http.answers import opened_services
from foveacam_server.rig.schema import StopAnswer, StopDocument
from foveacam_server.rig.stop import StopSwitch

router = GuardedRouter("/stop", tags=["stop"], reading=Right.VIEW, changing=Right.OPERATE)


class StopRouteServices(Protocol):
    """Services that these routes use."""

    stop: StopSwitch
    stopping: ThreadPoolExecutor


ServicesDep = Annotated[StopRouteServices, Depends(opened_services)]


@router.get("", summary="Is the stop engaged?")
async def state(services: ServicesDep) -> StopDocument:
    """Return whether the stop is engaged, since when and by whom."""
    return services.stop.state


@router.post("", summary="Stop: park the mirrors now")
@needs(Right.OPERATE, stops=True)
async def engage(services: ServicesDep, principal: PrincipalDep, peer: PeerDep) -> StopAnswer:
    """Park the mirrors, cancel every job, and refuse all moves until released.

    Answered when the mirrors' controller has confirmed, or its driver has given up.
    """
    return await asyncio.wrap_future(services.stopping.submit(services.stop.engage, who_at(principal, peer)))


@router.delete("", summary="Release the stop")
async def release(services: ServicesDep, principal: PrincipalDep, peer: PeerDep) -> StopDocument:
    """Allow moves again."""
    return services.stop.release(who_at(principal, peer))
