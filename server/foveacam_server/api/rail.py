"""The rail: where the whole rig stands, moving it sideways, and stopping that."""

import asyncio

from fastapi import APIRouter

from foveacam_hardware.contract import InvalidInput, NotConnected, RailState
from foveacam_server.api.answers import LeaseHeader, problems
from foveacam_server.api.rail_models import RailDocument, RailLimitsDocument, RailMove, RailPlaceDocument
from foveacam_server.api.rig_models import DeviceInfoDocument
from foveacam_server.runtime.rail import RailService, RailStatus
from foveacam_server.runtime.services import ServicesDep

router = APIRouter(prefix="/rail", tags=["rig"])

MM_A_M = 1e3


@router.get("", summary="Where the rig stands on its rail")
async def rail(services: ServicesDep) -> RailDocument:
    """Return where the rail is now, its limits and its named places."""
    try:
        return await _now(services.rail)
    except NotConnected:  # the rig itself is still opening
        return rail_document(None)


@router.post("/moves", summary="Move the rig sideways", responses=problems(409, 502, 503, 504))
async def move(request: RailMove, services: ServicesDep, x_lease: LeaseHeader = None) -> RailDocument:
    """Begin to move the rig to a place or a position; answer while it moves."""
    services.lease.check(x_lease)
    position_mm = await _begin(request, services.rail)
    services.events.emit("rail.moved", f"moving the rig to {position_mm:.1f} mm")
    return await _now(services.rail)


@router.post("/holds", summary="Stop moving sideways now", responses=problems(502, 503, 504))
async def hold(services: ServicesDep) -> RailDocument:
    """Stop the rail where it is; needs no lease."""
    await asyncio.to_thread(services.rail.hold)
    return await _now(services.rail)


@router.post("/homings", summary="Find the reference switch", responses=problems(409, 502, 503, 504))
async def home(services: ServicesDep, x_lease: LeaseHeader = None) -> RailDocument:
    """Begin to look for the reference switch; on a shared board the pan-tilt looks for its own, too."""
    services.lease.check(x_lease)
    await asyncio.wrap_future(services.rail.home())
    return await _now(services.rail)


@router.post(
    "/zero_confirmations", summary="Say that it stands at its zero", responses=problems(409, 502, 503, 504)
)
async def confirm_zero(services: ServicesDep, x_lease: LeaseHeader = None) -> RailDocument:
    """Take the operator's word that the rail stands at its zero; for one without reference switches.

    It ends the fault of a board that has restarted; on a shared board it is said of every axis.
    """
    services.lease.check(x_lease)
    await asyncio.wrap_future(services.rail.confirm_zero())
    services.events.emit("rail.zero_confirmed", "rail: said to stand at its zero")
    return await _now(services.rail)


def rail_document(seen: RailStatus | None) -> RailDocument:
    """Return the rail as REST shows it; None when there is none."""
    state = RailState(connected=False) if seen is None else seen.state
    info = None if seen is None else seen.info
    return RailDocument(
        present=seen is not None,
        info=None
        if info is None
        else DeviceInfoDocument(
            vendor=info.vendor, model=info.model, serial=info.serial, version=info.version
        ),
        moves_itself=seen is not None and seen.moves_itself,
        wanted_mm=_mm(state.wanted_m),
        connected=state.connected,
        homed=state.homed,
        moving=state.moving,
        position_mm=_mm(state.position_m),
        fault=state.fault,
        awaits_zero=state.awaits_zero,
        limits=None
        if seen is None
        else RailLimitsDocument(min_mm=MM_A_M * seen.limits.min_m, max_mm=MM_A_M * seen.limits.max_m),
        places=[]
        if seen is None
        else [
            RailPlaceDocument(name=place.name, position_mm=MM_A_M * place.position_m) for place in seen.places
        ],
    )


async def _now(desk: RailService) -> RailDocument:
    return rail_document(await asyncio.wrap_future(desk.seen_now()))


async def _begin(request: RailMove, desk: RailService) -> float:
    """Begin the move that was asked for; return where to, mm."""
    match request.place, request.position_mm:
        case str(name), None:
            return MM_A_M * await asyncio.wrap_future(desk.move_to_place(name))
        case None, float(position_mm):
            await asyncio.wrap_future(desk.move(position_mm / MM_A_M))
            return position_mm
    raise InvalidInput(
        "a move of the rail needs a place or position_mm, and not both; send one of them",
        asked="a move of the rail",
        remedy='send {"place": "centre"} or {"position_mm": 0}',
    )


def _mm(position_m: float | None) -> float | None:
    return None if position_m is None else round(MM_A_M * position_m, 3)
