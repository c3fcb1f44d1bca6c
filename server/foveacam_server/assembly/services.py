"""All services of a running server, opened by the lifespan; each route declares those that it uses."""

from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import get_type_hints

from foveacam_hardware.contract import Clock
from foveacam_server.accounts.accounts import Accounts
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.computing.compute_queue import ComputeQueue
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.http.provided import ServiceRegistry
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.lease import Lease
from foveacam_server.foundation.named_documents import NamedDocuments
from foveacam_server.foundation.settings import Settings
from foveacam_server.foundation.store import Store
from foveacam_server.resources.calibrating.acceptances.service import Acceptances
from foveacam_server.resources.calibrating.calibrations.records import CalibrationRecords
from foveacam_server.resources.calibrating.calibrations.service import CalibrationService
from foveacam_server.resources.calibrating.drift_checks.service import DriftChecks
from foveacam_server.resources.calibrating.sessions.service import CalibrationSessionService
from foveacam_server.resources.capturing.archive.service import ArchiveService
from foveacam_server.resources.capturing.batches.service import BatchService
from foveacam_server.resources.capturing.captures.routes import CaptureProducts
from foveacam_server.resources.capturing.captures.service import CaptureService
from foveacam_server.resources.capturing.exports.service import ExportService
from foveacam_server.resources.capturing.mosaics.service import MosaicService
from foveacam_server.resources.capturing.recordings.service import RecordingService
from foveacam_server.resources.capturing.references.routes import CaptureSource
from foveacam_server.resources.capturing.references.service import ReferenceService
from foveacam_server.resources.capturing.retention.service import RetentionService
from foveacam_server.resources.capturing.stills.service import StillService
from foveacam_server.resources.devices.cameras.presets import CameraPresets
from foveacam_server.resources.devices.cameras.service import CameraSettingsService
from foveacam_server.resources.devices.cameras.trigger_tests import TriggerTests
from foveacam_server.resources.devices.displays.service import PatternDisplayService
from foveacam_server.resources.devices.faults.service import FaultService
from foveacam_server.resources.devices.mirrors.routes import OverlayDistance
from foveacam_server.resources.devices.rig_setup.pictures import NewestPictures
from foveacam_server.resources.devices.rig_setup.service import RigSetupService
from foveacam_server.resources.devices.rig_state.routes import (
    CalibrationDescriber,
    SettleTimeSource,
    SteeringCalibration,
)
from foveacam_server.resources.devices.settle_time.routes import SettleTimeSessions
from foveacam_server.resources.devices.settle_time.service import SettleTimeService
from foveacam_server.resources.looking.clouds.collection import CloudCollection
from foveacam_server.resources.looking.clouds.routes import CloudOwners
from foveacam_server.resources.looking.depth_backends.service import DepthBackendService
from foveacam_server.resources.looking.fixations.service import FixationService
from foveacam_server.resources.looking.follows.rounds import FollowRounds
from foveacam_server.resources.looking.follows.service import FollowService
from foveacam_server.resources.looking.loop.service import LoopService
from foveacam_server.resources.looking.measurements.service import MeasurementService
from foveacam_server.resources.looking.wide_depth.service import WideDepthService
from foveacam_server.resources.operating.engine.service import EngineService
from foveacam_server.resources.operating.rigs.service import RigDirectory
from foveacam_server.resources.operating.views.layout_routes import WindowLayout
from foveacam_server.resources.operating.views.live_stereo import LiveStereo
from foveacam_server.resources.operating.views.overlay import GazeOverlay
from foveacam_server.rig.frame_hub import FrameHub
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.ports import CalibrationInForce, SceneViewer
from foveacam_server.rig.stop import StopSwitch
from foveacam_server.rig.stream import LiveStreams


@dataclass(slots=True, kw_only=True)
class Services:
    """The services of one running server."""

    settings: Settings
    """Changes at every start, so that a page detects a restart."""
    clock: Clock
    store: Store
    events: EventLog
    accounts: Accounts
    faults: FaultService
    engine: EngineService
    lease: Lease
    rigs: RigDirectory
    hub: FrameHub
    streams: LiveStreams
    stereo: LiveStereo
    """Live anaglyph, difference and depth."""
    hardware: HardwareThread
    rig_setup: RigSetupService
    cameras: CameraSettingsService
    camera_presets: CameraPresets
    window_layouts: NamedDocuments[WindowLayout]
    trigger_tests: TriggerTests
    settling: SettleTimeService
    stop: StopSwitch
    computing: ComputeQueue
    stopping: ThreadPoolExecutor
    """Threads reserved for the stop, so that no other request can delay it."""
    calibration: CalibrationService
    records: CalibrationRecords
    sessions: CalibrationSessionService
    drift: DriftChecks
    acceptances: Acceptances
    displays: PatternDisplayService
    overlay: GazeOverlay
    jobs: JobRunner
    clouds: CloudCollection
    depth_backends: DepthBackendService
    captures: CaptureService
    recordings: RecordingService
    stills: StillService
    mosaics: MosaicService
    references: ReferenceService
    exports: ExportService
    archive: ArchiveService
    retention: RetentionService
    batches: BatchService
    fixations: FixationService
    follows: FollowService
    rounds: FollowRounds
    loop: LoopService
    wide_depth: WideDepthService
    """Depth of the whole wide view; a `DepthContext` for fixations."""
    measurements: MeasurementService
    viewer: SceneViewer | None
    """The 3D pane; None when it is switched off or could not be started."""


def registry_of(services: Services, routers: Iterable[GuardedRouter]) -> ServiceRegistry:
    """Return the services by their types, with those that routers open for their own routes.

    Protocols through which resources see each other are registered as separate types. Raise `DeviceFault`
    when a route asks for a type that none of them has.
    """
    registry = ServiceRegistry()
    for name, kind in get_type_hints(Services).items():
        registry.add(kind, getattr(services, name))
    registry.add(CalibrationInForce, services.calibration)
    registry.add(SteeringCalibration, services.calibration)
    registry.add(CalibrationDescriber, services.records)
    registry.add(SettleTimeSource, services.settling)
    registry.add(SettleTimeSessions, services.sessions)
    registry.add(OverlayDistance, services.overlay)
    registry.add(CloudOwners, services.fixations)
    registry.add(CaptureSource, services.captures)
    registry.add(CaptureProducts, (services.mosaics, services.references, services.exports))
    registry.add(NewestPictures, services.hub)
    for router in routers:
        for opened in router.opens:
            registry.open(opened)
        for route in router.declared:
            registry.check(route.endpoint)
    return registry
