"""Opens the services of fixations, clouds, wide depth and measurements, and of following targets."""

from dataclasses import dataclass

from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.values import Fixation
from foveacam_server.assembly.first_services import SharedServices
from foveacam_server.datasets.collection import DatasetCollection
from foveacam_server.resources.capturing.retention.rules import Sources, look_sources
from foveacam_server.resources.looking.clouds.collection import CLOUDS, CloudCollection
from foveacam_server.resources.looking.clouds.shapes import ShapeWorker
from foveacam_server.resources.looking.depth_backends.service import DepthBackendService
from foveacam_server.resources.looking.fixations.retained import RetainedLooks
from foveacam_server.resources.looking.fixations.service import FixationService, FixationTools
from foveacam_server.resources.looking.follows.follow_job import FollowTools
from foveacam_server.resources.looking.follows.rounds import FollowRounds, RoundTools
from foveacam_server.resources.looking.follows.service import FollowService
from foveacam_server.resources.looking.loop.service import LoopService, LoopTools
from foveacam_server.resources.looking.measurements.point_finder import ShownViews
from foveacam_server.resources.looking.measurements.service import MeasurementService, MeasuringTools
from foveacam_server.resources.looking.wide_depth.context_keeper import ContextKeeper
from foveacam_server.resources.looking.wide_depth.service import WideDepthService, WideDepthTools


@dataclass(frozen=True, slots=True, kw_only=True)
class ObservationServices:
    """Services that turn looks into fixations, clouds, wide depth and measurements."""

    clouds: CloudCollection
    fixations: FixationService
    follows: FollowService
    rounds: FollowRounds
    loop: LoopService
    wide_depth: WideDepthService
    measurements: MeasurementService


def open_observation(
    shared: SharedServices,
    *,
    captures: DatasetCollection,
    matcher: DepthBackendService,
    wide_depth: WideDepthService,
) -> ObservationServices:
    """Open them, start their threads, and that of the jobs, as all handlers are registered by now."""
    clouds = CloudCollection(shared.foundation.store)
    shapes = ShapeWorker(
        clouds=clouds,
        matcher=matcher,
        sink=shared.displays.hub,
        viewer=shared.displays.viewer,
        events=shared.foundation.events,
    )
    tools = _fixation_tools(shared, clouds=clouds, shapes=shapes, wide_depth=wide_depth)
    fixations = FixationService(shared.foundation.store, tools)
    follows, rounds, vergence = _open_following(
        shared, fixations=fixations, context=wide_depth, captures=captures
    )
    shapes.put_back(fixations.stored_looks())
    for worker in (shapes, wide_depth, shared.jobs):
        worker.start()
        shared.foundation.stack.callback(worker.close)
    measurements = _open_measurements(shared, clouds)
    return ObservationServices(
        clouds=clouds,
        fixations=fixations,
        follows=follows,
        rounds=rounds,
        loop=vergence,
        wide_depth=wide_depth,
        measurements=measurements,
    )


def retained_looks(shared: SharedServices, observation: ObservationServices) -> Sources:
    """Return the retention sources of clouds and fixations, which are deleted for good."""
    clouds, fixations, viewer = observation.clouds, observation.fixations, shared.displays.viewer
    looks = RetainedLooks(shared.foundation.store, shared.foundation.store.subfolder(CLOUDS))

    def remove_cloud(cloud_id: str) -> None:
        cloud = clouds.remove(cloud_id)
        fixations.remove_cloud(cloud.fixation_id, left=clouds.of_fixation(cloud.fixation_id))
        if viewer is not None:
            viewer.remove_fixation(cloud.fixation_id)

    return look_sources(looks, remove_cloud=remove_cloud, remove_fixation=fixations.remove)


def _fixation_tools(
    shared: SharedServices, *, clouds: CloudCollection, shapes: ShapeWorker, wide_depth: WideDepthService
) -> FixationTools:
    def on_fixation(fixation: Fixation, calibration: Calibration) -> None:
        shared.knowledge.health.add(fixation, calibration)
        wide_depth.add(fixation, calibration)

    return FixationTools(
        hardware=shared.hardware,
        calibration=shared.knowledge.calibration,
        jobs=shared.jobs,
        shapes=shapes,
        patches=clouds.patches,
        events=shared.foundation.events,
        clock=shared.foundation.clock,
        on_distance=shared.displays.overlay.look_at_distance,
        on_fixation=on_fixation,
        context=wide_depth,
    )


def open_wide_depth(shared: SharedServices) -> WideDepthService:
    """Open the depth of the wide view; `open_observation` starts its thread."""
    keeper = ContextKeeper(
        shared.foundation.store.subfolder("wide_depth"),
        calibration=lambda: shared.knowledge.calibration.current,
        status=lambda: shared.hardware.status,
    )
    tools = WideDepthTools(
        hardware=shared.hardware,
        calibration=shared.knowledge.calibration.require,
        jobs=shared.jobs,
        hub=shared.displays.hub,
        viewer=shared.displays.viewer,
        events=shared.foundation.events,
        clock=shared.foundation.clock,
    )
    return WideDepthService(keeper, tools)


def _open_measurements(shared: SharedServices, clouds: CloudCollection) -> MeasurementService:
    def picture_t_ns(view: str) -> int | None:
        newest = shared.displays.hub.newest(view)
        return None if newest is None else newest.t_ns

    tools = MeasuringTools(
        clouds=clouds,
        wide=lambda: shared.knowledge.calibration.require().wide,
        shown=ShownViews(volts=lambda: shared.hardware.pose, picture_t_ns=picture_t_ns),
        events=shared.foundation.events,
        viewer=shared.displays.viewer,
    )
    measurements = MeasurementService(shared.foundation.store, tools)
    measurements.put_back()
    return measurements


def _open_following(
    shared: SharedServices,
    *,
    fixations: FixationService,
    context: WideDepthService,
    captures: DatasetCollection,
) -> tuple[FollowService, FollowRounds, LoopService]:
    """Open the services that follow one or several targets, and mark these in the wide view."""
    follows = FollowService(
        FollowTools(
            hardware=shared.hardware,
            calibration=shared.knowledge.calibration,
            jobs=shared.jobs,
            events=shared.foundation.events,
            clock=shared.foundation.clock,
            targets=fixations.targets,
            context=context,
            viewer=shared.displays.viewer,
            on_distance=shared.displays.overlay.look_at_distance,
            looping=lambda: vergence.running,
        )
    )
    vergence = LoopService(
        LoopTools(
            hardware=shared.hardware,
            calibration=shared.knowledge.calibration,
            jobs=shared.jobs,
            events=shared.foundation.events,
            clock=shared.foundation.clock,
            context=context,
            folder=shared.foundation.store.subfolder("loop"),
            following=lambda: follows.following,
            on_distance=shared.displays.overlay.look_at_distance,
        )
    )
    shared.displays.overlay.show_follows(lambda: [*follows.marks(), *vergence.marks()])
    shared.displays.tap.boxes_from(lambda frame: [*follows.boxes(frame), *vergence.boxes(frame)])
    rounds = FollowRounds(
        RoundTools(
            take=follows.take_round,
            collection=captures,
            hardware=shared.hardware,
            calibration=shared.knowledge.calibration,
            jobs=shared.jobs,
            events=shared.foundation.events,
        )
    )
    return follows, rounds, vergence
