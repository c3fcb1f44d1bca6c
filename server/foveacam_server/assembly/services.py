"""All services of a running server, which the lifespan opens; each router names those that it uses."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING

from foveacam_hardware.contract import Clock
from foveacam_server.accounts.accounts import Accounts
from foveacam_server.foundation.computing.compute_queue import ComputeQueue
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.lease import Lease
from foveacam_server.foundation.named_documents import NamedDocuments
from foveacam_server.foundation.settings import Settings
from foveacam_server.foundation.store import Store
from foveacam_server.resources.calibrating.calibrations.records import CalibrationRecords
from foveacam_server.resources.calibrating.calibrations.service import CalibrationService
from foveacam_server.resources.calibrating.drift_checks.service import DriftChecks
from foveacam_server.resources.calibrating.sessions.service import CalibrationSessionService
from foveacam_server.resources.capturing.archive.service import ArchiveService
from foveacam_server.resources.capturing.batches.service import BatchService
from foveacam_server.resources.capturing.captures.service import CaptureService
from foveacam_server.resources.capturing.mosaics.service import MosaicService
from foveacam_server.resources.capturing.recordings.service import RecordingService
from foveacam_server.resources.capturing.references.service import ReferenceService
from foveacam_server.resources.capturing.retention.service import RetentionService
from foveacam_server.resources.capturing.stills.service import StillService
from foveacam_server.resources.devices.cameras.presets import CameraPresets
from foveacam_server.resources.devices.cameras.service import CameraSettingsService
from foveacam_server.resources.devices.cameras.trigger_tests import TriggerTests
from foveacam_server.resources.devices.displays.service import PatternDisplayService
from foveacam_server.resources.devices.faults.service import FaultService
from foveacam_server.resources.devices.positioners.pan_tilt import PanTiltService
from foveacam_server.resources.devices.positioners.rail import RailService
from foveacam_server.resources.devices.rig_setup.found_devices import DeviceSearch
from foveacam_server.resources.devices.rig_setup.pictures import CameraPictures
from foveacam_server.resources.devices.rig_setup.service import RigSetupService
from foveacam_server.resources.devices.settle_time.service import SettleTimeService
from foveacam_server.resources.looking.clouds.collection import CloudCollection
from foveacam_server.resources.looking.depth_backends.comparison import BackendComparisons
from foveacam_server.resources.looking.depth_backends.service import DepthBackendService
from foveacam_server.resources.looking.fixations.service import FixationService
from foveacam_server.resources.looking.follows.rounds import FollowRounds
from foveacam_server.resources.looking.follows.service import FollowService
from foveacam_server.resources.looking.loop.service import LoopService
from foveacam_server.resources.looking.measurements.service import MeasurementService
from foveacam_server.resources.looking.suggestions.service import SuggestionService
from foveacam_server.resources.looking.wide_depth.service import WideDepthService
from foveacam_server.resources.operating.engine.service import EngineService
from foveacam_server.resources.operating.rigs.service import RigDirectory
from foveacam_server.resources.operating.views.layout_routes import WindowLayout
from foveacam_server.resources.operating.views.live_stereo import LiveStereo
from foveacam_server.resources.operating.views.overlay import GazeOverlay
from foveacam_server.rig.frame_hub import FrameHub
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.ports import SceneViewer
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
    device_search: DeviceSearch
    camera_pictures: CameraPictures
    cameras: CameraSettingsService
    camera_presets: CameraPresets
    window_layouts: NamedDocuments[WindowLayout]
    trigger_tests: TriggerTests
    pan_tilt: PanTiltService
    rail: RailService
    settling: SettleTimeService
    stop: StopSwitch
    computing: ComputeQueue
    stopping: ThreadPoolExecutor
    """Threads that only the stop uses, so that no other request can delay it."""
    calibration: CalibrationService
    records: CalibrationRecords
    sessions: CalibrationSessionService
    drift: DriftChecks
    displays: PatternDisplayService
    overlay: GazeOverlay
    jobs: JobRunner
    clouds: CloudCollection
    depth_backends: DepthBackendService
    backend_comparisons: BackendComparisons
    captures: CaptureService
    recordings: RecordingService
    stills: StillService
    mosaics: MosaicService
    references: ReferenceService
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
    suggestions: SuggestionService
    viewer: SceneViewer | None
    """The 3D pane; None when it is switched off or could not be started."""


if TYPE_CHECKING:
    from foveacam_server.resources.calibrating.calibrations.routes import CalibrationRouteServices
    from foveacam_server.resources.calibrating.drift_checks.routes import DriftCheckRouteServices
    from foveacam_server.resources.calibrating.sessions.routes import CalibrationSessionRouteServices
    from foveacam_server.resources.capturing.archive.routes import ArchiveRouteServices
    from foveacam_server.resources.capturing.batches.routes import BatchRouteServices
    from foveacam_server.resources.capturing.captures.routes import CaptureRouteServices
    from foveacam_server.resources.capturing.mosaics.routes import MosaicRouteServices
    from foveacam_server.resources.capturing.recordings.routes import RecordingRouteServices
    from foveacam_server.resources.capturing.references.routes import ReferenceRouteServices
    from foveacam_server.resources.capturing.retention.routes import RetentionRouteServices
    from foveacam_server.resources.capturing.stills.routes import StillRouteServices
    from foveacam_server.resources.devices.cameras.preset_routes import CameraPresetRouteServices
    from foveacam_server.resources.devices.cameras.routes import CameraRouteServices
    from foveacam_server.resources.devices.displays.routes import DisplayRouteServices
    from foveacam_server.resources.devices.faults.routes import FaultRouteServices
    from foveacam_server.resources.devices.mirrors.routes import MirrorRouteServices
    from foveacam_server.resources.devices.positioners.pan_tilt_routes import PanTiltRouteServices
    from foveacam_server.resources.devices.positioners.rail_routes import RailRouteServices
    from foveacam_server.resources.devices.rig_setup.routes import RigSetupRouteServices
    from foveacam_server.resources.devices.rig_state.binning_routes import BinningRouteServices
    from foveacam_server.resources.devices.rig_state.health_routes import HealthRouteServices
    from foveacam_server.resources.devices.rig_state.routes import RigRouteServices
    from foveacam_server.resources.devices.settle_time.routes import SettleTimeRouteServices
    from foveacam_server.resources.devices.simulation.routes import SimulationRouteServices
    from foveacam_server.resources.devices.stop.routes import StopRouteServices
    from foveacam_server.resources.looking.clouds.depth_routes import DepthRouteServices
    from foveacam_server.resources.looking.clouds.routes import CloudRouteServices
    from foveacam_server.resources.looking.depth_backends.routes import DepthBackendRouteServices
    from foveacam_server.resources.looking.fixations.correction_routes import CorrectionRouteServices
    from foveacam_server.resources.looking.fixations.routes import FixationRouteServices
    from foveacam_server.resources.looking.fixations.target_routes import TargetRouteServices
    from foveacam_server.resources.looking.follows.routes import FollowRouteServices
    from foveacam_server.resources.looking.loop.routes import LoopRouteServices
    from foveacam_server.resources.looking.measurements.routes import MeasurementRouteServices
    from foveacam_server.resources.looking.reach.routes import ReachRouteServices
    from foveacam_server.resources.looking.suggestions.routes import SuggestionRouteServices
    from foveacam_server.resources.looking.wide_depth.routes import WideDepthRouteServices
    from foveacam_server.resources.operating.engine.routes import EngineRouteServices
    from foveacam_server.resources.operating.events.routes import EventRouteServices
    from foveacam_server.resources.operating.jobs.routes import JobRouteServices
    from foveacam_server.resources.operating.lease.routes import LeaseRouteServices
    from foveacam_server.resources.operating.people.audit_routes import AuditRouteServices
    from foveacam_server.resources.operating.people.session_routes import SessionRouteServices
    from foveacam_server.resources.operating.people.token_routes import TokenRouteServices
    from foveacam_server.resources.operating.people.user_routes import UserRouteServices
    from foveacam_server.resources.operating.rigs.routes import RigListServices
    from foveacam_server.resources.operating.views.layout_routes import WindowLayoutRouteServices
    from foveacam_server.resources.studying.planner.routes import PlannerRouteServices

    def _check_route_services(services: Services) -> None:
        """Let the type checker verify that the services of every route are opened."""
        _archive: ArchiveRouteServices = services
        _batch: BatchRouteServices = services
        _calibration_session: CalibrationSessionRouteServices = services
        _calibration: CalibrationRouteServices = services
        _camera: CameraRouteServices = services
        _camera_preset: CameraPresetRouteServices = services
        _capture: CaptureRouteServices = services
        _depth: DepthRouteServices = services
        _cloud: CloudRouteServices = services
        _correction: CorrectionRouteServices = services
        _depth_backend: DepthBackendRouteServices = services
        _display: DisplayRouteServices = services
        _drift_check: DriftCheckRouteServices = services
        _engine: EngineRouteServices = services
        _event: EventRouteServices = services
        _fault: FaultRouteServices = services
        _fixation: FixationRouteServices = services
        _target: TargetRouteServices = services
        _follow: FollowRouteServices = services
        _job: JobRouteServices = services
        _lease: LeaseRouteServices = services
        _loop: LoopRouteServices = services
        _measurement: MeasurementRouteServices = services
        _mirror: MirrorRouteServices = services
        _mosaic: MosaicRouteServices = services
        _audit: AuditRouteServices = services
        _session: SessionRouteServices = services
        _token: TokenRouteServices = services
        _user: UserRouteServices = services
        _planner: PlannerRouteServices = services
        _rigs: RigListServices = services
        _pan_tilt: PanTiltRouteServices = services
        _rail: RailRouteServices = services
        _reach: ReachRouteServices = services
        _recording: RecordingRouteServices = services
        _reference: ReferenceRouteServices = services
        _binning: BinningRouteServices = services
        _health: HealthRouteServices = services
        _rig: RigRouteServices = services
        _retention: RetentionRouteServices = services
        _rig_setup: RigSetupRouteServices = services
        _settle_time: SettleTimeRouteServices = services
        _simulation: SimulationRouteServices = services
        _still: StillRouteServices = services
        _stop: StopRouteServices = services
        _suggestion: SuggestionRouteServices = services
        _window_layout: WindowLayoutRouteServices = services
        _wide_depth: WideDepthRouteServices = services
