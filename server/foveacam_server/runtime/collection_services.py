"""Opens the services of stored pictures: captures with mosaics and references, stills, recordings."""

from dataclasses import dataclass

from foveacam_server.capturing.capture_collection import CAPTURES
from foveacam_server.capturing.still_collection import STILLS
from foveacam_server.recordings.recording_collection import RECORDINGS
from foveacam_server.runtime.captures import CaptureService, CaptureTools
from foveacam_server.runtime.derived_products import DerivedProductTools
from foveacam_server.runtime.foundation import DisplayServices, RigKnowledge, ServerFoundation
from foveacam_server.runtime.hardware import HardwareThread
from foveacam_server.runtime.jobs import JobRunner
from foveacam_server.runtime.live_views import LiveRates
from foveacam_server.runtime.mosaics import MosaicService
from foveacam_server.runtime.recordings import RecordingService, RecordingTools
from foveacam_server.runtime.references import ReferenceService
from foveacam_server.runtime.stills import StillService
from foveacam_server.settings import Settings


@dataclass(frozen=True, slots=True, kw_only=True)
class CollectionServices:
    """One service a kind."""

    captures: CaptureService
    stills: StillService
    recordings: RecordingService
    mosaics: MosaicService
    references: ReferenceService


def open_collections(
    ground: ServerFoundation,
    lore: RigKnowledge,
    sights: DisplayServices,
    *,
    hardware: HardwareThread,
    jobs: JobRunner,
) -> CollectionServices:
    """Open all of them and register the handlers of their jobs."""
    tools = _capture_tools(ground, lore, sights, hardware=hardware, jobs=jobs)
    captures = CaptureService(ground.store.subfolder(CAPTURES), tools)
    making = DerivedProductTools(captures=captures, jobs=jobs, events=ground.events, clock=ground.clock)
    return CollectionServices(
        captures=captures,
        stills=StillService(ground.store.subfolder(STILLS), tools),
        recordings=_recordings(ground, lore, sights, hardware=hardware, jobs=jobs),
        mosaics=MosaicService(making, sights.viewer),
        references=ReferenceService(making),
    )


def live_rates(settings: Settings) -> LiveRates:
    """Return the rates of the live views."""
    return LiveRates(wide_hz=settings.live_wide_hz, fovea_hz=settings.live_fovea_hz)


def _capture_tools(
    ground: ServerFoundation,
    lore: RigKnowledge,
    sights: DisplayServices,
    *,
    hardware: HardwareThread,
    jobs: JobRunner,
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
    ground: ServerFoundation,
    lore: RigKnowledge,
    sights: DisplayServices,
    *,
    hardware: HardwareThread,
    jobs: JobRunner,
) -> RecordingService:
    tools = RecordingTools(
        hardware=hardware,
        calibration=lore.calibration,
        jobs=jobs,
        tap=sights.tap,
        hub=sights.hub,
        rates=live_rates(ground.settings),
        events=ground.events,
        clock=ground.clock,
    )
    recordings = RecordingService(ground.store.subfolder(RECORDINGS), tools)
    ground.stack.callback(recordings.close)
    return recordings
