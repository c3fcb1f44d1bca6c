"""Where the wide view shows the loop's target: for the live overlay, and for recordings."""

from foveacam_hardware.contract import Frame, Role
from foveacam_pipeline.capture.recording.values import STREAM_OF_ROLE, TrackedBox
from foveacam_server.resources.loop.documents import describe_target
from foveacam_server.resources.loop.loop_run import LoopRun
from foveacam_server.resources.loop.schema import LoopStatusName
from foveacam_server.rig.schema import FollowMark

NAME = "Loop"
SEEN: frozenset[LoopStatusName] = frozenset({"tracking", "held", "frozen", "auto_tune"})


def marks_of(run: LoopRun, t_ns: int) -> list[FollowMark]:
    """Return the mark of the target; empty before one was chosen."""
    target = describe_target(run.loop, t_ns)
    if target is None:
        return []
    state = "followed" if run.status in SEEN else "lost"
    return [FollowMark(id="loop", label=NAME, state=state, x_px=target.x_px, y_px=target.y_px)]


def boxes_of(run: LoopRun, frame: Frame) -> list[TrackedBox]:
    """Return the box of a tracked target in a wide frame, without a place where it is lost."""
    target = describe_target(run.loop, frame.t_ns)
    if target is None or target.state == "fixed":
        return []
    width, height = run.loop.settings.box_width_px, run.loop.settings.box_height_px
    box = (target.x_px - width / 2.0, target.y_px - height / 2.0, float(width), float(height))
    return [
        TrackedBox(
            slot=NAME,
            t_ns=frame.t_ns,
            bbox_px=box if target.state == "tracked" else None,
            frames={STREAM_OF_ROLE[Role.WIDE]: frame.seq},
        )
    ]
