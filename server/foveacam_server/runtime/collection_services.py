"""Opens what the rig's pictures are collected in: captures with what is made of them, stills, recordings."""

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
    """One door to each kind."""

    captures: CaptureService
    stills: StillService
    recordings: RecordingService
    mosaics: MosaicService
    references: ReferenceService


def open_collected(
    ground: ServerFoundation,
    lore: RigKnowledge,
    sights: DisplayServices,
    *,
    hardware: HardwareThread,
    jobs: JobRunner,
) -> CollectionServices:
    """Open all of them; their jobs have handlers then."""
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
    """Return how often views are taken while nothing else is asked of the rig."""
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
