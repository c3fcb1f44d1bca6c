"""Opens what keeps the foveae on targets: following, its rounds, and the vergence loop."""

from foveacam_server.assembly.first_services import DisplayServices, RigKnowledge, ServerFoundation
from foveacam_server.datasets.collection import CaptureCollection
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.resources.fixations.service import FixationService
from foveacam_server.resources.follows.follow_job import FollowTools
from foveacam_server.resources.follows.rounds import FollowRounds, RoundTools
from foveacam_server.resources.follows.service import FollowService
from foveacam_server.resources.loop.service import LoopService, LoopTools
from foveacam_server.resources.wide_depth.service import WideDepthService
from foveacam_server.rig.hardware import HardwareThread


def open_following(
    foundation: ServerFoundation,
    knowledge: RigKnowledge,
    displays: DisplayServices,
    *,
    hardware: HardwareThread,
    jobs: JobRunner,
    fixations: FixationService,
    context: WideDepthService,
    captures: CaptureCollection,
) -> tuple[FollowService, FollowRounds, LoopService]:
    """Open what follows targets, one or many, and let the wide view mark them."""
    follows = FollowService(
        FollowTools(
            hardware=hardware,
            calibration=knowledge.calibration,
            jobs=jobs,
            events=foundation.events,
            clock=foundation.clock,
            targets=fixations.targets,
            context=context,
            viewer=displays.viewer,
            on_distance=displays.overlay.look_at_distance,
            looping=lambda: vergence.running,
        )
    )
    vergence = LoopService(
        LoopTools(
            hardware=hardware,
            calibration=knowledge.calibration,
            jobs=jobs,
            events=foundation.events,
            clock=foundation.clock,
            context=context,
            folder=foundation.store.subfolder("loop"),
            following=lambda: follows.following,
            on_distance=displays.overlay.look_at_distance,
        )
    )
    displays.overlay.show_follows(lambda: [*follows.marks(), *vergence.marks()])
    displays.tap.boxes_from(lambda frame: [*follows.boxes(frame), *vergence.boxes(frame)])
    rounds = FollowRounds(
        RoundTools(
            take=follows.take_round,
            collection=captures,
            hardware=hardware,
            calibration=knowledge.calibration,
            jobs=jobs,
            events=foundation.events,
        )
    )
    return follows, rounds, vergence
