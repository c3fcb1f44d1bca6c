"""Opens all services of a running server in order, and registers their closing in the reverse order."""

import asyncio
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack

from foveacam_hardware.contract import Clock
from foveacam_server.assembly.calibrating import open_calibration, open_trigger_tests
from foveacam_server.assembly.collection_services import open_collections
from foveacam_server.assembly.first_services import (
    DisplayServices,
    RigKnowledge,
    ServerFoundation,
    open_displays,
    open_foundation,
    open_rig_knowledge,
)
from foveacam_server.assembly.observing import open_observation
from foveacam_server.assembly.rig_opening import open_hardware
from foveacam_server.assembly.services import Services
from foveacam_server.checks.machine import Machine
from foveacam_server.foundation.compute_queue import ComputeQueue
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.lease import Lease
from foveacam_server.foundation.named_documents import NamedDocuments
from foveacam_server.foundation.settings import Settings
from foveacam_server.resources.cameras.presets import CameraPreset, CameraPresets
from foveacam_server.resources.depth_backends.comparison import BackendComparisons
from foveacam_server.resources.depth_backends.service import DepthBackendService
from foveacam_server.resources.displays.service import PatternDisplayService
from foveacam_server.resources.engine.loop_lag import LoopLag
from foveacam_server.resources.engine.process_files import ProcessFiles
from foveacam_server.resources.engine.service import EngineParts, EngineService
from foveacam_server.resources.faults.service import FaultService
from foveacam_server.resources.positioners.pan_tilt import PanTiltService
from foveacam_server.resources.positioners.rail import RailService
from foveacam_server.resources.rig_setup.found_devices import DeviceSearch
from foveacam_server.resources.rig_setup.pictures import CameraPictures
from foveacam_server.resources.rig_setup.service import RigSetupService
from foveacam_server.resources.suggestions.service import SuggestionService
from foveacam_server.resources.views.layout_routes import WindowLayout
from foveacam_server.resources.views.scene_follower import RigGaze, SceneFollower
from foveacam_server.rig.chosen_rig import ChosenRig
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.stop import StopSwitch


def open_services(
    settings: Settings, *, stack: ExitStack, loop: asyncio.AbstractEventLoop, clock: Clock
) -> Services:
    """Open all services; the rig opens on its own thread, so that a missing device delays nothing."""
    foundation = open_foundation(settings, stack=stack, clock=clock)
    faults = FaultService(foundation.events)
    knowledge = open_rig_knowledge(foundation)
    displays = open_displays(foundation, knowledge, loop=loop)
    rig, search = ChosenRig(settings), DeviceSearch()
    hardware = open_hardware(foundation, knowledge, displays, rig=rig)
    jobs = JobRunner(foundation.store, events=foundation.events, clock=foundation.clock)
    calibration = open_calibration(foundation, knowledge, displays, hardware=hardware, jobs=jobs)
    trigger_tests = open_trigger_tests(foundation, knowledge, hardware=hardware, jobs=jobs)
    depth_backends = DepthBackendService(foundation.store.subfolder("networks"), events=foundation.events)
    displays.stereo.match_by(lambda pair: depth_backends.estimate_live(pair).disparity)
    collected = open_collections(
        foundation, knowledge, displays, hardware=hardware, jobs=jobs, backends=depth_backends
    )
    observation = open_observation(
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
        accounts=foundation.accounts,
        faults=faults,
        engine=_open_engine(foundation, displays, hardware, loop=loop),
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
        batches=collected.batches,
        fixations=observation.fixations,
        follows=observation.follows,
        rounds=observation.rounds,
        loop=observation.loop,
        wide_depth=observation.wide_depth,
        measurements=observation.measurements,
        suggestions=SuggestionService(displays.hub),
        viewer=displays.viewer,
    )


def _stop(
    foundation: ServerFoundation, hardware: HardwareThread, jobs: JobRunner
) -> tuple[StopSwitch, ThreadPoolExecutor]:
    stop = StopSwitch(hardware, cancel_jobs=jobs.cancel_all, events=foundation.events)
    stopping = ThreadPoolExecutor(2, thread_name_prefix="foveacam-stop")
    foundation.stack.callback(stopping.shutdown)
    return stop, stopping


def _open_engine(
    foundation: ServerFoundation,
    displays: DisplayServices,
    hardware: HardwareThread,
    *,
    loop: asyncio.AbstractEventLoop,
) -> EngineService:
    """Start to measure the load; called on the event loop's thread."""
    engine = EngineService(
        EngineParts(
            hardware=hardware,
            streams=displays.streams,
            store=foundation.store,
            clock=foundation.clock,
            process=ProcessFiles(Machine()),
            lag=LoopLag(loop),
            loop_thread=threading.get_native_id(),
        )
    )
    engine.start()
    foundation.stack.callback(engine.close)
    return engine


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
