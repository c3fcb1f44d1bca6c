"""Builds everything of a running server in one order, and registers its closing in the reverse."""

import asyncio
import logging
import secrets
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from foveacam_hardware.contract import Clock, FoveaError, MonotonicClock
from foveacam_hardware.rig import open_rig
from foveacam_hardware.rig_config import SerialRigConfig, SimulatedRigConfig, load_rig_config
from foveacam_hardware.rig_replay import replay_rig
from foveacam_server.calibrating.sessions import SessionShelf
from foveacam_server.calibrating.settle_times import SettleTimes
from foveacam_server.capturing.shelf import CAPTURES
from foveacam_server.capturing.still_shelf import STILLS
from foveacam_server.recordings.shelf import RECORDINGS
from foveacam_server.recordings.tap import FrameTap
from foveacam_server.runtime.calibration_desk import CalibrationDesk
from foveacam_server.runtime.calibration_health import CalibrationHealth
from foveacam_server.runtime.calibration_records import CalibrationRecords
from foveacam_server.runtime.calibration_runs import Equipment
from foveacam_server.runtime.calibrations import CalibrationService
from foveacam_server.runtime.camera_desk import CameraDesk
from foveacam_server.runtime.camera_records import CameraRecords
from foveacam_server.runtime.captures import CaptureService, CaptureTools
from foveacam_server.runtime.clouds import CloudShelf
from foveacam_server.runtime.drift_checks import DriftChecks
from foveacam_server.runtime.events import EventLog, Level
from foveacam_server.runtime.fixations import FixationService, Tools
from foveacam_server.runtime.frame_hub import FrameHub
from foveacam_server.runtime.hardware import HardwareThread
from foveacam_server.runtime.jobs import JobRunner
from foveacam_server.runtime.lease import Lease
from foveacam_server.runtime.live_views import LiveRates
from foveacam_server.runtime.mosaics import MosaicService, MosaicTools
from foveacam_server.runtime.overlay import Overlay
from foveacam_server.runtime.pan_tilt import PanTiltDesk
from foveacam_server.runtime.ports import Rig, Viewer
from foveacam_server.runtime.rail import RailDesk
from foveacam_server.runtime.recordings import RecordingService, RecordingTools
from foveacam_server.runtime.scene_follower import SceneFollower, Sight
from foveacam_server.runtime.services import Services
from foveacam_server.runtime.settle_desk import SettleDesk
from foveacam_server.runtime.shapes import ShapeWorker
from foveacam_server.runtime.stills import StillService
from foveacam_server.runtime.stop import StopSwitch
from foveacam_server.runtime.store import Store
from foveacam_server.runtime.stream import Streams
from foveacam_server.runtime.trigger_tests import TriggerTests
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
    ground = _lay_ground(settings, stack=stack)
    lore = _open_lore(ground)
    sights = _open_sights(ground, lore, loop=loop)
    hardware = _hardware(ground, lore, sights)
    jobs = JobRunner(ground.store, events=ground.events, clock=ground.clock)
    equipment = Equipment(
        hardware=hardware,
        calibration=lore.calibration,
        jobs=jobs,
        sink=sights.tap,
        events=ground.events,
        clock=ground.clock,
        settling=lore.settling,
    )
    sessions = SessionShelf(lore.folder / "sessions")
    desk, drift = CalibrationDesk(sessions, equipment), DriftChecks(lore.folder / "drift", equipment)
    trigger_tests = TriggerTests(
        lore.cameras_folder / "self_tests",
        cameras=lore.cameras,
        hardware=hardware,
        jobs=jobs,
        events=ground.events,
    )
    capture_tools = _capture_tools(ground, lore, sights, hardware=hardware, jobs=jobs)
    captures = CaptureService(ground.store.subfolder(CAPTURES), capture_tools)
    stills = StillService(ground.store.subfolder(STILLS), capture_tools)
    recordings = _recordings(ground, lore, sights, hardware=hardware, jobs=jobs)
    mosaics = _mosaics(ground, sights, captures, jobs=jobs)
    study = _open_study(ground, lore, sights, hardware=hardware, jobs=jobs)
    stop, stopping = _stop(ground, hardware, jobs)
    hardware.start()
    _follow(ground, lore, sights, hardware)
    return Services(
        settings=settings,
        boot_id=sights.boot_id,
        clock=ground.clock,
        store=ground.store,
        events=ground.events,
        lease=Lease(clock=ground.clock, events=ground.events),
        hub=sights.hub,
        streams=sights.streams,
        hardware=hardware,
        cameras=lore.cameras,
        trigger_tests=trigger_tests,
        pan_tilt=PanTiltDesk(hardware),
        rail=RailDesk(hardware),
        settling=lore.settling,
        stop=stop,
        stopping=stopping,
        calibration=lore.calibration,
        records=CalibrationRecords(
            lore.calibration, sessions=sessions, drift=drift.records, hardware=hardware, health=lore.health
        ),
        sessions=desk,
        drift=drift,
        overlay=sights.overlay,
        jobs=jobs,
        clouds=study.clouds,
        captures=captures,
        stills=stills,
        recordings=recordings,
        mosaics=mosaics,
        fixations=study.fixations,
        viewer=sights.viewer,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Ground:
    """What everything stands on; `stack` closes what is opened, last opened first."""

    settings: Settings
    stack: ExitStack
    clock: Clock
    store: Store
    events: EventLog


@dataclass(frozen=True, slots=True, kw_only=True)
class _Lore:
    """What is known of the rig; `folder` holds it."""

    folder: Path
    calibration: CalibrationService
    health: CalibrationHealth
    settling: SettleDesk
    cameras: CameraDesk
    cameras_folder: Path


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sights:
    """What is to be seen."""

    boot_id: str
    hub: FrameHub
    tap: FrameTap
    """Where frames and pictures are published: they go to the hub, and to who records."""
    streams: Streams
    viewer: Viewer | None
    overlay: Overlay


@dataclass(frozen=True, slots=True, kw_only=True)
class _Study:
    """What becomes of a look."""

    clouds: CloudShelf
    fixations: FixationService


def _lay_ground(settings: Settings, *, stack: ExitStack) -> _Ground:
    store = stack.enter_context(Store(settings.data))
    events = EventLog(store)
    stack.callback(events.close)
    return _Ground(settings=settings, stack=stack, clock=MonotonicClock(), store=store, events=events)


def _open_lore(ground: _Ground) -> _Lore:
    folder = ground.store.subfolder("calibrations")
    calibration = CalibrationService(chosen=ground.settings.calibration, folder=folder, events=ground.events)
    health = CalibrationHealth(ground.events)
    calibration.on_change(health.begin)
    settling = SettleDesk(SettleTimes(folder / "settle"), events=ground.events)
    cameras_folder = ground.store.subfolder("cameras")
    return _Lore(
        folder=folder,
        calibration=calibration,
        health=health,
        settling=settling,
        cameras=CameraDesk(CameraRecords(cameras_folder), events=ground.events),
        cameras_folder=cameras_folder,
    )


def _open_sights(ground: _Ground, lore: _Lore, *, loop: asyncio.AbstractEventLoop) -> _Sights:
    boot_id = secrets.token_hex(6)
    hub = FrameHub(clock=ground.clock)
    streams = Streams(hub, boot_id=boot_id)
    ground.stack.callback(streams.close)
    return _Sights(
        boot_id=boot_id,
        hub=hub,
        tap=FrameTap(hub),
        streams=streams,
        viewer=_open_viewer(ground, loop=loop),
        overlay=Overlay(lambda: lore.calibration.current),
    )


def _hardware(ground: _Ground, lore: _Lore, sights: _Sights) -> HardwareThread:
    settings = ground.settings
    hardware = HardwareThread(
        lambda: _open_rig(ground, lore),
        sink=sights.tap,
        events=ground.events,
        clock=ground.clock,
        overlay=sights.overlay.of,
        limits=_rates(settings),
        keeper=lore.cameras,
    )
    ground.stack.callback(hardware.close)
    return hardware


def _capture_tools(
    ground: _Ground, lore: _Lore, sights: _Sights, *, hardware: HardwareThread, jobs: JobRunner
) -> CaptureTools:
    return CaptureTools(
        hardware=hardware,
        calibration=lore.calibration,
        jobs=jobs,
        sink=sights.tap,
        overlay=sights.overlay.of,
        distance_m=lambda: sights.overlay.distance_m,
        events=ground.events,
        clock=ground.clock,
    )


def _recordings(
    ground: _Ground, lore: _Lore, sights: _Sights, *, hardware: HardwareThread, jobs: JobRunner
) -> RecordingService:
    tools = RecordingTools(
        hardware=hardware,
        calibration=lore.calibration,
        jobs=jobs,
        tap=sights.tap,
        hub=sights.hub,
        rates=_rates(ground.settings),
        events=ground.events,
        clock=ground.clock,
    )
    recordings = RecordingService(ground.store.subfolder(RECORDINGS), tools)
    ground.stack.callback(recordings.close)
    return recordings


def _rates(settings: Settings) -> LiveRates:
    return LiveRates(wide_hz=settings.live_wide_hz, fovea_hz=settings.live_fovea_hz)


def _mosaics(ground: _Ground, sights: _Sights, captures: CaptureService, *, jobs: JobRunner) -> MosaicService:
    tools = MosaicTools(
        captures=captures, jobs=jobs, events=ground.events, viewer=sights.viewer, clock=ground.clock
    )
    return MosaicService(tools)


def _open_study(
    ground: _Ground, lore: _Lore, sights: _Sights, *, hardware: HardwareThread, jobs: JobRunner
) -> _Study:
    """Open what fixations need, and start the threads that work; jobs have their handlers by now."""
    clouds = CloudShelf(ground.store)
    shapes = ShapeWorker(shelf=clouds, sink=sights.hub, viewer=sights.viewer, events=ground.events)
    tools = Tools(
        hardware=hardware,
        calibration=lore.calibration,
        jobs=jobs,
        shapes=shapes,
        patches=clouds.patches,
        events=ground.events,
        clock=ground.clock,
        on_distance=sights.overlay.look_at_distance,
        on_fixation=lore.health.add,
    )
    fixations = FixationService(ground.store, tools)
    shapes.put_back(fixations.targets.every())
    for worker in (shapes, jobs):
        worker.start()
        ground.stack.callback(worker.close)
    return _Study(clouds=clouds, fixations=fixations)


def _stop(
    ground: _Ground, hardware: HardwareThread, jobs: JobRunner
) -> tuple[StopSwitch, ThreadPoolExecutor]:
    stop = StopSwitch(hardware, cancel_jobs=jobs.cancel_all, events=ground.events)
    stopping = ThreadPoolExecutor(2, thread_name_prefix="foveacam-stop")
    ground.stack.callback(stopping.shutdown)
    return stop, stopping


def _follow(ground: _Ground, lore: _Lore, sights: _Sights, hardware: HardwareThread) -> None:
    """Let the 3D pane show where the foveae look."""
    if sights.viewer is None:
        return

    def sight() -> Sight | None:
        current = lore.calibration.current
        if current is None:
            return None
        return Sight(calibration=current, volts=hardware.gaze, distance_m=sights.overlay.distance_m)

    follower = SceneFollower(sights.viewer, sight=sight)
    follower.start()
    ground.stack.callback(follower.close)


def _open_rig(ground: _Ground, lore: _Lore) -> Rig:
    replay = ground.settings.replay
    if replay is not None:
        return _open_replay(ground, lore, replay)
    rig = open_rig(rig_config(ground.settings), clock=ground.clock, guarded=True)
    lore.calibration.choose_for(rig.rig_id)
    lore.settling.restore(rig)
    return rig


def _open_replay(ground: _Ground, lore: _Lore, replay: Path) -> Rig:
    """Return the rig that plays a recording, with the calibration that was recorded with it."""
    from foveacam_server.runtime.replay import open_recording, playback_of

    recorded = open_recording(replay)
    rig = replay_rig(recorded, playback=playback_of(ground.settings), clock=ground.clock)
    lore.calibration.choose_for(rig.rig_id, brought=recorded.calibration)
    lore.settling.restore(rig)
    return rig


def _open_viewer(ground: _Ground, *, loop: asyncio.AbstractEventLoop) -> Viewer | None:
    if not ground.settings.viewer:
        return None
    scene, events = ViewerScene(), ground.events
    try:
        scene.start()
    except (FoveaError, OSError) as error:
        _log.warning("the 3D pane could not be started: %s", error)
        events.emit("viewer.failed", f"the 3D pane could not be started: {error}", level=Level.WARNING)
        return None
    ground.stack.callback(scene.stop)

    async def on_select(fixation_id: str) -> None:
        events.emit("fixation.selected", f"{fixation_id} was clicked", data={"fixation_id": fixation_id})

    scene.on_select(on_select, loop)
    return scene
