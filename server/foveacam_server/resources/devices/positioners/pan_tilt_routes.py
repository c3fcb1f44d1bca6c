"""Routes of the pan-tilt, which turns the whole rig: status, moves, hold, homing."""

import asyncio
import math

from foveacam_hardware.contract import InvalidInput, PanTiltLimits, PanTiltPose, PanTiltState, Station
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.http.answers import LeaseHeader, problems
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.lease import Lease
from foveacam_server.foundation.quantities import deg
from foveacam_server.resources.devices.positioners.pan_tilt import PanTiltService
from foveacam_server.resources.devices.positioners.schema import (
    PanTiltDocument,
    PanTiltLimitsDocument,
    PanTiltMove,
    StationDocument,
)
from foveacam_server.rig.schema import DeviceInfoDocument

router = GuardedRouter(
    "/pan_tilt", tags=["rig"], reading=Right.VIEW, changing=Right.OPERATE, opens=(PanTiltService,)
)


ABSENT = PanTiltState(connected=False)


@router.get("", summary="Where the rig points")
async def pan_tilt(pan_tilt_service: Provided[PanTiltService]) -> PanTiltDocument:
    """Return the pan-tilt's present pose, its limits and the rig's stations."""
    if not pan_tilt_service.usable:
        return pan_tilt_document(pan_tilt_service)
    return await _now(pan_tilt_service)


@router.post("/moves", summary="Turn the rig", responses=problems(409, 502, 503, 504))
async def move(
    request: PanTiltMove,
    lease: Provided[Lease],
    pan_tilt: Provided[PanTiltService],
    events: Provided[EventLog],
    x_lease: LeaseHeader = None,
) -> PanTiltDocument:
    """Start to turn the rig to a station or a bearing; returns before it arrives."""
    lease.check(x_lease)
    pose = _pose(request, pan_tilt)
    await asyncio.wrap_future(pan_tilt.move(pose))
    events.emit("pan_tilt.moved", f"turning the rig to {deg(pose.pan_rad):.2f}°, {deg(pose.tilt_rad):.2f}°")
    return await _now(pan_tilt)


@router.post("/holds", summary="Stop turning now", responses=problems(502, 503, 504))
async def hold(pan_tilt: Provided[PanTiltService]) -> PanTiltDocument:
    """Stop the pan-tilt where it is; needs no lease."""
    await asyncio.to_thread(pan_tilt.hold)
    return await _now(pan_tilt)


@router.post("/homings", summary="Find the reference switches", responses=problems(409, 502, 503, 504))
async def home(
    lease: Provided[Lease], pan_tilt: Provided[PanTiltService], x_lease: LeaseHeader = None
) -> PanTiltDocument:
    """Start homing: search the reference switches; it clears an alarm."""
    lease.check(x_lease)
    await asyncio.wrap_future(pan_tilt.home())
    return await _now(pan_tilt)


@router.post(
    "/zero_confirmations", summary="Confirm its zero position", responses=problems(409, 502, 503, 504)
)
async def confirm_zero(
    lease: Provided[Lease],
    pan_tilt: Provided[PanTiltService],
    events: Provided[EventLog],
    x_lease: LeaseHeader = None,
) -> PanTiltDocument:
    """Take the present pose as the zero on the operator's confirmation, without reference switches.

    It clears the fault of a board that has restarted; on a shared board it applies to every axis.
    """
    lease.check(x_lease)
    await asyncio.wrap_future(pan_tilt.confirm_zero())
    events.emit("pan_tilt.zero_confirmed", "pan-tilt: its present pose was confirmed as its zero")
    return await _now(pan_tilt)


def pan_tilt_document(service: PanTiltService, state: PanTiltState | None = None) -> PanTiltDocument:
    """Return the pan-tilt's document; `state`: one newer than the last status."""
    status = service.status
    seen = state or (ABSENT if status is None else status.state)
    info = None if status is None else status.info
    return PanTiltDocument(
        present=status is not None,
        info=None
        if info is None
        else DeviceInfoDocument(
            vendor=info.vendor, model=info.model, serial=info.serial, version=info.version
        ),
        moves_itself=status is not None and status.moves_itself,
        wanted_pan_deg=None if seen.wanted is None else deg(seen.wanted.pan_rad),
        wanted_tilt_deg=None if seen.wanted is None else deg(seen.wanted.tilt_rad),
        connected=seen.connected,
        homed=seen.homed,
        moving=seen.moving,
        pan_deg=None if seen.pose is None else deg(seen.pose.pan_rad),
        tilt_deg=None if seen.pose is None else deg(seen.pose.tilt_rad),
        fault=seen.fault,
        awaits_zero=seen.awaits_zero,
        limits=None if status is None else _limits(status.limits),
        stations=[_station(station) for station in service.stations],
    )


async def _now(service: PanTiltService) -> PanTiltDocument:
    state = await asyncio.wrap_future(service.read_state())
    return pan_tilt_document(service, state)


def _pose(request: PanTiltMove, service: PanTiltService) -> PanTiltPose:
    match request.station, request.pan_deg, request.tilt_deg:
        case str(name), None, None:
            return service.station(name).pose
        case None, float(pan_deg), float(tilt_deg):
            return PanTiltPose(pan_rad=math.radians(pan_deg), tilt_rad=math.radians(tilt_deg))
    raise InvalidInput(
        "a move of the pan-tilt needs a station, or pan_deg and tilt_deg, and not both",
        asked="a move of the pan-tilt",
        remedy='send one of them, such as {"station": "board"} or {"pan_deg": 0, "tilt_deg": 0}',
    )


def _limits(limits: PanTiltLimits) -> PanTiltLimitsDocument:
    return PanTiltLimitsDocument(
        pan_min_deg=deg(limits.pan_min_rad),
        pan_max_deg=deg(limits.pan_max_rad),
        tilt_min_deg=deg(limits.tilt_min_rad),
        tilt_max_deg=deg(limits.tilt_max_rad),
    )


def _station(station: Station) -> StationDocument:
    return StationDocument(
        name=station.name,
        target=station.target.value,
        pan_deg=deg(station.pose.pan_rad),
        tilt_deg=deg(station.pose.tilt_rad),
        distance_m=station.distance_m,
    )
