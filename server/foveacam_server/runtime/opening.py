"""Builds everything of a running server in one order, and registers its closing in the reverse."""

import asyncio
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from foveacam_hardware.rig import open_rig
from foveacam_hardware.rig_config import SerialRigConfig, SimulatedRigConfig, load_rig_config
from foveacam_hardware.rig_replay import replay_rig
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.values import Fixation
from foveacam_server.calibrating.sessions import SessionCollection
from foveacam_server.resources.measurements.places import ShownViews
from foveacam_server.resources.measurements.service import MeasurementService, MeasuringTools
from foveacam_server.resources.suggestions.service import SuggestionService
from foveacam_server.resources.wide_depth.context_keeper import ContextKeeper
from foveacam_server.resources.wide_depth.service import WideDepthService, WideDepthTools
from foveacam_server.runtime.calibration_records import CalibrationRecords
from foveacam_server.runtime.calibration_runs import CalibrationJobTools
from foveacam_server.runtime.calibration_session_service import CalibrationSessionService
from foveacam_server.runtime.clouds import CloudCollection
from foveacam_server.runtime.collection_services import live_rates, open_collected
from foveacam_server.runtime.compute_queue import ComputeQueue
from foveacam_server.runtime.drift_checks import DriftChecks
from foveacam_server.runtime.fixations import FixationService, FixationTools
from foveacam_server.runtime.foundation import (
    DisplayServices,
    RigKnowledge,
    ServerFoundation,
    lay_ground,
    open_lore,
    open_sights,
)
from foveacam_server.runtime.hardware import HardwareThread
from foveacam_server.runtime.jobs import JobRunner
from foveacam_server.runtime.lease import Lease
from foveacam_server.runtime.pan_tilt import PanTiltService
from foveacam_server.runtime.ports import AssembledRig
from foveacam_server.runtime.rail import RailService
from foveacam_server.runtime.scene_follower import RigGaze, SceneFollower
from foveacam_server.runtime.services import Services
from foveacam_server.runtime.shapes import ShapeWorker
from foveacam_server.runtime.stop import StopSwitch
from foveacam_server.runtime.trigger_tests import TriggerTests
from foveacam_server.settings import Settings


def rig_config(settings: Settings) -> SimulatedRigConfig | SerialRigConfig:
    """Return the rig that the settings name; raise `InvalidInput` for a file that cannot be used."""
    if settings.rig == "sim":
        return SimulatedRigConfig(scene=settings.scene, preset=settings.preset)
    return load_rig_config(Path(settings.rig))


def open_services(settings: Settings, *, stack: ExitStack, loop: asyncio.AbstractEventLoop) -> Services:
    """Open all services; the rig itself opens behind, so that a missing device delays nobody."""
    ground = lay_ground(settings, stack=stack)
    lore = open_lore(ground)
    sights = open_sights(ground, lore, loop=loop)
    hardware = _hardware(ground, lore, sights)
    jobs = JobRunner(ground.store, events=ground.events, clock=ground.clock)
    calibrating = _open_calibrating(ground, lore, sights, hardware=hardware, jobs=jobs)
    trigger_tests = _trigger_tests(ground, lore, hardware=hardware, jobs=jobs)
    collected = open_collected(ground, lore, sights, hardware=hardware, jobs=jobs)
    study = _open_study(ground, lore, sights, hardware=hardware, jobs=jobs)
    stop, stopping = _stop(ground, hardware, jobs)
    computing = ComputeQueue()
    stack.callback(computing.close)
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
        pan_tilt=PanTiltService(hardware),
        rail=RailService(hardware),
        settling=lore.settling,
        stop=stop,
        computing=computing,
        stopping=stopping,
        calibration=lore.calibration,
        records=calibrating.records,
        sessions=calibrating.desk,
        drift=calibrating.drift,
        overlay=sights.overlay,
        jobs=jobs,
        clouds=study.clouds,
        captures=collected.captures,
        stills=collected.stills,
        recordings=collected.recordings,
        mosaics=collected.mosaics,
        references=collected.references,
        fixations=study.fixations,
        wide_depth=study.wide_depth,
        measurements=study.measurements,
        suggestions=SuggestionService(sights.hub),
        viewer=sights.viewer,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Calibrating:
    """What measures calibrations, and what keeps them."""

    desk: CalibrationSessionService
    drift: DriftChecks
    records: CalibrationRecords


def _open_calibrating(
    ground: ServerFoundation,
    lore: RigKnowledge,
    sights: DisplayServices,
    *,
    hardware: HardwareThread,
    jobs: JobRunner,
) -> _Calibrating:
    equipment = CalibrationJobTools(
        hardware=hardware,
        calibration=lore.calibration,
        jobs=jobs,
        sink=sights.tap,
        events=ground.events,
        clock=ground.clock,
        settling=lore.settling,
    )
    sessions, drift = (
        SessionCollection(lore.folder / "sessions"),
        DriftChecks(lore.folder / "drift", equipment),
    )
    records = CalibrationRecords(
        lore.calibration, sessions=sessions, drift=drift.records, hardware=hardware, health=lore.health
    )
    return _Calibrating(desk=CalibrationSessionService(sessions, equipment), drift=drift, records=records)


def _trigger_tests(
    ground: ServerFoundation, lore: RigKnowledge, *, hardware: HardwareThread, jobs: JobRunner
) -> TriggerTests:
    folder = lore.cameras_folder / "self_tests"
    return TriggerTests(folder, cameras=lore.cameras, hardware=hardware, jobs=jobs, events=ground.events)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Study:
    """What becomes of a look."""

    clouds: CloudCollection
    fixations: FixationService
    wide_depth: WideDepthService
    measurements: MeasurementService


def _hardware(ground: ServerFoundation, lore: RigKnowledge, sights: DisplayServices) -> HardwareThread:
    settings = ground.settings
    hardware = HardwareThread(
        lambda: _open_rig(ground, lore),
        sink=sights.tap,
        events=ground.events,
        clock=ground.clock,
        overlay=sights.overlay.of,
        limits=live_rates(settings),
        keeper=lore.cameras,
    )
    ground.stack.callback(hardware.close)
    return hardware


def _open_study(
    ground: ServerFoundation,
    lore: RigKnowledge,
    sights: DisplayServices,
    *,
    hardware: HardwareThread,
    jobs: JobRunner,
) -> _Study:
    """Open what fixations need, and start the threads that work; jobs have their handlers by now."""
    clouds = CloudCollection(ground.store)
    wide_depth = _wide_depth(ground, lore, sights, hardware=hardware, jobs=jobs)

    def on_fixation(fixation: Fixation, calibration: Calibration) -> None:
        lore.health.add(fixation, calibration)
        wide_depth.add(fixation, calibration)

    shapes = ShapeWorker(shelf=clouds, sink=sights.hub, viewer=sights.viewer, events=ground.events)
    tools = FixationTools(
        hardware=hardware,
        calibration=lore.calibration,
        jobs=jobs,
        shapes=shapes,
        patches=clouds.patches,
        events=ground.events,
        clock=ground.clock,
        on_distance=sights.overlay.look_at_distance,
        on_fixation=on_fixation,
        context=wide_depth,
    )
    fixations = FixationService(ground.store, tools)
    shapes.put_back(fixations.targets.every())
    for worker in (shapes, wide_depth, jobs):
        worker.start()
        ground.stack.callback(worker.close)
    measurements = _open_measurements(ground, lore, sights, hardware=hardware, clouds=clouds)
    return _Study(clouds=clouds, fixations=fixations, wide_depth=wide_depth, measurements=measurements)


def _wide_depth(
    ground: ServerFoundation,
    lore: RigKnowledge,
    sights: DisplayServices,
    *,
    hardware: HardwareThread,
    jobs: JobRunner,
) -> WideDepthService:
    keeper = ContextKeeper(
        ground.store.subfolder("wide_depth"),
        calibration=lambda: lore.calibration.current,
        status=lambda: hardware.status,
    )
    tools = WideDepthTools(
        hardware=hardware,
        calibration=lore.calibration.require,
        jobs=jobs,
        hub=sights.hub,
        viewer=sights.viewer,
        events=ground.events,
        clock=ground.clock,
    )
    return WideDepthService(keeper, tools)


def _open_measurements(
    ground: ServerFoundation,
    lore: RigKnowledge,
    sights: DisplayServices,
    *,
    hardware: HardwareThread,
    clouds: CloudCollection,
) -> MeasurementService:
    def picture_t_ns(view: str) -> int | None:
        newest = sights.hub.newest(view)
        return None if newest is None else newest.t_ns

    tools = MeasuringTools(
        shelf=clouds,
        wide=lambda: lore.calibration.require().wide,
        shown=ShownViews(volts=lambda: hardware.pose, picture_t_ns=picture_t_ns),
        events=ground.events,
        viewer=sights.viewer,
    )
    measurements = MeasurementService(ground.store, tools)
    measurements.put_back()
    return measurements


def _stop(
    ground: ServerFoundation, hardware: HardwareThread, jobs: JobRunner
) -> tuple[StopSwitch, ThreadPoolExecutor]:
    stop = StopSwitch(hardware, cancel_jobs=jobs.cancel_all, events=ground.events)
    stopping = ThreadPoolExecutor(2, thread_name_prefix="foveacam-stop")
    ground.stack.callback(stopping.shutdown)
    return stop, stopping


def _follow(
    ground: ServerFoundation, lore: RigKnowledge, sights: DisplayServices, hardware: HardwareThread
) -> None:
    """Let the 3D pane show where the foveae look."""
    if sights.viewer is None:
        return

    def sight() -> RigGaze | None:
        current = lore.calibration.current
        if current is None:
            return None
        return RigGaze(calibration=current, volts=hardware.pose, distance_m=sights.overlay.distance_m)

    follower = SceneFollower(sights.viewer, sight=sight)
    follower.start()
    ground.stack.callback(follower.close)


def _open_rig(ground: ServerFoundation, lore: RigKnowledge) -> AssembledRig:
    replay = ground.settings.replay
    if replay is not None:
        return _open_replay(ground, lore, replay)
    rig = open_rig(rig_config(ground.settings), clock=ground.clock, guarded=True)
    lore.calibration.choose_for(rig.rig_id)
    lore.settling.restore(rig)
    return rig


def _open_replay(ground: ServerFoundation, lore: RigKnowledge, replay: Path) -> AssembledRig:
    """Return the rig that plays a recording, with the calibration that was recorded with it."""
    from foveacam_server.runtime.replay import open_recording, playback_of

    recorded = open_recording(replay)
    rig = replay_rig(recorded, playback=playback_of(ground.settings), clock=ground.clock)
    lore.calibration.choose_for(rig.rig_id, brought=recorded.calibration)
    lore.settling.restore(rig)
    return rig
