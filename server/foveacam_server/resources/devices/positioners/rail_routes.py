"""Routes of the rail, which moves the whole rig sideways: status, moves, hold, homing."""

import asyncio

from foveacam_hardware.contract import InvalidInput, NotConnected, RailState
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.http.answers import LeaseHeader, problems
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.lease import Lease
from foveacam_server.resources.devices.positioners.rail import RailService, RailStatus
from foveacam_server.resources.devices.positioners.schema import (
    RailDocument,
    RailLimitsDocument,
    RailMove,
    RailPlaceDocument,
)
from foveacam_server.rig.schema import DeviceInfoDocument

router = GuardedRouter(
    "/rail", tags=["rig"], reading=Right.VIEW, changing=Right.OPERATE, opens=(RailService,)
)


MM_PER_M = 1e3


@router.get("", summary="Position of the rig on its rail")
async def rail(rail_service: Provided[RailService]) -> RailDocument:
    """Return the rail's present position, its limits and its named places."""
    try:
        return await _now(rail_service)
    except NotConnected:  # the rig itself is still opening
        return rail_document(None)


@router.post("/moves", summary="Move the rig sideways", responses=problems(409, 502, 503, 504))
async def move(
    request: RailMove,
    lease: Provided[Lease],
    rail: Provided[RailService],
    events: Provided[EventLog],
    x_lease: LeaseHeader = None,
) -> RailDocument:
    """Start to move the rig to a named place or a position; returns before it arrives."""
    lease.check(x_lease)
    position_mm = await _begin(request, rail)
    events.emit("rail.moved", f"moving the rig to {position_mm:.1f} mm")
    return await _now(rail)


@router.post("/holds", summary="Stop moving sideways now", responses=problems(502, 503, 504))
async def hold(rail: Provided[RailService]) -> RailDocument:
    """Stop the rail where it is; needs no lease."""
    await asyncio.to_thread(rail.hold)
    return await _now(rail)


@router.post("/homings", summary="Find the reference switch", responses=problems(409, 502, 503, 504))
async def home(
    lease: Provided[Lease], rail: Provided[RailService], x_lease: LeaseHeader = None
) -> RailDocument:
    """Start homing: search the reference switch; on a shared board the pan-tilt homes, too."""
    lease.check(x_lease)
    await asyncio.wrap_future(rail.home())
    return await _now(rail)


@router.post(
    "/zero_confirmations", summary="Confirm its zero position", responses=problems(409, 502, 503, 504)
)
async def confirm_zero(
    lease: Provided[Lease],
    rail: Provided[RailService],
    events: Provided[EventLog],
    x_lease: LeaseHeader = None,
) -> RailDocument:
    """Take the present position as the zero on the operator's confirmation, without reference switches.

    It clears the fault of a board that has restarted; on a shared board it applies to every axis.
    """
    lease.check(x_lease)
    await asyncio.wrap_future(rail.confirm_zero())
    events.emit("rail.zero_confirmed", "rail: its present position was confirmed as its zero")
    return await _now(rail)


def rail_document(seen: RailStatus | None) -> RailDocument:
    """Return the document of the rail; None without a rail."""
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
        else RailLimitsDocument(min_mm=MM_PER_M * seen.limits.min_m, max_mm=MM_PER_M * seen.limits.max_m),
        places=[]
        if seen is None
        else [
            RailPlaceDocument(name=place.name, position_mm=MM_PER_M * place.position_m)
            for place in seen.places
        ],
    )


async def _now(service: RailService) -> RailDocument:
    return rail_document(await asyncio.wrap_future(service.read_status()))


async def _begin(request: RailMove, service: RailService) -> float:
    """Start the requested move; return its destination, mm."""
    match request.place, request.position_mm:
        case str(name), None:
            return MM_PER_M * await asyncio.wrap_future(service.move_to_place(name))
        case None, float(position_mm):
            await asyncio.wrap_future(service.move(position_mm / MM_PER_M))
            return position_mm
    raise InvalidInput(
        "a move of the rail needs a place or position_mm, and not both",
        asked="a move of the rail",
        remedy='send one of them, such as {"place": "centre"} or {"position_mm": 0}',
    )


def _mm(position_m: float | None) -> float | None:
    return None if position_m is None else round(MM_PER_M * position_m, 3)
