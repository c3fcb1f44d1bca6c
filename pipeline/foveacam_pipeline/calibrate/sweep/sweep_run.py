"""Stage 2, the measurement: sweep the target over the field and store each pose of all three cameras.

The base turns the rig, the wide camera locates the markers, each eye centres its own. An interrupted sweep
continues from its file; poses at which an eye was refused are tried again. Because mounts drift, the middle
of the field is measured repeatedly.
"""

import logging
import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import (
    Clock,
    FoveaError,
    Head,
    InvalidInput,
    OutOfRange,
    PanTilt,
    Role,
    Station,
    StationTarget,
)
from foveacam_pipeline.calibrate.sweep.base_turn import HandTurnedBase, StationBase
from foveacam_pipeline.calibrate.sweep.centring import BEYOND
from foveacam_pipeline.calibrate.sweep.eye_prediction import degrees
from foveacam_pipeline.calibrate.sweep.marker_target import TargetPose
from foveacam_pipeline.calibrate.sweep.sweep import Sweep, SweepHeader, SweepPose, sweep_filename
from foveacam_pipeline.calibrate.sweep.sweep_checks import EYES
from foveacam_pipeline.calibrate.sweep.sweep_course import SweepCourse
from foveacam_pipeline.calibrate.sweep.sweep_file import append_pose, load_sweep, save_sweep
from foveacam_pipeline.calibrate.sweep.sweep_opening import check_volts, probe_mirrors
from foveacam_pipeline.calibrate.sweep.sweep_plan import SweepPlan, check_reach
from foveacam_pipeline.calibrate.sweep.sweep_pose import PoseMeter
from foveacam_pipeline.calibrate.sweep.sweep_reference import ReferenceVisits
from foveacam_pipeline.calibrate.sweep.sweep_settings import SweepSettings
from foveacam_pipeline.calibrate.watcher import ProcedureWatcher, raise_if_cancelled
from foveacam_pipeline.models.intrinsics import Intrinsics

AHEAD = np.zeros(2)
HALF_SIDE = 0.6
"""Half the size of a marker with some of its white margin, over its side."""

logger = logging.getLogger(__name__)


def run_sweep(
    head: Head,
    pan_tilt: PanTilt,
    station: Station,
    wide: Intrinsics,
    *,
    plan: SweepPlan,
    clock: Clock,
    watch: ProcedureWatcher,
    folder: Path,
    settings: SweepSettings,
) -> Sweep:
    """Sweep one station and return everything measured there, in this run and before it.

    Raise Cancelled when the watcher has cancelled, and InvalidInput, OutOfRange or DeviceFault: for a plan
    that rig or pan-tilt cannot reach, swapped markers, a dead axis, an eye that is refused pose after pose.
    The measurements are in the sweep's file in `folder` in any case.
    """
    check_plan(plan, station, wide, settings)
    if pan_tilt.moves_itself:
        check_reach(plan, station.pose, pan_tilt.limits)
    path = folder / sweep_filename(station)
    known = load_sweep(path) if path.exists() else None
    base = StationBase(pan_tilt, station, clock=clock, watch=watch, settings=settings.turning)
    meter = PoseMeter(head, wide, station, clock=clock, watch=watch, settings=settings)
    course = SweepCourse(
        base.turn_to, meter, wide, wide_id=settings.layout.wide_id, approach_rad=settings.approach_rad
    )
    run = _SweepRun(
        base=base, meter=meter, course=course, plan=plan, watch=watch, settings=settings, path=path
    )
    if known is not None:  # before anything moves
        sizes = known.header.wide_size, known.header.fovea_size
        check_same_sweep(known.header, run.header(station, *sizes), path)
    by_hand = HandTurnedBase(
        head=head,
        clock=clock,
        watch=watch,
        wide=wide,
        layout=settings.layout,
        settings=settings.turning,
        correct=base.correct,
    )
    try:
        base.prepare()
        sweep = run.open_sweep(station, known, by_hand)
        return run.measure_missing(sweep, by_hand)
    finally:
        base.hold()


def check_plan(plan: SweepPlan, station: Station, wide: Intrinsics, settings: SweepSettings) -> None:
    """Raise InvalidInput for a station without markers, or a pose at which they leave the wide view."""
    if station.target is not StationTarget.MARKERS:
        raise InvalidInput(
            f"station {station.name!r} shows a {station.target}: a sweep needs one of markers; choose one"
        )
    layout = settings.layout
    near_m = station.distance_m or math.inf
    half_m = HALF_SIDE * layout.side_m
    across = plan.half_width_rad + math.atan((layout.spacing_m + half_m) / near_m)
    down = plan.half_height_rad + math.atan(half_m / near_m)
    corners = np.array([[x, y] for x in (-across, across) for y in (-down, down)])
    for (ax_rad, ay_rad), (x_px, y_px) in zip(corners, wide.pixels(corners), strict=True):
        if not wide.contains(float(x_px), float(y_px)):
            raise InvalidInput(
                f"sweep of ±{degrees(plan.half_width_rad)} x ±{degrees(plan.half_height_rad)}: at the gaze "
                f"({degrees(ax_rad)}, {degrees(ay_rad)}) the markers leave the wide view; choose a smaller "
                "sweep, or set the target up farther away"
            )


@dataclass(slots=True, kw_only=True)
class _SweepRun:
    """One run of a sweep."""

    base: StationBase
    meter: PoseMeter
    plan: SweepPlan
    watch: ProcedureWatcher
    settings: SweepSettings
    path: Path
    course: SweepCourse
    _target: TargetPose = field(init=False)

    def open_sweep(self, station: Station, known: Sweep | None, by_hand: HandTurnedBase) -> Sweep:
        """Look straight ahead, test the mirrors, and return the sweep to continue."""
        total = self.plan.columns * self.plan.rows
        done = total - len(_missing(known, range(total)))
        self.watch.progress(done, total=total, note="looking straight ahead, trying both mirrors")
        if self.base.by_hand:
            self.base.request(AHEAD)
            by_hand.wait_for(AHEAD[None], done=done, total=total)
        else:
            self.base.turn_to(AHEAD)
        at_rest = probe_mirrors(self.meter, self.settings)
        self._target = self.meter.locate(at_rest)
        check_volts(self.meter, self.plan, self.settings)
        fovea_size = self.meter.fovea_size
        if fovea_size is None:
            raise InvalidInput("sweep: no eye delivered a picture; check both cameras")
        header = self.header(station, at_rest.size, fovea_size)
        if known is None:
            save_sweep(Sweep(header=header), self.path)
            return Sweep(header=header)
        check_same_sweep(known.header, header, self.path)
        for pose in (*known.poses, *known.repeats):
            self.meter.learn(pose)
        return known

    def header(
        self, station: Station, wide_size: tuple[int, int], fovea_size: tuple[int, int]
    ) -> SweepHeader:
        """Return the header of this run's file; sizes are (width, height), px."""
        settings = self.settings
        return SweepHeader(
            rig_id=settings.rig_id,
            created_utc=settings.created_utc,
            station=station,
            layout=settings.layout,
            plan=self.plan,
            wide_size=wide_size,
            fovea_size=fovea_size,
            max_v=settings.max_v,
            wide_serial=settings.wide_serial,
            left_serial=settings.left_serial,
            right_serial=settings.right_serial,
        )

    def measure_missing(self, sweep: Sweep, by_hand: HandTurnedBase) -> Sweep:
        """Measure the poses that are missing or were refused, and return the sweep."""
        nodes = self.plan.nodes_rad()
        poses = {pose.index: pose for pose in sweep.poses}
        to_do = _missing(sweep, self.plan.outward_order() if self.base.by_hand else range(len(nodes)))
        limit, begun = SingleEyeLimit(sweep, self.settings), len(to_do)
        references = self._references(sweep)
        if to_do:
            references.visit_when_due(0, last=False)
        while to_do:
            raise_if_cancelled(self.watch, doing="the sweep")
            pose = replace(self._measure_next(nodes, to_do, by_hand), run=self.settings.run)
            if pose.index not in poses or pose.eyes_measured >= poses[pose.index].eyes_measured:
                append_pose(self.path, pose)
                poses[pose.index] = pose
            self.watch.progress(len(nodes) - len(to_do), total=len(nodes), note=_pose_note(pose, len(nodes)))
            limit.check(pose)
            references.visit_when_due(begun - len(to_do), last=not to_do)
        return replace(references.known, poses=tuple(poses[k] for k in sorted(poses)))

    def _references(self, sweep: Sweep) -> ReferenceVisits:
        """Return the visits to the middle; there are none for a rig turned by hand."""
        every = 0 if self.base.by_hand else self.settings.reference_rows * self.plan.columns
        return ReferenceVisits(
            course=self.course,
            plan=self.plan,
            target=self._target,
            path=self.path,
            every=every,
            run=self.settings.run,
            known=sweep,
        )

    def _measure_next(
        self, nodes: NDArray[np.float64], to_do: list[int], by_hand: HandTurnedBase
    ) -> SweepPose:
        """Measure one of the poses of `to_do` and remove it from the list."""
        if not self.base.by_hand:
            index = to_do.pop(0)
            return self.course.measure(index, nodes[index], self._target)
        gazes = np.array([self.meter.reachable_gaze(nodes[k], self._target) for k in to_do])
        self.base.request(gazes[0])
        done = len(nodes) - len(to_do)
        index = to_do.pop(by_hand.wait_for(gazes, done=done, total=len(nodes)))
        return self.meter.measure(index, (float(nodes[index][0]), float(nodes[index][1])), None)


def check_same_sweep(known: SweepHeader, now: SweepHeader, path: Path) -> None:
    """Raise InvalidInput naming a difference between the sweep on file and the one that continues it."""
    for name in ("rig_id", "station", "layout", "plan", "wide_size", "fovea_size", "max_v"):
        before, wanted = getattr(known, name), getattr(now, name)
        if before != wanted:
            raise InvalidInput(
                f"sweep {path.name} of {path.parent.name}: it was begun with {name.replace('_', ' ')} "
                f"{before}, now it is {wanted}; go on with the same, or begin anew in another session"
            )
    for name in ("wide_serial", "left_serial", "right_serial"):
        before, wanted = getattr(known, name), getattr(now, name)
        if before and wanted and before != wanted:
            raise InvalidInput(
                f"sweep {path}: it was begun with camera {before}, now {wanted} is there ({name[:-7]}); "
                "connect that camera, or begin anew in another session"
            )


def _missing(sweep: Sweep | None, order: Iterable[int]) -> list[int]:
    """Return the nodes of `order` that are not measured yet, or were refused for an eye."""
    whole = {pose.index for pose in sweep.poses if pose.eyes_measured == len(EYES)} if sweep else set()
    return [index for index in order if index not in whole]


def _pose_note(pose: SweepPose, total: int) -> str:
    parts = []
    for role in EYES:
        eye = pose.eye(role)
        if eye is None:
            parts.append(f"{role} refused: {pose.refusal(role)}")
        else:
            parts.append(f"{role} {'at the rim' if eye.rim else 'centred'} in {eye.looks}")
    ax_rad, ay_rad = pose.node_rad
    return f"pose {pose.index + 1} of {total} at ({degrees(ax_rad)}, {degrees(ay_rad)}): {'; '.join(parts)}"


class SingleEyeLimit:
    """Ends a sweep in which one eye is refused again and again, with the reason.

    The limit is low for an eye that was never measured. It is two rows of poses for one that was, or is only
    beyond its volts, because the rim of the field may be out of its reach.
    """

    def __init__(self, sweep: Sweep, settings: SweepSettings) -> None:
        self._accepted = {role: len(sweep.accepted(role)) for role in EYES}
        self._refused = dict.fromkeys(EYES, 0)
        self._few = settings.give_up_after
        self._many = max(settings.give_up_after, 2 * sweep.header.plan.columns)

    def check(self, pose: SweepPose) -> None:
        """Raise InvalidInput or OutOfRange when an eye was refused too often."""
        for role in EYES:
            reason = pose.refusal(role)
            if reason is None:
                self._accepted[role] += 1
                self._refused[role] = 0
                continue
            self._refused[role] += 1
            at_the_rim = reason.startswith(BEYOND)
            if self._refused[role] >= (self._many if self._accepted[role] or at_the_rim else self._few):
                raise _end_error(role, self._refused[role], reason)


def _end_error(role: Role, times: int, reason: str) -> FoveaError:
    message = (
        f"sweep ended: the {role} eye was refused at {times} poses in a row, the last time because {reason}"
    )
    return OutOfRange(message) if reason.startswith(BEYOND) else InvalidInput(message)
