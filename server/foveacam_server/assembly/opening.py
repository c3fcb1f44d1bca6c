"""Opens all services of a running server in order, and registers their closing in the reverse order.

Small groups of services are opened here, large ones by the modules beside this one.
"""

import asyncio
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from foveacam_server.assembly.collection_services import (
    CollectionServices,
    open_collections,
    open_retention,
)
from foveacam_server.assembly.first_services import (
    ServerFoundation,
    SharedServices,
    open_displays,
    open_hardware,
    open_rig_knowledge,
)
from foveacam_server.assembly.observing import (
    ObservationServices,
    open_observation,
    open_wide_depth,
    retained_looks,
)
from foveacam_server.assembly.services import Services
from foveacam_server.checks.machine import Machine
from foveacam_server.foundation.computing.compute_queue import ComputeQueue
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.lease import Lease
from foveacam_server.foundation.named_documents import NamedDocuments
from foveacam_server.resources.calibrating.acceptances.service import Acceptances
from foveacam_server.resources.calibrating.calibrations.records import CalibrationRecords
from foveacam_server.resources.calibrating.drift_checks.service import DriftChecks
from foveacam_server.resources.calibrating.sessions.descriptions import SessionReader
from foveacam_server.resources.calibrating.sessions.runs import CalibrationJobTools
from foveacam_server.resources.calibrating.sessions.service import CalibrationSessionService
from foveacam_server.resources.calibrating.sessions.sessions import SessionCollection
from foveacam_server.resources.capturing.captures import estimates
from foveacam_server.resources.devices.cameras.presets import CameraPreset, CameraPresets
from foveacam_server.resources.devices.cameras.trigger_tests import TriggerTests
from foveacam_server.resources.devices.displays.service import PatternDisplayService
from foveacam_server.resources.devices.faults.service import FaultService
from foveacam_server.resources.devices.rig_setup.service import RigSetupService
from foveacam_server.resources.looking.depth_backends.service import DepthBackendService
from foveacam_server.resources.operating.engine.process_files import ProcessFiles
from foveacam_server.resources.operating.engine.service import EngineParts, EngineService
from foveacam_server.resources.operating.rigs.announcements import open_announcements
from foveacam_server.resources.operating.rigs.rig_list import read_rig_list
from foveacam_server.resources.operating.rigs.service import RigDirectory
from foveacam_server.resources.operating.views.layout_routes import WindowLayout
from foveacam_server.resources.operating.views.scene_follower import RigGaze, SceneFollower
from foveacam_server.resources.studying.planner import computations as planner
from foveacam_server.rig.chosen_rig import ChosenRig
from foveacam_server.rig.stop import StopSwitch


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationServices:
    """Services that measure and store calibrations, and the trigger tests."""

    sessions: CalibrationSessionService
    drift: DriftChecks
    acceptances: Acceptances
    records: CalibrationRecords
    trigger_tests: TriggerTests


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenedGroups:
    """The groups of services, in the order in which they are opened."""

    faults: FaultService
    rig: ChosenRig
    shared: SharedServices
    calibration: CalibrationServices
    depth_backends: DepthBackendService
    collections: CollectionServices
    observation: ObservationServices


def open_services(foundation: ServerFoundation, *, loop: asyncio.AbstractEventLoop) -> Services:
    """Open all services; the rig opens on the hardware thread, so that a missing device delays nothing."""
    groups = _open_groups(foundation, loop=loop)
    shared, collections, observation = groups.shared, groups.collections, groups.observation
    knowledge, displays = shared.knowledge, shared.displays
    stop, stopping = _stop(shared)
    computing = _open_computing(foundation)
    shared.hardware.start()
    _start_scene_follower(shared)
    lease = _open_lease(foundation)
    return Services(
        settings=foundation.settings,
        clock=foundation.clock,
        store=foundation.store,
        events=foundation.events,
        accounts=foundation.accounts,
        faults=groups.faults,
        engine=_open_engine(shared),
        lease=lease,
        rigs=_rig_directory(shared, lease),
        hub=displays.hub,
        streams=displays.streams,
        stereo=displays.stereo,
        hardware=shared.hardware,
        rig_setup=_rig_setup(foundation, groups.rig),
        cameras=knowledge.cameras,
        camera_presets=_camera_presets(shared),
        window_layouts=_window_layouts(foundation),
        trigger_tests=groups.calibration.trigger_tests,
        settling=knowledge.settling,
        stop=stop,
        computing=computing,
        stopping=stopping,
        calibration=knowledge.calibration,
        records=groups.calibration.records,
        sessions=groups.calibration.sessions,
        drift=groups.calibration.drift,
        acceptances=groups.calibration.acceptances,
        displays=_pattern_displays(foundation),
        overlay=displays.overlay,
        jobs=shared.jobs,
        clouds=observation.clouds,
        depth_backends=groups.depth_backends,
        captures=collections.captures,
        stills=collections.stills,
        recordings=collections.recordings,
        mosaics=collections.mosaics,
        references=collections.references,
        exports=collections.exports,
        archive=collections.archive,
        retention=open_retention(shared, collections, looks=retained_looks(shared, observation)),
        batches=collections.batches,
        fixations=observation.fixations,
        follows=observation.follows,
        rounds=observation.rounds,
        loop=observation.loop,
        wide_depth=observation.wide_depth,
        measurements=observation.measurements,
        viewer=displays.viewer,
    )


def _open_lease(foundation: ServerFoundation) -> Lease:
    blocked_ns = foundation.lag.blocked_ns
    return Lease(clock=foundation.clock, events=foundation.events, blocked_ns=blocked_ns)


def _open_groups(foundation: ServerFoundation, *, loop: asyncio.AbstractEventLoop) -> OpenedGroups:
    faults = FaultService(foundation.events)
    rig = ChosenRig(foundation.settings)
    shared = _open_shared(foundation, rig, loop=loop)
    calibration = _open_calibration(shared)
    backends = DepthBackendService(foundation.store.subfolder("networks"), events=foundation.events)
    shared.displays.stereo.match_by(lambda pair: backends.estimate_live(pair).disparity)
    wide_depth = open_wide_depth(shared)
    collections = open_collections(shared, backends=backends, context=wide_depth)
    observation = open_observation(
        shared, captures=collections.captures.collection, matcher=backends, wide_depth=wide_depth
    )
    return OpenedGroups(
        faults=faults,
        rig=rig,
        shared=shared,
        calibration=calibration,
        depth_backends=backends,
        collections=collections,
        observation=observation,
    )


def _open_shared(
    foundation: ServerFoundation, rig: ChosenRig, *, loop: asyncio.AbstractEventLoop
) -> SharedServices:
    knowledge = open_rig_knowledge(foundation)
    displays = open_displays(foundation, knowledge, loop=loop)
    return SharedServices(
        foundation=foundation,
        knowledge=knowledge,
        displays=displays,
        hardware=open_hardware(foundation, knowledge, displays, rig=rig),
        jobs=JobRunner(foundation.store, events=foundation.events, clock=foundation.clock),
    )


def _open_calibration(shared: SharedServices) -> CalibrationServices:
    """Open the calibration services, which share the runner of calibration jobs."""
    tools = CalibrationJobTools(
        hardware=shared.hardware,
        calibration=shared.knowledge.calibration,
        jobs=shared.jobs,
        sink=shared.displays.tap,
        events=shared.foundation.events,
        clock=shared.foundation.clock,
        settling=shared.knowledge.settling,
    )
    sessions = SessionCollection(shared.knowledge.folder / "sessions")
    drift = DriftChecks(shared.knowledge.folder / "drift", tools)
    acceptances = Acceptances(shared.knowledge.folder / "acceptances", tools)
    records = CalibrationRecords(
        shared.knowledge.calibration,
        sessions=SessionReader(sessions),
        drift=drift.records,
        acceptances=acceptances.records,
        hardware=shared.hardware,
        health=shared.knowledge.health,
    )
    return CalibrationServices(
        sessions=CalibrationSessionService(sessions, tools),
        drift=drift,
        acceptances=acceptances,
        records=records,
        trigger_tests=_trigger_tests(shared),
    )


def _trigger_tests(shared: SharedServices) -> TriggerTests:
    return TriggerTests(
        shared.knowledge.cameras_folder / "self_tests",
        cameras=shared.knowledge.cameras,
        hardware=shared.hardware,
        jobs=shared.jobs,
        events=shared.foundation.events,
    )


def _rig_setup(foundation: ServerFoundation, rig: ChosenRig) -> RigSetupService:
    replayed = foundation.settings.replay is not None
    return RigSetupService(foundation.settings.data, rig, replayed=replayed, events=foundation.events)


def _rig_directory(shared: SharedServices, lease: Lease) -> RigDirectory:
    settings, announcements = shared.foundation.settings, None
    named = () if settings.rigs is None else read_rig_list(settings.rigs)
    if settings.announce:
        with ThreadPoolExecutor(1) as beside:  # this thread has an event loop, for which zeroconf would wait
            announcements = beside.submit(open_announcements, settings.host).result()
        shared.foundation.stack.callback(announcements.close)
    return RigDirectory(named, announcements, own=lambda: shared.hardware.status, lease=lease)


def _camera_presets(shared: SharedServices) -> CameraPresets:
    folder = shared.foundation.store.subfolder("camera_presets")
    presets = NamedDocuments(folder, CameraPreset, form="foveacam-camera-preset", version=1)
    return CameraPresets(presets, shared.knowledge.cameras)


def _window_layouts(foundation: ServerFoundation) -> NamedDocuments[WindowLayout]:
    folder = foundation.store.subfolder("window_layouts")
    return NamedDocuments(folder, WindowLayout, form="foveacam-window-layout", version=1)


def _pattern_displays(foundation: ServerFoundation) -> PatternDisplayService:
    folder = foundation.store.subfolder("displays")
    return PatternDisplayService(folder, clock=foundation.clock, events=foundation.events)


def _stop(shared: SharedServices) -> tuple[StopSwitch, ThreadPoolExecutor]:
    stop = StopSwitch(shared.hardware, cancel_jobs=shared.jobs.cancel_all, events=shared.foundation.events)
    stopping = ThreadPoolExecutor(2, thread_name_prefix="foveacam-stop")
    shared.foundation.stack.callback(stopping.shutdown)
    return stop, stopping


def _open_computing(foundation: ServerFoundation) -> ComputeQueue:
    computing = ComputeQueue([planner.__name__, estimates.__name__])
    foundation.stack.callback(computing.close)
    return computing


def _open_engine(shared: SharedServices) -> EngineService:
    """Start the load measurement; called on the event loop's thread."""
    engine = EngineService(
        EngineParts(
            hardware=shared.hardware,
            streams=shared.displays.streams,
            store=shared.foundation.store,
            clock=shared.foundation.clock,
            process=ProcessFiles(Machine()),
            lag=shared.foundation.lag,
            loop_thread=threading.get_native_id(),
        )
    )
    engine.start()
    shared.foundation.stack.callback(engine.close)
    return engine


def _start_scene_follower(shared: SharedServices) -> None:
    """Start to show the foveae's gaze in the 3D pane."""
    if shared.displays.viewer is None:
        return

    def gaze() -> RigGaze | None:
        current = shared.knowledge.calibration.current
        if current is None:
            return None
        return RigGaze(
            calibration=current, volts=shared.hardware.pose, distance_m=shared.displays.overlay.distance_m
        )

    follower = SceneFollower(shared.displays.viewer, gaze=gaze)
    follower.start()
    shared.foundation.stack.callback(follower.close)
