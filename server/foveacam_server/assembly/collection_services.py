"""Opens the services of stored pictures: captures with their products, stills, recordings."""

from dataclasses import dataclass

from foveacam_hardware.contract import Busy
from foveacam_pipeline.capture.dataset.lock import is_being_written
from foveacam_pipeline.verge.surroundings.depth_samples import DepthContext
from foveacam_server.assembly.archive_sources import (
    CaptureArchiveSource,
    RecordingArchiveSource,
    StillArchiveSource,
)
from foveacam_server.assembly.first_services import SharedServices, live_rates
from foveacam_server.datasets.capture_tools import CaptureTools
from foveacam_server.datasets.collection import CAPTURES
from foveacam_server.datasets.derived_products import DerivedProductTools
from foveacam_server.resources.capturing.archive.service import ArchiveService
from foveacam_server.resources.capturing.batches.service import BatchService
from foveacam_server.resources.capturing.captures.service import CaptureService
from foveacam_server.resources.capturing.exports.service import ExportService
from foveacam_server.resources.capturing.mosaics.service import MosaicService
from foveacam_server.resources.capturing.recordings.collection import RECORDINGS
from foveacam_server.resources.capturing.recordings.service import RecordingService, RecordingTools
from foveacam_server.resources.capturing.references.service import ReferenceService
from foveacam_server.resources.capturing.retention.rules import RetentionSource, Sources
from foveacam_server.resources.capturing.retention.service import RetentionService
from foveacam_server.resources.capturing.stills.collection import STILLS
from foveacam_server.resources.capturing.stills.service import StillService
from foveacam_server.resources.looking.depth_backends.service import DepthBackendService


@dataclass(frozen=True, slots=True, kw_only=True)
class CollectionServices:
    """The services of stored pictures, one per kind."""

    captures: CaptureService
    stills: StillService
    recordings: RecordingService
    mosaics: MosaicService
    references: ReferenceService
    exports: ExportService
    archive: ArchiveService
    batches: BatchService


def open_collections(
    shared: SharedServices, *, backends: DepthBackendService, context: DepthContext
) -> CollectionServices:
    """Open all of them and register the handlers of their jobs."""
    tools = _capture_tools(shared, context)
    captures = CaptureService(shared.foundation.store.subfolder(CAPTURES), tools)
    making = DerivedProductTools(
        captures=captures, jobs=shared.jobs, events=shared.foundation.events, clock=shared.foundation.clock
    )
    recordings = _recordings(shared, backends=backends)
    stills = StillService(shared.foundation.store.subfolder(STILLS), tools)
    return CollectionServices(
        captures=captures,
        stills=stills,
        recordings=recordings,
        mosaics=MosaicService(making, shared.displays.viewer, network_in_use=backends.network_in_use),
        references=ReferenceService(making),
        exports=ExportService(making),
        archive=ArchiveService(
            shared.foundation.settings.archive,
            {
                "captures": CaptureArchiveSource(captures),
                "recordings": RecordingArchiveSource(recordings),
                "stills": StillArchiveSource(stills),
            },
            shared.jobs,
        ),
        batches=BatchService(
            shared.foundation.store.subfolder("batches"),
            making,
            cluster=shared.foundation.settings.cluster,
            network_in_use=backends.network_in_use,
        ),
    )


def open_retention(
    shared: SharedServices, collections: CollectionServices, *, looks: Sources
) -> RetentionService:
    """Open the rules of retention over all collections, and over `looks`."""
    captures, recordings, stills = collections.captures, collections.recordings, collections.stills

    def capture_in_use(capture_id: str) -> bool:
        try:
            for products in (collections.mosaics, collections.references, collections.exports):
                products.check_idle(capture_id, "remove its capture")
        except Busy:
            return True
        return captures.is_running(capture_id) or is_being_written(captures.collection.get(capture_id).folder)

    retention = RetentionService(
        shared.foundation.settings.data,
        {
            "captures": RetentionSource(every=captures.search, in_use=capture_in_use, remove=captures.remove),
            "recordings": RetentionSource(
                every=recordings.search, in_use=recordings.is_in_use, remove=recordings.remove
            ),
            "stills": RetentionSource(
                every=stills.search,
                in_use=lambda still_id: is_being_written(stills.collection.get(still_id).stored.folder),
                remove=stills.remove,
            ),
            "exports": RetentionSource(
                every=collections.exports.collection.every,
                in_use=collections.exports.is_in_use,
                remove=collections.exports.collection.remove_by_id,
                for_good=True,
            ),
            **looks,
        },
    )
    retention.start()
    shared.foundation.stack.callback(retention.close)
    return retention


def _capture_tools(shared: SharedServices, context: DepthContext) -> CaptureTools:
    return CaptureTools(
        hardware=shared.hardware,
        calibration=shared.knowledge.calibration,
        jobs=shared.jobs,
        sink=shared.displays.tap,
        overlay=shared.displays.overlay.of,
        distance_m=lambda: shared.displays.overlay.distance_m,
        context=context,
        events=shared.foundation.events,
        clock=shared.foundation.clock,
    )


def _recordings(shared: SharedServices, *, backends: DepthBackendService) -> RecordingService:
    tools = RecordingTools(
        hardware=shared.hardware,
        calibration=shared.knowledge.calibration,
        jobs=shared.jobs,
        tap=shared.displays.tap,
        hub=shared.displays.hub,
        rates=live_rates(shared.foundation.settings),
        backends=backends,
        events=shared.foundation.events,
        clock=shared.foundation.clock,
        folders=shared.foundation.settings.recording_folders,
    )
    recordings = RecordingService(shared.foundation.store.subfolder(RECORDINGS), tools)
    shared.foundation.stack.callback(recordings.close)
    return recordings
