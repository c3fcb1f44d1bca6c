"""The rig under test of an acceptance run: one that a command owns, or the server's through its thread."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict

from foveacam_hardware.contract import Binning, Clock, MarkerPrint, PanTilt, Station
from foveacam_hardware.rig import Rig
from foveacam_pipeline.accept.environment import AcceptanceEnvironment
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout
from foveacam_pipeline.calibrate.watcher import ProcedureWatcher
from foveacam_pipeline.capture.run.access import RigAccess
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.resources.calibrating.sessions.step_environment import binned_cameras, marker_stations
from foveacam_server.resources.calibrating.sessions.turning import turn_to_station
from foveacam_server.rig.access import StillRigAccess
from foveacam_server.rig.device_reconnector import MIRRORS
from foveacam_server.rig.exclusive_pan_tilt import exclusive_pan_tilt
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.status import RigStatus


def environment_of_rig(
    rig: Rig, calibration: Calibration | None, *, access_of: Callable[[Rig], RigAccess]
) -> AcceptanceEnvironment:
    """Return the environment of a rig that the caller's thread owns, opened as far as it answers."""

    @contextmanager
    def use(binning: Binning | None) -> Iterator[RigAccess]:
        with binned_cameras(rig, binning or rig.working_binning):
            yield access_of(rig)

    def turn(access: RigAccess, station: Station, watch: ProcedureWatcher) -> None:
        _turn(rig.pan_tilt, station, access, calibration, watch)

    return AcceptanceEnvironment(
        rig_id=rig.rig_id,
        clock=rig.clock,
        layout=layout_of(rig.markers),
        stations=marker_stations(rig.stations),
        problems=[(problem.device, problem.detail) for problem in rig.problems],
        calibration=calibration,
        use=use,
        turn=turn,
        turns=rig.pan_tilt is not None and rig.pan_tilt.moves_itself,
    )


def environment_of_server(
    hardware: HardwareThread,
    calibration: Calibration | None,
    *,
    holder: str,
    clock: Clock,
    cancelled: Callable[[], bool],
) -> AcceptanceEnvironment:
    """Return the environment of the server's rig, reserved part by part."""
    status = hardware.status

    @contextmanager
    def use(binning: Binning | None) -> Iterator[RigAccess]:
        with hardware.session(holder, cancelled=cancelled, binning=binning) as head:
            # its exposures are allowed while a strobe or a frame is missing: the run is to name that
            yield StillRigAccess(hardware, head, clock=clock)

    def turn(access: RigAccess, station: Station, watch: ProcedureWatcher) -> None:
        pan_tilt = exclusive_pan_tilt(hardware, cancelled=cancelled)
        _turn(pan_tilt, station, access, calibration, watch)

    return AcceptanceEnvironment(
        rig_id=status.rig_id or "",
        clock=clock,
        layout=layout_of(status.markers),
        stations=marker_stations(status.stations),
        problems=_missing(hardware, status),
        calibration=calibration,
        use=use,
        turn=turn,
        turns=status.pan_tilt is not None and status.pan_tilt.moves_itself,
    )


def _missing(hardware: HardwareThread, status: RigStatus) -> list[tuple[str, str]]:
    """Return the devices that are not there, and why; those that only fail are left to the checks."""
    there = {camera.role.value for camera in status.cameras if camera.connected}
    if hardware.pose is not None:
        there.add(MIRRORS)
    return [(problem.device, problem.detail) for problem in status.problems if problem.device not in there]


def layout_of(markers: MarkerPrint) -> MarkerLayout:
    """Return the layout of a rig's printed markers."""
    return MarkerLayout(**asdict(markers))


def _turn(
    pan_tilt: PanTilt | None,
    station: Station,
    access: RigAccess,
    calibration: Calibration | None,
    watch: ProcedureWatcher,
) -> None:
    """Turn the rig before a station; a rig without a pan-tilt stands before its only one."""
    if pan_tilt is not None:
        wide = None if calibration is None else calibration.wide
        turn_to_station(pan_tilt, station, clock=access.clock, watch=watch, head=access.head, wide=wide)
