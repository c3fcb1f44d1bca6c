"""Opens all services of a running server in order, and registers their closing in the reverse order."""

import asyncio
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from foveacam_hardware.rig import open_rig
from foveacam_hardware.rig_replay import replay_rig
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.values import Fixation
from foveacam_server.assembly.collection_services import live_rates, open_collections
from foveacam_server.assembly.first_services import (
    DisplayServices,
    RigKnowledge,
    ServerFoundation,
    open_displays,
    open_foundation,
    open_rig_knowledge,
)
from foveacam_server.assembly.following import open_following
from foveacam_server.assembly.services import Services
from foveacam_server.datasets.collection import CaptureCollection
from foveacam_server.foundation.compute_queue import ComputeQueue
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.lease import Lease
from foveacam_server.foundation.named_documents import NamedDocuments
from foveacam_server.foundation.settings import Settings
from foveacam_server.resources.calibration_sessions.descriptions import SessionReader
from foveacam_server.resources.calibration_sessions.runs import CalibrationJobTools
from foveacam_server.resources.calibration_sessions.service import CalibrationSessionService
from foveacam_server.resources.calibration_sessions.sessions import SessionCollection
from foveacam_server.resources.calibrations.records import CalibrationRecords
from foveacam_server.resources.cameras.presets import CameraPreset, CameraPresets
from foveacam_server.resources.cameras.trigger_tests import TriggerTests
from foveacam_server.resources.clouds.collection import CloudCollection
from foveacam_server.resources.clouds.shapes import ShapeWorker
from foveacam_server.resources.depth_backends.comparison import BackendComparisons
from foveacam_server.resources.depth_backends.service import DepthBackendService
from foveacam_server.resources.displays.service import PatternDisplayService
from foveacam_server.resources.drift_checks.service import DriftChecks
from foveacam_server.resources.faults.service import FaultService
from foveacam_server.resources.fixations.service import FixationService, FixationTools
from foveacam_server.resources.follows.rounds import FollowRounds
from foveacam_server.resources.follows.service import FollowService
from foveacam_server.resources.loop.service import LoopService
from foveacam_server.resources.measurements.point_finder import ShownViews
from foveacam_server.resources.measurements.service import MeasurementService, MeasuringTools
from foveacam_server.resources.positioners.pan_tilt import PanTiltService
from foveacam_server.resources.positioners.rail import RailService
from foveacam_server.resources.rig_setup.found_devices import DeviceSearch
from foveacam_server.resources.rig_setup.pictures import CameraPictures
from foveacam_server.resources.rig_setup.service import RigSetupService
from foveacam_server.resources.suggestions.service import SuggestionService
from foveacam_server.resources.views.layout_routes import WindowLayout
from foveacam_server.resources.views.scene_follower import RigGaze, SceneFollower
from foveacam_server.resources.wide_depth.context_keeper import ContextKeeper
from foveacam_server.resources.wide_depth.service import WideDepthService, WideDepthTools
from foveacam_server.rig.chosen_rig import ChosenRig
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.ports import AssembledRig
from foveacam_server.rig.stop import StopSwitch


def open_services(settings: Settings, *, stack: ExitStack, loop: asyncio.AbstractEventLoop) -> Services:
    """Open all services; the rig opens on its own thread, so that a missing device delays nothing."""
    foundation = open_foundation(settings, stack=stack)
    faults = FaultService(foundation.events)
    knowledge = open_rig_knowledge(foundation)
    displays = open_displays(foundation, knowledge, loop=loop)
    rig, search = ChosenRig(settings), DeviceSearch()
    hardware = _hardware(foundation, knowledge, displays, rig=rig)
    jobs = JobRunner(foundation.store, events=foundation.events, clock=foundation.clock)
    calibration = _open_calibration(foundation, knowledge, displays, hardware=hardware, jobs=jobs)
    trigger_tests = _trigger_tests(foundation, knowledge, hardware=hardware, jobs=jobs)
    depth_backends = DepthBackendService(foundation.store.subfolder("networks"), events=foundation.events)
    displays.stereo.match_by(lambda pair: depth_backends.estimate_live(pair).disparity)
    collected = open_collections(
        foundation, knowledge, displays, hardware=hardware, jobs=jobs, backends=depth_backends
    )
    observation = _open_observation(
        foundation,
        knowledge,
        displays,
        hardware=hardware,
        jobs=jobs,
        captures=collected.captures.collection,
        matcher=depth_backends,
    )
    stop, stopping = _stop(foundation, hardware, jobs)
    computing = ComputeQueue()
    stack.callback(computing.close)
    hardware.start()
    _start_scene_follower(foundation, knowledge, displays, hardware)
    return Services(
        settings=settings,
        clock=foundation.clock,
        store=foundation.store,
        events=foundation.events,
        faults=faults,
        lease=Lease(clock=foundation.clock, events=foundation.events),
        hub=displays.hub,
        streams=displays.streams,
        stereo=displays.stereo,
        hardware=hardware,
        rig_setup=RigSetupService(
            settings.data, rig, replayed=settings.replay is not None, events=foundation.events
        ),
        device_search=search,
        camera_pictures=CameraPictures(displays.hub, search, clock=foundation.clock),
        cameras=knowledge.cameras,
        camera_presets=CameraPresets(
            NamedDocuments(
                foundation.store.subfolder("camera_presets"),
                CameraPreset,
                form="foveacam-camera-preset",
                version=1,
            ),
            knowledge.cameras,
        ),
        window_layouts=NamedDocuments(
            foundation.store.subfolder("window_layouts"),
            WindowLayout,
            form="foveacam-window-layout",
            version=1,
        ),
        trigger_tests=trigger_tests,
        pan_tilt=PanTiltService(hardware),
        rail=RailService(hardware),
        settling=knowledge.settling,
        stop=stop,
        computing=computing,
        stopping=stopping,
        calibration=knowledge.calibration,
        records=calibration.records,
        sessions=calibration.sessions,
        drift=calibration.drift,
        displays=PatternDisplayService(
            foundation.store.subfolder("displays"), clock=foundation.clock, events=foundation.events
        ),
        overlay=displays.overlay,
        jobs=jobs,
        clouds=observation.clouds,
        depth_backends=depth_backends,
        backend_comparisons=BackendComparisons(depth_backends),
        captures=collected.captures,
        stills=collected.stills,
        recordings=collected.recordings,
        mosaics=collected.mosaics,
        references=collected.references,
        fixations=observation.fixations,
        follows=observation.follows,
        rounds=observation.rounds,
        loop=observation.loop,
        wide_depth=observation.wide_depth,
        measurements=observation.measurements,
        suggestions=SuggestionService(displays.hub),
        viewer=displays.viewer,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _CalibrationServices:
    """Services that measure and store calibrations."""

    sessions: CalibrationSessionService
    drift: DriftChecks
    records: CalibrationRecords


def _open_calibration(
    foundation: ServerFoundation,
    knowledge: RigKnowledge,
    displays: DisplayServices,
    *,
    hardware: HardwareThread,
    jobs: JobRunner,
) -> _CalibrationServices:
    tools = CalibrationJobTools(
        hardware=hardware,
        calibration=knowledge.calibration,
        jobs=jobs,
        sink=displays.tap,
        events=foundation.events,
        clock=foundation.clock,
        settling=knowledge.settling,
    )
    sessions, drift = (
        SessionCollection(knowledge.folder / "sessions"),
        DriftChecks(knowledge.folder / "drift", tools),
    )
    records = CalibrationRecords(
        knowledge.calibration,
        sessions=SessionReader(sessions),
        drift=drift.records,
        hardware=hardware,
        health=knowledge.health,
    )
    return _CalibrationServices(
        sessions=CalibrationSessionService(sessions, tools), drift=drift, records=records
    )


def _trigger_tests(
    foundation: ServerFoundation, knowledge: RigKnowledge, *, hardware: HardwareThread, jobs: JobRunner
) -> TriggerTests:
    folder = knowledge.cameras_folder / "self_tests"
    return TriggerTests(
        folder, cameras=knowledge.cameras, hardware=hardware, jobs=jobs, events=foundation.events
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _ObservationServices:
    """Services that turn looks into fixations, clouds, wide depth and measurements."""

    clouds: CloudCollection
    fixations: FixationService
    follows: FollowService
    rounds: FollowRounds
    loop: LoopService
    wide_depth: WideDepthService
    measurements: MeasurementService


def _hardware(
    foundation: ServerFoundation, knowledge: RigKnowledge, displays: DisplayServices, *, rig: ChosenRig
) -> HardwareThread:
    settings = foundation.settings
    hardware = HardwareThread(
        lambda: _open_rig(foundation, knowledge, rig),
        sink=displays.tap,
        events=foundation.events,
        clock=foundation.clock,
        overlay=displays.overlay.of,
        limits=live_rates(settings),
        keeper=knowledge.cameras,
    )
    foundation.stack.callback(hardware.close)
    displays.stereo.spare_while(lambda: hardware.used_exclusively)
    return hardware


def _open_observation(
    foundation: ServerFoundation,
    knowledge: RigKnowledge,
    displays: DisplayServices,
    *,
    hardware: HardwareThread,
    jobs: JobRunner,
    captures: CaptureCollection,
    matcher: DepthBackendService,
) -> _ObservationServices:
    """Open them and start their threads and that of the jobs, whose handlers are registered by now."""
    clouds = CloudCollection(foundation.store)
    wide_depth = _wide_depth(foundation, knowledge, displays, hardware=hardware, jobs=jobs)

    def on_fixation(fixation: Fixation, calibration: Calibration) -> None:
        knowledge.health.add(fixation, calibration)
        wide_depth.add(fixation, calibration)

    shapes = ShapeWorker(
        clouds=clouds,
        matcher=matcher,
        sink=displays.hub,
        viewer=displays.viewer,
        events=foundation.events,
    )
    tools = FixationTools(
        hardware=hardware,
        calibration=knowledge.calibration,
        jobs=jobs,
        shapes=shapes,
        patches=clouds.patches,
        events=foundation.events,
        clock=foundation.clock,
        on_distance=displays.overlay.look_at_distance,
        on_fixation=on_fixation,
        context=wide_depth,
    )
    fixations = FixationService(foundation.store, tools)
    follows, rounds, vergence = open_following(
        foundation,
        knowledge,
        displays,
        hardware=hardware,
        jobs=jobs,
        fixations=fixations,
        context=wide_depth,
        captures=captures,
    )
    shapes.put_back(fixations.stored_looks())
    for worker in (shapes, wide_depth, jobs):
        worker.start()
        foundation.stack.callback(worker.close)
    measurements = _open_measurements(foundation, knowledge, displays, hardware=hardware, clouds=clouds)
    return _ObservationServices(
        clouds=clouds,
        fixations=fixations,
        follows=follows,
        rounds=rounds,
        loop=vergence,
        wide_depth=wide_depth,
        measurements=measurements,
    )


def _wide_depth(
    foundation: ServerFoundation,
    knowledge: RigKnowledge,
    displays: DisplayServices,
    *,
    hardware: HardwareThread,
    jobs: JobRunner,
) -> WideDepthService:
    keeper = ContextKeeper(
        foundation.store.subfolder("wide_depth"),
        calibration=lambda: knowledge.calibration.current,
        status=lambda: hardware.status,
    )
    tools = WideDepthTools(
        hardware=hardware,
        calibration=knowledge.calibration.require,
        jobs=jobs,
        hub=displays.hub,
        viewer=displays.viewer,
        events=foundation.events,
        clock=foundation.clock,
    )
    return WideDepthService(keeper, tools)


def _open_measurements(
    foundation: ServerFoundation,
    knowledge: RigKnowledge,
    displays: DisplayServices,
    *,
    hardware: HardwareThread,
    clouds: CloudCollection,
) -> MeasurementService:
    def picture_t_ns(view: str) -> int | None:
        newest = displays.hub.newest(view)
        return None if newest is None else newest.t_ns

    tools = MeasuringTools(
        clouds=clouds,
        wide=lambda: knowledge.calibration.require().wide,
        shown=ShownViews(volts=lambda: hardware.pose, picture_t_ns=picture_t_ns),
        events=foundation.events,
        viewer=displays.viewer,
    )
    measurements = MeasurementService(foundation.store, tools)
    measurements.put_back()
    return measurements


def _stop(
    foundation: ServerFoundation, hardware: HardwareThread, jobs: JobRunner
) -> tuple[StopSwitch, ThreadPoolExecutor]:
    stop = StopSwitch(hardware, cancel_jobs=jobs.cancel_all, events=foundation.events)
    stopping = ThreadPoolExecutor(2, thread_name_prefix="foveacam-stop")
    foundation.stack.callback(stopping.shutdown)
    return stop, stopping


def _start_scene_follower(
    foundation: ServerFoundation, knowledge: RigKnowledge, displays: DisplayServices, hardware: HardwareThread
) -> None:
    """Start to show in the 3D pane where the foveae look."""
    if displays.viewer is None:
        return

    def gaze() -> RigGaze | None:
        current = knowledge.calibration.current
        if current is None:
            return None
        return RigGaze(calibration=current, volts=hardware.pose, distance_m=displays.overlay.distance_m)

    follower = SceneFollower(displays.viewer, gaze=gaze)
    follower.start()
    foundation.stack.callback(follower.close)


def _open_rig(foundation: ServerFoundation, knowledge: RigKnowledge, chosen: ChosenRig) -> AssembledRig:
    replay = foundation.settings.replay
    if replay is not None:
        return _open_replay(foundation, knowledge, replay)
    rig = open_rig(chosen.config(), clock=foundation.clock, guarded=True)
    knowledge.calibration.choose_for(rig.rig_id)
    knowledge.settling.restore(rig)
    return rig


def _open_replay(foundation: ServerFoundation, knowledge: RigKnowledge, replay: Path) -> AssembledRig:
    """Return the rig that plays a recording, with the calibration that was recorded with it."""
    from foveacam_server.rig.replay import open_recording, playback_of

    recorded = open_recording(replay)
    rig = replay_rig(recorded, playback=playback_of(foundation.settings), clock=foundation.clock)
    knowledge.calibration.choose_for(rig.rig_id, brought=recorded.calibration)
    knowledge.settling.restore(rig)
    return rig
