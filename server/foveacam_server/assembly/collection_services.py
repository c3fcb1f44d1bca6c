"""Opens the services of stored pictures: captures with mosaics and references, stills, recordings."""

from dataclasses import dataclass

from foveacam_server.assembly.first_services import DisplayServices, RigKnowledge, ServerFoundation
from foveacam_server.datasets.capture_tools import CaptureTools
from foveacam_server.datasets.collection import CAPTURES
from foveacam_server.datasets.derived_products import DerivedProductTools
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.settings import Settings
from foveacam_server.resources.batches.service import BatchService
from foveacam_server.resources.captures.service import CaptureService
from foveacam_server.resources.depth_backends.service import DepthBackendService
from foveacam_server.resources.mosaics.service import MosaicService
from foveacam_server.resources.recordings.collection import RECORDINGS
from foveacam_server.resources.recordings.service import RecordingService, RecordingTools
from foveacam_server.resources.references.service import ReferenceService
from foveacam_server.resources.stills.collection import STILLS
from foveacam_server.resources.stills.service import StillService
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.live_views import LiveRates


@dataclass(frozen=True, slots=True, kw_only=True)
class CollectionServices:
    """One service a kind."""

    captures: CaptureService
    stills: StillService
    recordings: RecordingService
    mosaics: MosaicService
    references: ReferenceService
    batches: BatchService


def open_collections(
    foundation: ServerFoundation,
    knowledge: RigKnowledge,
    displays: DisplayServices,
    *,
    hardware: HardwareThread,
    jobs: JobRunner,
    backends: DepthBackendService,
) -> CollectionServices:
    """Open all of them and register the handlers of their jobs."""
    tools = _capture_tools(foundation, knowledge, displays, hardware=hardware, jobs=jobs)
    captures = CaptureService(foundation.store.subfolder(CAPTURES), tools)
    making = DerivedProductTools(
        captures=captures, jobs=jobs, events=foundation.events, clock=foundation.clock
    )
    return CollectionServices(
        captures=captures,
        stills=StillService(foundation.store.subfolder(STILLS), tools),
        recordings=_recordings(
            foundation, knowledge, displays, hardware=hardware, jobs=jobs, backends=backends
        ),
        mosaics=MosaicService(making, displays.viewer, network_in_use=backends.network_in_use),
        references=ReferenceService(making),
        batches=BatchService(
            foundation.store.subfolder("batches"),
            making,
            cluster=foundation.settings.cluster,
            network_in_use=backends.network_in_use,
        ),
    )


def live_rates(settings: Settings) -> LiveRates:
    """Return the rates of the live views."""
    return LiveRates(wide_hz=settings.live_wide_hz, fovea_hz=settings.live_fovea_hz)


def _capture_tools(
    foundation: ServerFoundation,
    knowledge: RigKnowledge,
    displays: DisplayServices,
    *,
    hardware: HardwareThread,
    jobs: JobRunner,
) -> CaptureTools:
    return CaptureTools(
        hardware=hardware,
        calibration=knowledge.calibration,
        jobs=jobs,
        sink=displays.tap,
        overlay=displays.overlay.of,
        distance_m=lambda: displays.overlay.distance_m,
        events=foundation.events,
        clock=foundation.clock,
    )


def _recordings(
    foundation: ServerFoundation,
    knowledge: RigKnowledge,
    displays: DisplayServices,
    *,
    hardware: HardwareThread,
    jobs: JobRunner,
    backends: DepthBackendService,
) -> RecordingService:
    tools = RecordingTools(
        hardware=hardware,
        calibration=knowledge.calibration,
        jobs=jobs,
        tap=displays.tap,
        hub=displays.hub,
        rates=live_rates(foundation.settings),
        backends=backends,
        events=foundation.events,
        clock=foundation.clock,
        folders=foundation.settings.recording_folders,
    )
    recordings = RecordingService(foundation.store.subfolder(RECORDINGS), tools)
    foundation.stack.callback(recordings.close)
    return recordings
