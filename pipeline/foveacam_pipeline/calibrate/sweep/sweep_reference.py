"""Further visits to nodes of a sweep, from which the drift of the eyes' mounts is fitted.

The middle of the field is measured before, during and after the sweep of a station; after the last station
the rig returns to some nodes of the first one.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from foveacam_hardware.contract import Clock, Head, InvalidInput, PanTilt, Station
from foveacam_pipeline.calibrate.sweep.base_turn import HandTurnedBase, StationBase
from foveacam_pipeline.calibrate.sweep.marker_target import TargetPose, locate_target
from foveacam_pipeline.calibrate.sweep.sweep import Sweep, SweepPose, sweep_filename
from foveacam_pipeline.calibrate.sweep.sweep_course import SweepCourse
from foveacam_pipeline.calibrate.sweep.sweep_file import append_pose, load_sweep
from foveacam_pipeline.calibrate.sweep.sweep_plan import SweepPlan
from foveacam_pipeline.calibrate.sweep.sweep_pose import PoseMeter
from foveacam_pipeline.calibrate.sweep.sweep_settings import SweepSettings
from foveacam_pipeline.calibrate.watcher import ProcedureWatcher, raise_if_cancelled
from foveacam_pipeline.models.intrinsics import Intrinsics

OUTER_SHARE = 0.7
"""Position of the outer revisited nodes, as a share of the way from the middle to a corner of the field."""
CROSS = np.array([(0.0, 0.0), (-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])

RETURN_NOTE = "back to nodes of the first station: the drift"

logger = logging.getLogger(__name__)


def middle_node(plan: SweepPlan) -> int:
    """Return the index of the node nearest to the middle of the field."""
    return int(np.argmin(np.linalg.norm(plan.nodes_rad(), axis=1)))


def nodes_to_return_to(sweep: Sweep) -> list[int]:
    """Return the indices of about five nodes, in the middle and further out, that both eyes have centred."""
    known = [pose for pose in sweep.poses if all(eye and eye.centred for eye in (pose.left, pose.right))]
    if not known:
        return []
    plan = sweep.header.plan
    wanted = OUTER_SHARE * CROSS * np.array([plan.half_width_rad, plan.half_height_rad])
    nodes = np.array([pose.node_rad for pose in known])
    nearest = [int(np.argmin(np.linalg.norm(nodes - place, axis=1))) for place in wanted]
    return list(dict.fromkeys(known[k].index for k in nearest))


def has_returned(sweeps: Sequence[Sweep]) -> bool:
    """Return whether the rig has returned to the outer nodes in the last run of these sweeps."""
    last = max((pose.run for sweep in sweeps for pose in (*sweep.poses, *sweep.repeats)), default="")
    for sweep in sweeps:
        middle = {middle_node(sweep.header.plan)}
        again = {pose.index for pose in sweep.repeats if pose.run == last} - middle
        if again and again >= set(nodes_to_return_to(sweep)) - middle:
            return True
    return False


@dataclass(slots=True, kw_only=True)
class ReferenceVisits:
    """Visits to the middle of the field during the sweep of one station.

    `every`: poses from one visit to the next, 0: no visits.
    """

    course: SweepCourse
    plan: SweepPlan
    target: TargetPose
    path: Path
    every: int
    run: str
    known: Sweep
    _since: int = 0

    def visit_when_due(self, measured: int, *, last: bool) -> None:
        """Measure the middle at the beginning, after every `every` poses, and after the last pose."""
        if self.every == 0 or not (measured == 0 or last or measured - self._since >= self.every):
            return
        self._since = measured
        index = middle_node(self.plan)
        pose = self.course.measure(index, self.plan.nodes_rad()[index], self.target)
        self.known = add_visit(self.known, pose, run=self.run, path=self.path)


def add_visit(sweep: Sweep, pose: SweepPose, *, run: str, path: Path) -> Sweep:
    """Append a visit to the file, unless both eyes were refused, and return the sweep with it."""
    if pose.eyes_measured == 0:
        logger.info("visit to node %d: %s; %s", pose.index, pose.left_refusal, pose.right_refusal)
        return sweep
    again = replace(pose, repeat=sweep.next_repeat(pose.index), run=run)
    append_pose(path, again)
    return replace(sweep, repeats=(*sweep.repeats, again))


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeReturn:
    """Turns the rig back to nodes of an earlier sweep, by pan-tilt or by hand, and measures them again."""

    base: StationBase
    by_hand: HandTurnedBase
    meter: PoseMeter
    course: SweepCourse
    wide: Intrinsics
    distance_m: float | None
    settings: SweepSettings

    def measure(self, pose: SweepPose, *, done: int, total: int) -> SweepPose:
        """Measure the node of a pose again; `done` of `total` nodes have been."""
        node = np.array(pose.node_rad)
        if self.base.by_hand:
            self.base.request(node)
            self.by_hand.wait_for(node[None], done=done, total=total)
            return self.meter.measure(pose.index, pose.node_rad, None)
        target = locate_target(pose.wide, self.settings.layout, self.wide, distance_m=self.distance_m)
        return self.course.measure(pose.index, node, target)


def return_to_nodes(
    head: Head,
    pan_tilt: PanTilt,
    station: Station,
    wide: Intrinsics,
    *,
    clock: Clock,
    watch: ProcedureWatcher,
    folder: Path,
    settings: SweepSettings,
) -> tuple[SweepPose, ...]:
    """Measure about five nodes of a station that was swept again, and return these visits.

    The visits are added to the sweep's file. Raise InvalidInput where there is no sweep, or it is of another
    station, Cancelled when the watcher has cancelled, and the errors of the devices.
    """
    path = folder / sweep_filename(station)
    sweep = load_sweep(path)
    if sweep.header.station != station:
        raise InvalidInput(
            f"sweep {path}: it was made at {sweep.header.station}, the rig's station is {station} now; "
            "begin anew in another session"
        )
    base = StationBase(pan_tilt, station, clock=clock, watch=watch, settings=settings.turning)
    returning = _node_return(head, base, sweep, wide, clock=clock, watch=watch, settings=settings)
    indices, before = nodes_to_return_to(sweep), len(sweep.repeats)
    try:
        base.prepare()
        for done, index in enumerate(indices):
            raise_if_cancelled(watch, doing="the sweep")
            watch.progress(done, total=len(indices), note=RETURN_NOTE)
            pose = next(pose for pose in sweep.poses if pose.index == index)
            again = returning.measure(pose, done=done, total=len(indices))
            sweep = add_visit(sweep, again, run=settings.run, path=path)
        watch.progress(len(indices), total=len(indices), note=RETURN_NOTE)
        return sweep.repeats[before:]
    finally:
        base.hold()


def _node_return(
    head: Head,
    base: StationBase,
    sweep: Sweep,
    wide: Intrinsics,
    *,
    clock: Clock,
    watch: ProcedureWatcher,
    settings: SweepSettings,
) -> NodeReturn:
    station = sweep.header.station
    meter = PoseMeter(head, wide, station, clock=clock, watch=watch, settings=settings)
    meter.fovea_size = sweep.header.fovea_size
    for pose in sweep.poses:
        meter.learn(pose)
    return NodeReturn(
        base=base,
        by_hand=HandTurnedBase(
            head=head,
            clock=clock,
            watch=watch,
            wide=wide,
            layout=settings.layout,
            settings=settings.turning,
            correct=base.correct,
        ),
        meter=meter,
        course=SweepCourse(
            base.turn_to, meter, wide, wide_id=settings.layout.wide_id, approach_rad=settings.approach_rad
        ),
        wide=wide,
        distance_m=station.distance_m,
        settings=settings,
    )
