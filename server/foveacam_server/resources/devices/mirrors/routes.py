"""Routes of the mirrors: their directions and controller, steering, switching their supply rail."""

import asyncio
import math
from typing import Protocol

from foveacam_hardware.contract import DeviceInfo, LinkTelemetry, Role, StereoVolts, StreamTelemetry
from foveacam_pipeline.models.calibration import eye_volts
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.http.answers import LeaseHeader, problems
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.lease import Lease
from foveacam_server.foundation.quantities import deg, rounded
from foveacam_server.resources.devices.mirrors.schema import (
    ControllerDocument,
    ControllerLinkDocument,
    EyeDocument,
    MirrorsDocument,
    PositionStreamDocument,
    SteerRequest,
    VoltsRequest,
)
from foveacam_server.resources.devices.mirrors.targets import volts_of, volts_text
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.ports import CalibrationInForce
from foveacam_server.rig.refusals import check_direction, check_volts

router = GuardedRouter("/mirrors", tags=["rig"], reading=Right.VIEW, changing=Right.OPERATE)


class OverlayDistance(Protocol):
    """Receives the distance for which the overlay of the wide view is drawn."""

    def look_at_distance(self, distance_m: float) -> None:
        """Draw the overlay for this distance from now on."""
        ...


UNKNOWN_EYE = EyeDocument(x_v=None, y_v=None, ax_deg=None, ay_deg=None)


@router.get("", summary="Both mirrors")
async def mirrors(
    hardware: Provided[HardwareThread], calibration: Provided[CalibrationInForce]
) -> MirrorsDocument:
    """Return the last status of both mirrors."""
    return mirrors_document(hardware, calibration)


@router.post("/steer", summary="Point both foveae, open loop", responses=problems(409, 502, 503, 504))
async def steer(
    request: SteerRequest,
    lease: Provided[Lease],
    calibration_in_force: Provided[CalibrationInForce],
    hardware: Provided[HardwareThread],
    overlay: Provided[OverlayDistance],
    events: Provided[EventLog],
    x_lease: LeaseHeader = None,
) -> MirrorsDocument:
    """Point both eyes at a direction and distance from the rig's origin; in parallel without a distance."""
    lease.check(x_lease)
    calibration = calibration_in_force.require()
    ax_rad, ay_rad = math.radians(request.direction.ax_deg), math.radians(request.direction.ay_deg)
    check_direction(ax_rad, ay_rad)
    distance_m = math.inf if request.distance_m is None else request.distance_m
    volts = calibration.steer(ax_rad, ay_rad, distance_m=distance_m)
    await asyncio.wrap_future(hardware.steer(volts))
    overlay.look_at_distance(distance_m)
    events.emit(
        "mirrors.steered",
        f"steered to {request.direction.ax_deg:.2f}°, {request.direction.ay_deg:.2f}°",
        data=request,
    )
    return mirrors_document(hardware, calibration_in_force)


@router.put("/volts", summary="Set the mirrors' volts", responses=problems(409, 502, 503, 504))
async def set_volts(
    request: VoltsRequest,
    lease: Provided[Lease],
    hardware: Provided[HardwareThread],
    events: Provided[EventLog],
    calibration: Provided[CalibrationInForce],
    x_lease: LeaseHeader = None,
) -> MirrorsDocument:
    """Set the differential volts of one eye or both, calibrated or not."""
    lease.check(x_lease)
    volts = volts_of(request, before=hardware.gaze)
    check_volts(volts, max_v=hardware.status.max_v)
    await asyncio.wrap_future(hardware.steer(volts))
    events.emit("mirrors.steered", f"set to {volts_text(volts)}", data=request)
    return mirrors_document(hardware, calibration)


@router.post("/park", summary="Bring both mirrors to rest", responses=problems(409, 502, 503, 504))
async def park(
    lease: Provided[Lease],
    hardware: Provided[HardwareThread],
    events: Provided[EventLog],
    calibration: Provided[CalibrationInForce],
    x_lease: LeaseHeader = None,
) -> MirrorsDocument:
    """Set both mirrors to zero volts; unlike the stop it lets the next move pass."""
    lease.check(x_lease)
    await asyncio.wrap_future(hardware.park())
    events.emit("mirrors.parked", "the mirrors were parked")
    return mirrors_document(hardware, calibration)


@router.post("/enable", summary="Switch the mirrors on", responses=problems(409, 502, 503, 504))
async def enable(
    lease: Provided[Lease],
    hardware: Provided[HardwareThread],
    events: Provided[EventLog],
    calibration: Provided[CalibrationInForce],
    x_lease: LeaseHeader = None,
) -> MirrorsDocument:
    """Switch the mirrors' supply rail on, both at rest, if it is off."""
    return await _switched(lease, hardware, events, calibration, x_lease, on=True)


@router.post("/disable", summary="Switch the mirrors off", responses=problems(409, 502, 503, 504))
async def disable(
    lease: Provided[Lease],
    hardware: Provided[HardwareThread],
    events: Provided[EventLog],
    calibration: Provided[CalibrationInForce],
    x_lease: LeaseHeader = None,
) -> MirrorsDocument:
    """Park both mirrors and switch their supply rail off, until it is switched on again."""
    return await _switched(lease, hardware, events, calibration, x_lease, on=False)


@router.post("/recover", summary="Restart the mirrors' DACs", responses=problems(409, 502, 503, 504))
async def recover(
    lease: Provided[Lease],
    hardware: Provided[HardwareThread],
    events: Provided[EventLog],
    calibration: Provided[CalibrationInForce],
    x_lease: LeaseHeader = None,
) -> MirrorsDocument:
    """Recover a frozen mirror without switching the rail: restart both DACs, then restore the targets."""
    lease.check(x_lease)
    hardware.mirrors.check()
    await asyncio.wrap_future(hardware.submit(lambda rig: rig.mirrors.recover()))
    events.emit("mirrors.recovered", "the mirrors' DACs were restarted")
    return mirrors_document(hardware, calibration)


async def _switched(
    lease: Lease,
    hardware: HardwareThread,
    events: EventLog,
    calibration: CalibrationInForce,
    x_lease: str | None,
    *,
    on: bool,
) -> MirrorsDocument:
    lease.check(x_lease)
    hardware.use.check_free("switch the mirrors")
    await asyncio.wrap_future(hardware.submit(lambda rig: hardware.mirrors.switch(rig, on=on)))
    events.emit("mirrors.switched", f"the mirrors were switched {'on' if on else 'off'}")
    return mirrors_document(hardware, calibration)


def mirrors_document(hardware: HardwareThread, calibration: CalibrationInForce) -> MirrorsDocument:
    """Return the document of both mirrors."""
    status = hardware.status
    state, telemetry = status.mirrors, status.telemetry
    connected, pose = state is not None and state.connected, hardware.pose
    return MirrorsDocument(
        connected=connected,
        enabled=state.enabled if state is not None and connected else None,
        left=_eye(calibration, Role.LEFT, pose),
        right=_eye(calibration, Role.RIGHT, pose),
        fault=None if state is None else state.fault,
        rtt_p50_ms=rounded(telemetry.rtt_p50_ms, 3) if telemetry else None,
        rtt_p99_ms=rounded(telemetry.rtt_p99_ms, 3) if telemetry else None,
        tx_packets=telemetry.tx_packets if telemetry else 0,
        rx_packets=telemetry.rx_packets if telemetry else 0,
        bad_packets=telemetry.bad_packets if telemetry else 0,
        clock_offset_ms=rounded(telemetry.clock_offset_ns / 1e6, 3) if telemetry else None,
        guarded=state is not None and state.guarded,
        rail_wanted=hardware.mirrors.rail_wanted,
        controller=controller_document(status.controller),
        link=None if telemetry is None else link_document(telemetry),
    )


def _eye(calibration_in_force: CalibrationInForce, role: Role, pose: StereoVolts | None) -> EyeDocument:
    if pose is None:
        return UNKNOWN_EYE
    volts = eye_volts(pose, role)
    calibration = calibration_in_force.current
    angles_rad = None if calibration is None else calibration.eye(role).mirror.angles_rad(volts)
    return EyeDocument(
        x_v=round(volts.x_v, 4),
        y_v=round(volts.y_v, 4),
        ax_deg=None if angles_rad is None else deg(angles_rad[0]),
        ay_deg=None if angles_rad is None else deg(angles_rad[1]),
    )


def controller_document(info: DeviceInfo | None) -> ControllerDocument | None:
    """Return the controller's identification; None before the rig is open."""
    if info is None:
        return None
    return ControllerDocument(
        vendor=info.vendor, model=info.model, serial=info.serial, version=info.version, port=info.port
    )


def link_document(telemetry: LinkTelemetry) -> ControllerLinkDocument:
    """Return traffic, round trips, update limit and clock of the controller's link."""
    drift_ppm = telemetry.clock_drift_ppm
    return ControllerLinkDocument(
        tx_bytes=telemetry.tx_bytes,
        rx_bytes=telemetry.rx_bytes,
        tx_packets=telemetry.tx_packets,
        rx_packets=telemetry.rx_packets,
        bad_packets=telemetry.bad_packets,
        crc=telemetry.crc,
        crc_errors=telemetry.crc_errors,
        lost_answers=telemetry.lost_answers,
        tx_bytes_per_s=telemetry.tx_bytes_per_s,
        rx_bytes_per_s=telemetry.rx_bytes_per_s,
        tx_packets_per_s=telemetry.tx_packets_per_s,
        rx_packets_per_s=telemetry.rx_packets_per_s,
        queued_bytes=telemetry.queued_bytes,
        rtt_p50_ms=round(telemetry.rtt_p50_ms, 3),
        rtt_p95_ms=round(telemetry.rtt_p95_ms, 3),
        rtt_p99_ms=round(telemetry.rtt_p99_ms, 3),
        rtt_max_ms=round(telemetry.rtt_max_ms, 3),
        update_limit_hz=telemetry.update_limit_hz,
        clock_offset_ms=round(telemetry.clock_offset_ns / 1e6, 3),
        clock_drift_ppm=None if drift_ppm is None else round(drift_ppm, 2),
        streams=[_stream(stream) for stream in telemetry.streams],
    )


def _stream(stream: StreamTelemetry) -> PositionStreamDocument:
    volts = stream.volts
    return PositionStreamDocument(
        stream=stream.stream,
        updates_per_s=stream.updates_per_s,
        left_x_v=round(volts.left.x_v, 4),
        left_y_v=round(volts.left.y_v, 4),
        right_x_v=round(volts.right.x_v, 4),
        right_y_v=round(volts.right.y_v, 4),
    )
