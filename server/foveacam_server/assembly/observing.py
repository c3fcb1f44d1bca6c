"""Opens the services that turn looks into fixations, clouds, wide depth and measurements."""

from dataclasses import dataclass

from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.values import Fixation
from foveacam_server.assembly.first_services import (
    DisplayServices,
    RigKnowledge,
    ServerFoundation,
)
from foveacam_server.assembly.following import open_following
from foveacam_server.datasets.collection import CaptureCollection
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.resources.clouds.collection import CloudCollection
from foveacam_server.resources.clouds.shapes import ShapeWorker
from foveacam_server.resources.depth_backends.service import DepthBackendService
from foveacam_server.resources.fixations.service import FixationService, FixationTools
from foveacam_server.resources.follows.rounds import FollowRounds
from foveacam_server.resources.follows.service import FollowService
from foveacam_server.resources.loop.service import LoopService
from foveacam_server.resources.measurements.point_finder import ShownViews
from foveacam_server.resources.measurements.service import MeasurementService, MeasuringTools
from foveacam_server.resources.wide_depth.context_keeper import ContextKeeper
from foveacam_server.resources.wide_depth.service import WideDepthService, WideDepthTools
from foveacam_server.rig.hardware import HardwareThread


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
    foundation: ServerFoundation,
    knowledge: RigKnowledge,
    displays: DisplayServices,
    *,
    hardware: HardwareThread,
    jobs: JobRunner,
    captures: CaptureCollection,
    matcher: DepthBackendService,
) -> ObservationServices:
    """Open them and start their threads and that of the jobs, whose handlers are registered by now."""
    clouds = CloudCollection(foundation.store)
    wide_depth = _wide_depth(foundation, knowledge, displays, hardware=hardware, jobs=jobs)

    def on_fixation(fixation: Fixation, calibration: Calibration) -> None:
        knowledge.health.add(fixation, calibration)
        wide_depth.add(fixation, calibration)

    shapes = ShapeWorker(
        clouds=clouds,
        matcher=matcher,
        sink=displays.hub,
        viewer=displays.viewer,
        events=foundation.events,
    )
    tools = FixationTools(
        hardware=hardware,
        calibration=knowledge.calibration,
        jobs=jobs,
        shapes=shapes,
        patches=clouds.patches,
        events=foundation.events,
        clock=foundation.clock,
        on_distance=displays.overlay.look_at_distance,
        on_fixation=on_fixation,
        context=wide_depth,
    )
    fixations = FixationService(foundation.store, tools)
    follows, rounds, vergence = open_following(
        foundation,
        knowledge,
        displays,
        hardware=hardware,
        jobs=jobs,
        fixations=fixations,
        context=wide_depth,
        captures=captures,
    )
    shapes.put_back(fixations.stored_looks())
    for worker in (shapes, wide_depth, jobs):
        worker.start()
        foundation.stack.callback(worker.close)
    measurements = _open_measurements(foundation, knowledge, displays, hardware=hardware, clouds=clouds)
    return ObservationServices(
        clouds=clouds,
        fixations=fixations,
        follows=follows,
        rounds=rounds,
        loop=vergence,
        wide_depth=wide_depth,
        measurements=measurements,
    )


def _wide_depth(
    foundation: ServerFoundation,
    knowledge: RigKnowledge,
    displays: DisplayServices,
    *,
    hardware: HardwareThread,
    jobs: JobRunner,
) -> WideDepthService:
    keeper = ContextKeeper(
        foundation.store.subfolder("wide_depth"),
        calibration=lambda: knowledge.calibration.current,
        status=lambda: hardware.status,
    )
    tools = WideDepthTools(
        hardware=hardware,
        calibration=knowledge.calibration.require,
        jobs=jobs,
        hub=displays.hub,
        viewer=displays.viewer,
        events=foundation.events,
        clock=foundation.clock,
    )
    return WideDepthService(keeper, tools)


def _open_measurements(
    foundation: ServerFoundation,
    knowledge: RigKnowledge,
    displays: DisplayServices,
    *,
    hardware: HardwareThread,
    clouds: CloudCollection,
) -> MeasurementService:
    def picture_t_ns(view: str) -> int | None:
        newest = displays.hub.newest(view)
        return None if newest is None else newest.t_ns

    tools = MeasuringTools(
        clouds=clouds,
        wide=lambda: knowledge.calibration.require().wide,
        shown=ShownViews(volts=lambda: hardware.pose, picture_t_ns=picture_t_ns),
        events=foundation.events,
        viewer=displays.viewer,
    )
    measurements = MeasurementService(foundation.store, tools)
    measurements.put_back()
    return measurements
