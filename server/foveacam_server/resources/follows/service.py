"""Follows targets as a job: a thread of its own shares both foveae among them and gives way to other jobs."""

import threading
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Protocol

from foveacam_hardware.contract import (
    Busy,
    Clock,
    FoveaError,
    Frame,
    Head,
    InvalidInput,
)
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.track.follow import MOST_TARGETS, Follower, FollowStep
from foveacam_pipeline.track.image_tracker import TrackerKind
from foveacam_pipeline.track.round_writer import SeenTarget
from foveacam_pipeline.track.target import FollowedTarget, TargetReport
from foveacam_pipeline.verge.surroundings.depth_samples import DepthContext
from foveacam_pipeline.verge.values import Target
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.events import EventLevel, EventLog
from foveacam_server.foundation.jobs import JobContext, JobRunner
from foveacam_server.foundation.names import new_id
from foveacam_server.resources.fixations.request import check_target, target_of
from foveacam_server.resources.fixations.schema import FixationRequest, TargetDocument
from foveacam_server.resources.follows.first_look import catch_up, look_first, sides_px, track_click
from foveacam_server.resources.follows.followed import FollowedRecord, position_at, wide_place_px
from foveacam_server.resources.follows.schema import (
    FollowChanged,
    FollowedDocument,
    FollowEnded,
    FollowPatch,
    FollowRequest,
    TrailPoint,
)
from foveacam_server.rig import refusals
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.ports import CalibrationInForce
from foveacam_server.rig.schema import Direction, FollowMark

KIND = "following"
WAIT_S = 0.02
"""So often the rig is asked for again while another job has it."""
REPORT_PERIOD_NS = 2_000_000_000


class KnownTargets(Protocol):
    """Targets of earlier fixations."""

    def get(self, target_id: str) -> TargetDocument:
        """Return a target or raise `NotFound`."""
        ...


class TrailViewer(Protocol):
    """Draws where followed targets are and were."""

    def show_trail(self, target_id: str, label: str, points_rig_m: list[tuple[float, float, float]]) -> None:
        """Add or replace a trail, oldest point first, m, rig frame."""
        ...

    def remove_trail(self, target_id: str) -> None:
        """Remove a trail; no effect when there is none."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class FollowTools:
    """Services that following needs."""

    hardware: HardwareThread
    calibration: CalibrationInForce
    jobs: JobRunner
    events: EventLog
    clock: Clock
    targets: KnownTargets
    context: DepthContext
    viewer: TrailViewer | None
    on_distance: Callable[[float], None]
    """Called with the distance at which the foveae meet, m."""
    looping: Callable[[], bool]
    """Whether the vergence loop has the eyes."""


class FollowService:
    """Keeps the followed targets; callable from any thread."""

    def __init__(self, tools: FollowTools) -> None:
        self._tools = tools
        self._lock = threading.Lock()
        self._records: dict[str, FollowedRecord] = {}
        self._changed: set[str] = set()
        """Targets whose tracker or priority was changed and not yet taken over."""
        self._rounds: list[Future[list[SeenTarget]]] = []
        self._job_id: str | None = None
        tools.jobs.handle(KIND, self._run, parallel=True)

    # Called from other threads -----------------------------------------------------------------------------

    def follow(self, request: FollowRequest) -> FollowedDocument:
        """Follow a target as well; raise at once what could not be done now."""
        calibration = self._tools.calibration.require()
        target = self._target(request)
        check_target(target, calibration)
        self._tools.hardware.check_may_move()
        if self._tools.looping():
            raise Busy(
                "the vergence loop has the eyes; end it first",
                found="a running loop",
                remedy="end it: DELETE /api/v1/loop",
            )
        record = FollowedRecord(
            id=new_id("fol"),
            label=request.label or self._label(request),
            request=request,
            tracker=request.tracker,
            priority=request.priority,
            click=track_click(
                self._tools.hardware, target, frame_seq=request.frame_seq, box_px=request.box_px
            ),
        )
        with self._lock:
            if len(self._records) >= MOST_TARGETS:
                raise Busy(
                    f"{MOST_TARGETS} targets are followed already; let one of them go",
                    found=f"{MOST_TARGETS} targets",
                    remedy="let one of them go: DELETE /api/v1/follows/{id}",
                )
            self._records[record.id] = record
            idle = self._job_id is None
            if idle:
                self._job_id = ""
        self._tools.events.emit(
            "follow.started", f"{record.label} will be followed", data=self._change(record)
        )
        if idle:
            self._job_id = self._tools.jobs.submit(KIND).id
        return self.get(record.id)

    def every(self) -> list[FollowedDocument]:
        """Return all followed targets as they are now, oldest first."""
        calibration, now_ns = self._tools.calibration.current, self._tools.clock.now_ns()
        with self._lock:
            return [record.describe(calibration, now_ns=now_ns) for record in self._records.values()]

    def get(self, follow_id: str) -> FollowedDocument:
        """Return one as it is now or raise `NotFound`."""
        record = self._record(follow_id)
        with self._lock:
            return record.describe(self._tools.calibration.current, now_ns=self._tools.clock.now_ns())

    def trail(self, follow_id: str) -> list[TrailPoint]:
        """Return where a followed target was, or raise `NotFound`."""
        record = self._record(follow_id)
        with self._lock:
            return record.trail()

    def change(self, follow_id: str, patch: FollowPatch) -> FollowedDocument:
        """Change label, tracker or priority, or raise `NotFound`."""
        record = self._record(follow_id)
        with self._lock:
            record.label = patch.label or record.label
            record.tracker = patch.tracker or record.tracker
            record.priority = patch.priority or record.priority
            self._changed.add(follow_id)
        return self.get(follow_id)

    def end(self, follow_id: str) -> None:
        """Follow a target no more, or raise `NotFound`."""
        self._drop(self._record(follow_id).id, "on request")

    def end_all(self) -> None:
        """Follow no target any more."""
        for follow_id in list(self._records):
            self._drop(follow_id, "on request")

    def check_followed(self) -> None:
        """Raise `Busy` while no target is followed."""
        if not any(record.report is not None for record in list(self._records.values())):
            raise Busy(
                "no target is followed now; follow one first",
                found="no followed target",
                remedy="follow one: POST /api/v1/follows",
            )

    def take_round(self) -> "Future[list[SeenTarget]]":
        """Ask for one look at each target that the eyes reach; the looks are made between the others."""
        asked: Future[list[SeenTarget]] = Future()
        with self._lock:
            self._rounds.append(asked)
        return asked

    def marks(self) -> list[FollowMark]:
        """Return where the wide view shows the targets now."""
        calibration = self._tools.calibration.current
        if calibration is None or not self._records:
            return []
        now_ns = self._tools.clock.now_ns()
        with self._lock:
            known = [(record, record.report) for record in self._records.values()]
        marks = []
        for record, report in known:
            place = None if report is None else position_at(report.estimate, now_ns)
            pixel = None if place is None else wide_place_px(calibration, place)
            if pixel is not None:
                x_px, y_px = round(pixel[0], 1), round(pixel[1], 1)
                marks.append(
                    FollowMark(id=record.id, label=record.label, state=record.state, x_px=x_px, y_px=y_px)
                )
        return marks

    # The job -----------------------------------------------------------------------------------------------

    def _run(self, context: JobContext) -> str:
        reason = "following has ended"
        try:
            follower = Follower(self._tools.calibration.require(), clock=self._tools.clock)
            while self._records and not context.cancelled():
                self._follow_while_free(follower, context)
        except FoveaError as error:
            reason = str(error)
            raise
        finally:
            self._job_id = None
            self._end_rounds(reason)
            for follow_id in list(self._records):
                self._drop(follow_id, reason)
        context.check()
        return "/api/v1/follows"

    def _follow_while_free(self, follower: Follower, context: JobContext) -> None:
        """Have the rig until another job wants it, or nothing is followed."""
        hardware = self._tools.hardware
        if hardware.busy_with is not None or hardware.session_wanted:
            threading.Event().wait(WAIT_S)
            return
        due_ns = 0
        with hardware.session(f"job {context.job.id}", cancelled=context.cancelled, gives_way=True) as head:
            while self._records and not hardware.session_wanted:
                context.check()
                if hardware.halted:
                    raise refusals.stopped()
                self._take_changes(follower, head)
                self._take_rounds(follower, head)
                if follower.targets:
                    self._take(follower, follower.step(head))
                if (now_ns := self._tools.clock.now_ns()) >= due_ns:
                    due_ns = now_ns + REPORT_PERIOD_NS
                    self._tell(follower, context)

    def _take_changes(self, follower: Follower, head: Head) -> None:
        """Let the follower have the targets that it should have."""
        with self._lock:
            records = dict(self._records)
            changed, self._changed = self._changed, set()
        for follow_id in [one for one in follower.targets if one not in records]:
            follower.remove(follow_id)
        for record in records.values():
            if record.id not in follower.targets:
                self._find(record, follower, head)
            elif record.id in changed:
                self._reconfigure(follower.targets[record.id], record, head.wide())

    def _reconfigure(self, target: FollowedTarget, record: FollowedRecord, frame: Frame) -> None:
        target.priority = record.priority
        if target.tracker.value == record.tracker:
            return
        try:
            target.use_tracker(TrackerKind(record.tracker), gray(to_uint8(frame)), frame.t_ns)
        except FoveaError as error:
            message = f"{record.label} keeps its tracker: {error}"
            self._tools.events.emit(
                "follow.refused", message, level=EventLevel.WARNING, data=self._change(record)
            )
            record.tracker = "template" if target.tracker is TrackerKind.TEMPLATE else "filter"

    def _find(self, record: FollowedRecord, follower: Follower, head: Head) -> None:
        """Verge on a new target, and follow it from there; it is dropped where that fails."""
        tools, request = self._tools, record.request
        calibration, target, click = tools.calibration.require(), self._target(request), record.click
        record.click = None
        try:
            found = look_first(
                follower.watching(head),
                calibration,
                target,
                None if click is None else catch_up(tools.hardware, click),
                clock=tools.clock,
                context=tools.context,
            )
            follower.add(
                FollowedTarget(
                    record.id,
                    found.sighting,
                    found.point.point_rig_m,
                    calibration=calibration,
                    wide=gray(to_uint8(found.sighting.wide)),
                    tracker=TrackerKind(record.tracker),
                    box_px=sides_px(target, request.box_px),
                    priority=record.priority,
                    velocity_rig_m_s=found.velocity_rig_m_s,
                )
            )
        except FoveaError as error:
            if self._tools.hardware.halted:
                raise
            self._drop(record.id, str(error))
            return
        self._update(follower)

    def _take(self, follower: Follower, step: FollowStep) -> None:
        self._update(follower)
        if step.reading is None or step.target_id is None:
            return
        self._tools.on_distance(step.reading.point.distance_m)
        with self._lock:
            record = self._records.get(step.target_id)
            if record is not None:
                record.hits.append(follower.targets[step.target_id].at(step.t_ns))

    def _take_rounds(self, follower: Follower, head: Head) -> None:
        with self._lock:
            asked, self._rounds = self._rounds, []
        for one in asked:
            if not one.set_running_or_notify_cancel():
                continue
            try:
                one.set_result([self._seen(follower, step) for step in follower.round(head)])
            except FoveaError as error:
                one.set_exception(error)
                raise

    def _seen(self, follower: Follower, step: FollowStep) -> SeenTarget:
        self._take(follower, step)
        if step.target_id is None or step.sighting is None:
            raise AssertionError("a round has looks alone")
        record = self._records.get(step.target_id)
        return SeenTarget(
            target_id=step.target_id,
            label=step.target_id if record is None else record.label,
            sighting=step.sighting,
            estimate=follower.targets[step.target_id].at(step.t_ns),
            shown=step.reading is not None,
        )

    def _update(self, follower: Follower) -> None:
        """Take over how the targets stand; emit an event where a state has changed."""
        for report in follower.reports():
            with self._lock:
                record = self._records.get(report.target_id)
                if record is None:
                    continue
                before, record.report = record.state, report
                record.state = report.state.value
            if before != record.state:
                self._emit_state(record, report)

    def _emit_state(self, record: FollowedRecord, report: TargetReport) -> None:
        words = {
            "followed": f"is followed at {report.estimate.distance_m:.2f} m",
            "lost": "is lost; it is searched for",
            "out_of_field": "has left the field of the mirrors",
        }
        level = EventLevel.INFO if record.state == "followed" else EventLevel.WARNING
        message = f"{record.label} {words[record.state]}"
        self._tools.events.emit("follow.changed", message, level=level, data=self._change(record))

    def _tell(self, follower: Follower, context: JobContext) -> None:
        """Report progress and draw the trails."""
        looks = sum(report.looks for report in follower.reports())
        rate_hz = 1.0 / follower.look_s
        context.progress(
            looks, total=0, note=f"{len(follower.targets)} targets, {rate_hz:.1f} looks a second"
        )
        if self._tools.viewer is None:
            return
        with self._lock:
            trails = [(record.id, record.label, record.trail()) for record in self._records.values()]
        for follow_id, label, trail in trails:
            if trail:
                points = [(point.x_m, point.y_m, point.z_m) for point in trail]
                self._tools.viewer.show_trail(follow_id, label, points)

    def _end_rounds(self, reason: str) -> None:
        with self._lock:
            asked, self._rounds = self._rounds, []
        for one in asked:
            if one.set_running_or_notify_cancel():
                one.set_exception(Busy(f"the round was not taken: {reason}"))

    # Helpers -----------------------------------------------------------------------------------------------

    def _record(self, follow_id: str) -> FollowedRecord:
        record = self._records.get(follow_id)
        if record is None:
            raise NotFound(f"no target {follow_id} is followed", asked=f"followed target {follow_id}")
        return record

    def _drop(self, follow_id: str, reason: str) -> None:
        with self._lock:
            record = self._records.pop(follow_id, None)
            self._changed.discard(follow_id)
        if record is None:
            return
        if self._tools.viewer is not None:
            self._tools.viewer.remove_trail(follow_id)
        data = FollowEnded(id=record.id, label=record.label, reason=reason)
        level = EventLevel.INFO if reason == "on request" else EventLevel.WARNING
        self._tools.events.emit(
            "follow.ended", f"{record.label} is followed no more: {reason}", level=level, data=data
        )

    def _target(self, request: FollowRequest) -> Target:
        """Return what a request names; raise `InvalidInput`, or `NotFound` for an unknown target."""
        if request.target_id is None:
            return target_of(_as_fixation(request))
        if any(one is not None for one in (request.pixel, request.rectangle, request.direction)):
            raise InvalidInput(
                "a followed target is named by target_id or by a place, found both; send one of them",
                asked="a target to follow",
                found="two targets",
                remedy="send one of them",
            )
        known = self._tools.targets.get(request.target_id)
        direction = Direction(ax_deg=known.ax_deg, ay_deg=known.ay_deg)
        return target_of(FixationRequest(direction=direction))

    def _label(self, request: FollowRequest) -> str:
        if request.target_id is not None:
            return self._tools.targets.get(request.target_id).label
        with self._lock:
            taken = {record.label for record in self._records.values()}
        return next(name for name in (f"Followed {n}" for n in range(1, 99)) if name not in taken)

    def _change(self, record: FollowedRecord) -> FollowChanged:
        report = record.report
        distance_m = None if report is None else report.estimate.distance_m
        return FollowChanged(id=record.id, label=record.label, state=record.state, distance_m=distance_m)


def _as_fixation(request: FollowRequest) -> FixationRequest:
    return FixationRequest(pixel=request.pixel, rectangle=request.rectangle, direction=request.direction)
