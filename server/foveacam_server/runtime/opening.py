"""Builds everything of a running server in one order, and registers its closing in the reverse."""

import asyncio
import logging
import secrets
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path

from foveacam_hardware.contract import Clock, FoveaError, MonotonicClock
from foveacam_hardware.rig import open_rig
from foveacam_hardware.rig_config import SerialRigConfig, SimulatedRigConfig, load_rig_config
from foveacam_server.calibrating.sessions import SessionShelf
from foveacam_server.runtime.calibration_desk import CalibrationDesk
from foveacam_server.runtime.calibration_health import CalibrationHealth
from foveacam_server.runtime.calibration_records import CalibrationRecords
from foveacam_server.runtime.calibration_runs import Equipment
from foveacam_server.runtime.calibrations import CalibrationService
from foveacam_server.runtime.clouds import CloudShelf
from foveacam_server.runtime.drift_checks import DriftChecks
from foveacam_server.runtime.events import EventLog, Level
from foveacam_server.runtime.fixations import FixationService, Tools
from foveacam_server.runtime.frame_hub import FrameHub
from foveacam_server.runtime.hardware import HardwareThread
from foveacam_server.runtime.jobs import JobRunner
from foveacam_server.runtime.lease import Lease
from foveacam_server.runtime.live_views import LiveRates
from foveacam_server.runtime.overlay import Overlay
from foveacam_server.runtime.pan_tilt import PanTiltDesk
from foveacam_server.runtime.ports import Rig, Viewer
from foveacam_server.runtime.scene_follower import SceneFollower, Sight
from foveacam_server.runtime.services import Services
from foveacam_server.runtime.shapes import ShapeWorker
from foveacam_server.runtime.stop import StopSwitch
from foveacam_server.runtime.store import Store
from foveacam_server.runtime.stream import Streams
from foveacam_server.settings import Settings
from foveacam_web.scene import ViewerScene

_log = logging.getLogger(__name__)


def rig_config(settings: Settings) -> SimulatedRigConfig | SerialRigConfig:
    """Return the rig that the settings name; raise `InvalidInput` for a file that cannot be used."""
    if settings.rig == "sim":
        return SimulatedRigConfig(scene=settings.scene, preset=settings.preset)
    return load_rig_config(Path(settings.rig))


def open_services(settings: Settings, *, stack: ExitStack, loop: asyncio.AbstractEventLoop) -> Services:
    """Open all services; the rig itself opens behind, so that a missing device delays nobody."""
    clock = MonotonicClock()
    boot_id = secrets.token_hex(6)
    store = stack.enter_context(Store(settings.data))
    events = EventLog(store)
    stack.callback(events.close)
    hub = FrameHub(clock=clock)
    streams = Streams(hub, boot_id=boot_id)
    stack.callback(streams.close)
    folder = store.subfolder("calibrations")
    calibration = CalibrationService(chosen=settings.calibration, folder=folder, events=events)
    health = CalibrationHealth(events)
    calibration.on_change(health.begin)
    viewer = _open_viewer(settings, stack=stack, events=events, loop=loop)
    overlay = Overlay(lambda: calibration.current)
    hardware = HardwareThread(
        lambda: _open_rig(settings, clock=clock, calibration=calibration),
        sink=hub,
        events=events,
        clock=clock,
        overlay=overlay.of,
        limits=LiveRates(wide_hz=settings.live_wide_hz, fovea_hz=settings.live_fovea_hz),
    )
    stack.callback(hardware.close)
    clouds = CloudShelf(store)
    jobs = JobRunner(store, events=events, clock=clock)
    shapes = ShapeWorker(shelf=clouds, sink=hub, viewer=viewer, events=events)
    tools = Tools(
        hardware=hardware,
        calibration=calibration,
        jobs=jobs,
        shapes=shapes,
        patches=clouds.patches,
        events=events,
        clock=clock,
        on_distance=overlay.look_at_distance,
        on_fixation=health.add,
    )
    fixations = FixationService(store, tools)
    equipment = Equipment(
        hardware=hardware, calibration=calibration, jobs=jobs, sink=hub, events=events, clock=clock
    )
    sessions = SessionShelf(folder / "sessions")
    desk = CalibrationDesk(sessions, equipment)
    drift = DriftChecks(folder / "drift", equipment)
    shapes.put_back(fixations.targets.every())
    for worker in (shapes, jobs):
        worker.start()
        stack.callback(worker.close)
    stop = StopSwitch(hardware, cancel_jobs=jobs.cancel_all, events=events)
    stopping = ThreadPoolExecutor(2, thread_name_prefix="foveacam-stop")
    stack.callback(stopping.shutdown)
    hardware.start()
    if viewer is not None:
        _follow(viewer, stack=stack, calibration=calibration, hardware=hardware, overlay=overlay)
    return Services(
        settings=settings,
        boot_id=boot_id,
        clock=clock,
        store=store,
        events=events,
        lease=Lease(clock=clock, events=events),
        hub=hub,
        streams=streams,
        hardware=hardware,
        pan_tilt=PanTiltDesk(hardware),
        stop=stop,
        stopping=stopping,
        calibration=calibration,
        records=CalibrationRecords(
            calibration, sessions=sessions, drift=drift.records, hardware=hardware, health=health
        ),
        sessions=desk,
        drift=drift,
        overlay=overlay,
        jobs=jobs,
        clouds=clouds,
        fixations=fixations,
        viewer=viewer,
    )


def _follow(
    viewer: Viewer,
    *,
    stack: ExitStack,
    calibration: CalibrationService,
    hardware: HardwareThread,
    overlay: Overlay,
) -> None:
    def sight() -> Sight | None:
        current = calibration.current
        if current is None:
            return None
        return Sight(calibration=current, volts=hardware.gaze, distance_m=overlay.distance_m)

    follower = SceneFollower(viewer, sight=sight)
    follower.start()
    stack.callback(follower.close)


def _open_rig(settings: Settings, *, clock: Clock, calibration: CalibrationService) -> Rig:
    rig = open_rig(rig_config(settings), clock=clock)
    calibration.choose_for(rig.rig_id)
    return rig


def _open_viewer(
    settings: Settings, *, stack: ExitStack, events: EventLog, loop: asyncio.AbstractEventLoop
) -> Viewer | None:
    if not settings.viewer:
        return None
    scene = ViewerScene()
    try:
        scene.start()
    except (FoveaError, OSError) as error:
        _log.warning("the 3D pane could not be started: %s", error)
        events.emit("viewer.failed", f"the 3D pane could not be started: {error}", level=Level.WARNING)
        return None
    stack.callback(scene.stop)

    async def on_select(fixation_id: str) -> None:
        events.emit("fixation.selected", f"{fixation_id} was clicked", data={"fixation_id": fixation_id})

    scene.on_select(on_select, loop)
    return scene
