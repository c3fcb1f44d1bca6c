"""All services of a running server, which the lifespan opens and the routes get as a dependency."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Annotated, cast

from fastapi import Depends
from starlette.requests import HTTPConnection

from foveacam_hardware.contract import Clock
from foveacam_server.foundation.compute_queue import ComputeQueue
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.lease import Lease
from foveacam_server.foundation.settings import Settings
from foveacam_server.foundation.store import Store
from foveacam_server.resources.calibration_sessions.service import CalibrationSessionService
from foveacam_server.resources.calibrations.records import CalibrationRecords
from foveacam_server.resources.calibrations.service import CalibrationService
from foveacam_server.resources.cameras.service import CameraSettingsService
from foveacam_server.resources.cameras.trigger_tests import TriggerTests
from foveacam_server.resources.captures.service import CaptureService
from foveacam_server.resources.clouds.collection import CloudCollection
from foveacam_server.resources.drift_checks.service import DriftChecks
from foveacam_server.resources.fixations.service import FixationService
from foveacam_server.resources.measurements.service import MeasurementService
from foveacam_server.resources.mosaics.service import MosaicService
from foveacam_server.resources.positioners.pan_tilt import PanTiltService
from foveacam_server.resources.positioners.rail import RailService
from foveacam_server.resources.recordings.service import RecordingService
from foveacam_server.resources.references.service import ReferenceService
from foveacam_server.resources.settle_time.service import SettleTimeService
from foveacam_server.resources.stills.service import StillService
from foveacam_server.resources.suggestions.service import SuggestionService
from foveacam_server.resources.views.overlay import GazeOverlay
from foveacam_server.resources.wide_depth.service import WideDepthService
from foveacam_server.rig.frame_hub import FrameHub
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.ports import SceneViewer
from foveacam_server.rig.stop import StopSwitch
from foveacam_server.rig.stream import LiveStreams


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
