"""The stop: parks the mirrors at once. It asks nobody: no lease, no queue, no database."""

import asyncio

from fastapi import APIRouter, Request

from foveacam_server.api.models import StopAnswer, StopDocument
from foveacam_server.runtime.services import ServicesDep

router = APIRouter(prefix="/stop", tags=["stop"])

ANSWER_WITHIN_S = 0.08
"""Longest that the answer waits for the mirrors' confirmation."""


@router.get("", summary="Is the stop engaged?")
async def state(services: ServicesDep) -> StopDocument:
    """Return whether the stop is engaged, since when and by whom."""
    found = services.stop.state
    return StopDocument(engaged=found.engaged, since_utc=found.since_utc, by=found.by)


@router.post("", summary="Stop: park the mirrors now")
async def engage(request: Request, services: ServicesDep) -> StopAnswer:
    """Park the mirrors, cancel every job, and refuse all moves until released."""
    engaging = asyncio.wrap_future(services.stopping.submit(services.stop.engage, _who(request)))
    done, _ = await asyncio.wait([engaging], timeout=ANSWER_WITHIN_S)
    return StopAnswer(engaged=True, parked=bool(done) and engaging.result())


@router.delete("", summary="Release the stop")
async def release(request: Request, services: ServicesDep) -> StopDocument:
    """Allow moves again."""
    found = services.stop.release(_who(request))
    return StopDocument(engaged=found.engaged, since_utc=found.since_utc, by=found.by)


def _who(request: Request) -> str:
    return request.client.host if request.client is not None else "unknown"
