"""Opens what keeps the foveae on targets: following, its rounds, and the vergence loop."""

from foveacam_server.assembly.first_services import SharedServices
from foveacam_server.datasets.collection import CaptureCollection
from foveacam_server.resources.fixations.service import FixationService
from foveacam_server.resources.follows.follow_job import FollowTools
from foveacam_server.resources.follows.rounds import FollowRounds, RoundTools
from foveacam_server.resources.follows.service import FollowService
from foveacam_server.resources.loop.service import LoopService, LoopTools
from foveacam_server.resources.wide_depth.service import WideDepthService


def open_following(
    shared: SharedServices,
    *,
    fixations: FixationService,
    context: WideDepthService,
    captures: CaptureCollection,
) -> tuple[FollowService, FollowRounds, LoopService]:
    """Open what follows targets, one or many, and let the wide view mark them."""
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
