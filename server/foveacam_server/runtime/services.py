"""All services of a running server, which the lifespan opens and the routes get as a dependency."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Annotated, cast

from fastapi import Depends
from starlette.requests import HTTPConnection

from foveacam_hardware.contract import Clock
from foveacam_server.resources.measurements.service import MeasurementService
from foveacam_server.resources.suggestions.service import SuggestionService
from foveacam_server.resources.wide_depth.service import WideDepthService
from foveacam_server.runtime.calibration_records import CalibrationRecords
from foveacam_server.runtime.calibration_session_service import CalibrationSessionService
from foveacam_server.runtime.calibrations import CalibrationService
from foveacam_server.runtime.camera_settings_service import CameraSettingsService
from foveacam_server.runtime.captures import CaptureService
from foveacam_server.runtime.clouds import CloudCollection
from foveacam_server.runtime.compute_queue import ComputeQueue
from foveacam_server.runtime.drift_checks import DriftChecks
from foveacam_server.runtime.events import EventLog
from foveacam_server.runtime.fixations import FixationService
from foveacam_server.runtime.frame_hub import FrameHub
from foveacam_server.runtime.hardware import HardwareThread
from foveacam_server.runtime.jobs import JobRunner
from foveacam_server.runtime.lease import Lease
from foveacam_server.runtime.mosaics import MosaicService
from foveacam_server.runtime.overlay import GazeOverlay
from foveacam_server.runtime.pan_tilt import PanTiltService
from foveacam_server.runtime.ports import SceneViewer
from foveacam_server.runtime.rail import RailService
from foveacam_server.runtime.recordings import RecordingService
from foveacam_server.runtime.references import ReferenceService
from foveacam_server.runtime.settle_time_service import SettleTimeService
from foveacam_server.runtime.stills import StillService
from foveacam_server.runtime.stop import StopSwitch
from foveacam_server.runtime.store import Store
from foveacam_server.runtime.stream import LiveStreams
from foveacam_server.runtime.trigger_tests import TriggerTests
from foveacam_server.settings import Settings


@dataclass(slots=True, kw_only=True)
class Services:
    """The services of one running server."""

    settings: Settings
    boot_id: str
    """Changes at every start, so that a page detects a restart."""
    clock: Clock
    store: Store
    events: EventLog
    lease: Lease
    hub: FrameHub
    streams: LiveStreams
    hardware: HardwareThread
    cameras: CameraSettingsService
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
    overlay: GazeOverlay
    jobs: JobRunner
    clouds: CloudCollection
    captures: CaptureService
    recordings: RecordingService
    stills: StillService
    mosaics: MosaicService
    references: ReferenceService
    fixations: FixationService
    wide_depth: WideDepthService
    """Depth of the whole wide view; a `DepthContext` for fixations."""
    measurements: MeasurementService
    suggestions: SuggestionService
    viewer: SceneViewer | None
    """The 3D pane; None when it is switched off or could not be started."""


async def services(connection: HTTPConnection) -> Services:
    """Return the services that the lifespan opened; for requests and for WebSockets."""
    return cast(Services, connection.app.state.services)


ServicesDep = Annotated[Services, Depends(services)]
