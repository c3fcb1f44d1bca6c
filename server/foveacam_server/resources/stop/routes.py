"""Routes of the stop; they need no lease, no queue and no database."""

import asyncio
from concurrent.futures import ThreadPoolExecutor
from typing import Annotated, Protocol

from fastapi import APIRouter, Depends, Request

from foveacam_server.foundation.answers import opened_services
from foveacam_server.rig.schema import StopAnswer, StopDocument
from foveacam_server.rig.stop import StopSwitch

router = APIRouter(prefix="/stop", tags=["stop"])


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
async def engage(request: Request, services: ServicesDep) -> StopAnswer:
    """Park the mirrors, cancel every job, and refuse all moves until released.

    Answered when the mirrors' controller has confirmed, or its driver has given up.
    """
    return await asyncio.wrap_future(services.stopping.submit(services.stop.engage, _who(request)))


@router.delete("", summary="Release the stop")
async def release(request: Request, services: ServicesDep) -> StopDocument:
    """Allow moves again."""
    return services.stop.release(_who(request))


def _who(request: Request) -> str:
    return request.client.host if request.client is not None else "unknown"
