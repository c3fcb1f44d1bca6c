"""The stop: parks the mirrors at once. It asks nobody: no lease, no queue, no database."""

import asyncio

from fastapi import APIRouter, Request

from foveacam_server.api.models import StopAnswer, StopDocument
from foveacam_server.runtime.services import ServicesDep
from foveacam_server.runtime.stop import StopOutcome

router = APIRouter(prefix="/stop", tags=["stop"])


@router.get("", summary="Is the stop engaged?")
async def state(services: ServicesDep) -> StopDocument:
    """Return whether the stop is engaged, since when and by whom."""
    found = services.stop.state
    return StopDocument(engaged=found.engaged, since_utc=found.since_utc, by=found.by)


@router.post("", summary="Stop: park the mirrors now")
async def engage(request: Request, services: ServicesDep) -> StopAnswer:
    """Park the mirrors, cancel every job, and refuse all moves until released.

    Answered when the mirrors' controller has confirmed, or its driver has given up.
    """
    return stop_answer(
        await asyncio.wrap_future(services.stopping.submit(services.stop.engage, _who(request)))
    )


@router.delete("", summary="Release the stop")
async def release(request: Request, services: ServicesDep) -> StopDocument:
    """Allow moves again."""
    found = services.stop.release(_who(request))
    return StopDocument(engaged=found.engaged, since_utc=found.since_utc, by=found.by)


def stop_answer(outcome: StopOutcome) -> StopAnswer:
    """Return the answer to a stop, whichever way it came in."""
    return StopAnswer(engaged=True, parked=outcome.parked, parked_in_ms=outcome.parked_in_ms)


def _who(request: Request) -> str:
    return request.client.host if request.client is not None else "unknown"
