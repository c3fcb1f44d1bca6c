"""The job that follows targets: shares both foveae among them and yields the rig to other jobs."""

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Protocol

from foveacam_hardware.contract import Busy, Clock, FoveaError, Frame, Head
from foveacam_hardware.contract.spans import untraced
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.track.follow import Follower, FollowStep
from foveacam_pipeline.track.image_tracker import TrackerKind
from foveacam_pipeline.track.round_writer import SeenTarget
from foveacam_pipeline.track.target import FollowedTarget, TargetReport
from foveacam_pipeline.verge.surroundings.depth_samples import DepthContext
from foveacam_server.foundation.events import EventLevel, EventLog
from foveacam_server.foundation.jobs import JobContext, JobRunner
from foveacam_server.foundation.report_pace import ReportPace
from foveacam_server.resources.looking.fixations.table import FixatedTarget
from foveacam_server.resources.looking.follows.first_look import catch_up, look_first
from foveacam_server.resources.looking.follows.followed import FollowedRecord
from foveacam_server.resources.looking.follows.records import FollowedRecords
from foveacam_server.resources.looking.follows.schema import FollowChanged, FollowEnded
from foveacam_server.rig import refusals
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.ports import CalibrationInForce

KIND = "following"
WAIT_S = 0.02
"""Interval at which the job tries again to acquire the rig while another job has it."""
REPORT_PERIOD_NS = 2_000_000_000


class _GaveWay(Exception):
    """Another job wants the rig; the search for a target begins anew after it."""


class KnownTargets(Protocol):
    """Targets of earlier fixations."""

    def get(self, target_id: str) -> FixatedTarget:
        """Return a target or raise `NotFound`."""
        ...


class TrailViewer(Protocol):
    """Draws the trails of followed targets."""

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
    """Returns whether the vergence loop runs; the two cannot be active at once."""


class FollowJob:
    """Follows the targets of the table until it is empty."""

    def __init__(self, tools: FollowTools, records: FollowedRecords) -> None:
        self._tools = tools
        self._records = records
        self._lock = threading.Lock()
        self._rounds: list[Future[list[SeenTarget]]] = []
        self.job_id: str | None = None
        """Id of the running job; empty while it is being queued, None without one."""
        tools.jobs.handle(KIND, self._run, parallel=True)

    def begin(self) -> None:
        """Queue the job unless it runs."""
        with self._lock:
            idle = self.job_id is None
            if idle:
                self.job_id = ""
        if idle:
            self.job_id = self._tools.jobs.submit(KIND).id

    def take_round(self) -> "Future[list[SeenTarget]]":
        """Request one look at each target within reach, made between the ordinary looks."""
        asked: Future[list[SeenTarget]] = Future()
        with self._lock:
            self._rounds.append(asked)
        return asked

    def drop(self, follow_id: str, reason: str) -> None:
        """Stop following a target and emit the reason; no effect when no target has that id."""
        record = self._records.remove(follow_id)
        if record is None:
            return
        if self._tools.viewer is not None:
            self._tools.viewer.remove_trail(follow_id)
        data = FollowEnded(id=record.id, label=record.label, reason=reason)
        level = EventLevel.INFO if reason == "on request" else EventLevel.WARNING
        self._tools.events.emit(
            "follow.ended", f"{record.label} is followed no more: {reason}", level=level, data=data
        )

    def drop_all(self, reason: str) -> None:
        """Stop following all targets and emit the reason."""
        with self._records.all() as records:
            ids = list(records)
        for follow_id in ids:
            self.drop(follow_id, reason)

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
            self.job_id = None
            self._end_rounds(reason)
            self.drop_all(reason)
        context.check()
        return "/api/v1/follows"

    def _follow_while_free(self, follower: Follower, context: JobContext) -> None:
        """Hold the rig until another job wants it or no target is followed."""
        hardware = self._tools.hardware
        if hardware.use.holder is not None or hardware.use.wanted:
            threading.Event().wait(WAIT_S)
            return
        pace = ReportPace(self._tools.clock, period_ns=REPORT_PERIOD_NS)
        with (
            hardware.session(f"job {context.job.id}", cancelled=context.cancelled, gives_way=True) as head,
            self._finishing(follower),
        ):
            while self._records and not hardware.use.wanted:
                context.check()
                if hardware.halted:
                    raise refusals.stopped()
                self._take_changes(follower, head)
                self._take_rounds(follower, head)
                self._step(follower, head)
                if pace.is_due():
                    self._report_progress(follower, context)

    def _step(self, follower: Follower, head: Head) -> None:
        """Look at the next followed target; no effect without one."""
        if follower.targets:
            with untraced():  # runs for hours: kept out of the job's trace
                self._take(follower, follower.step(head))

    def _share(self, follower: Follower, head: Head) -> None:
        """Look at the next followed target before a look of a search; end the search for a waiting job."""
        if self._tools.hardware.use.wanted:
            raise _GaveWay
        self._step(follower, head)

    @contextmanager
    def _finishing(self, follower: Follower) -> Iterator[None]:
        """Wait for a started look before the rig is released; an error of that look is dropped."""
        try:
            yield
        finally:
            with suppress(FoveaError):
                self._finish(follower)

    def _finish(self, follower: Follower) -> None:
        if (step := follower.finish()) is not None:
            self._take(follower, step)

    def _take_changes(self, follower: Follower, head: Head) -> None:
        """Add, remove and reconfigure the follower's targets as the table was changed."""
        records, changed = self._records.take_changes()
        if changed or records.keys() != follower.targets.keys():
            self._finish(follower)
        for follow_id in [one for one in follower.targets if one not in records]:
            follower.remove(follow_id)
        for record in records.values():
            if record.id not in follower.targets:
                self._find(record, follower, head)
            elif record.id in changed:
                self._finish(follower)
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
                "follow.refused", message, level=EventLevel.WARNING, data=change_of(record)
            )
            record.tracker = "template" if target.tracker is TrackerKind.TEMPLATE else "filter"

    def _find(self, record: FollowedRecord, follower: Follower, head: Head) -> None:
        """Verge on a new target and add it to the follower; drop it where that fails.

        As a search can take many seconds, those that are followed already get every second look meanwhile,
        and it ends once another job wants the rig; the target is then searched for again later.
        """
        tools, calibration, click = self._tools, self._tools.calibration.require(), record.click
        record.click = None
        try:
            found = look_first(
                follower.watching(head, before_look=lambda: self._share(follower, head)),
                calibration,
                record.target,
                None if click is None else catch_up(tools.hardware.recent_wide, click),
                clock=tools.clock,
                context=tools.context,
            )
            self._finish(follower)
            follower.add(
                FollowedTarget(
                    record.id,
                    found.sighting,
                    found.point.point_rig_m,
                    calibration=calibration,
                    wide=gray(to_uint8(found.sighting.wide)),
                    tracker=TrackerKind(record.tracker),
                    box_px=record.box_px,
                    priority=record.priority,
                    velocity_rig_m_s=found.velocity_rig_m_s,
                )
            )
        except _GaveWay:
            record.click = click
            return
        except FoveaError as error:
            if self._tools.hardware.halted:
                raise
            self.drop(record.id, str(error))
            return
        self._update(follower)

    def _take(self, follower: Follower, step: FollowStep) -> None:
        self._update(follower)
        if step.reading is None or step.target_id is None:
            return
        self._tools.on_distance(step.reading.point.distance_m)
        with self._records.all() as records:
            if (record := records.get(step.target_id)) is not None:
                record.hits.append(follower.targets[step.target_id].at(step.t_ns))

    def _take_rounds(self, follower: Follower, head: Head) -> None:
        with self._lock:
            asked, self._rounds = self._rounds, []
        if asked:
            self._finish(follower)
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
        with self._records.all() as records:
            record = records.get(step.target_id)
        return SeenTarget(
            target_id=step.target_id,
            label=step.target_id if record is None else record.label,
            sighting=step.sighting,
            estimate=follower.targets[step.target_id].at(step.t_ns),
            shown=step.reading is not None,
        )

    def _update(self, follower: Follower) -> None:
        """Copy the states of the targets into the table; emit an event for each changed state."""
        for report in follower.reports():
            with self._records.all() as records:
                record = records.get(report.target_id)
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
        self._tools.events.emit("follow.changed", message, level=level, data=change_of(record))

    def _report_progress(self, follower: Follower, context: JobContext) -> None:
        """Report progress and draw the trails."""
        looks = sum(report.looks for report in follower.reports())
        rate_hz = 1.0 / follower.look_s
        context.progress(
            looks, total=0, note=f"{len(follower.targets)} targets, {rate_hz:.1f} looks a second"
        )
        if self._tools.viewer is None:
            return
        with self._records.all() as records:
            trails = [(record.id, record.label, record.trail()) for record in records.values()]
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


def change_of(record: FollowedRecord) -> FollowChanged:
    """Return the data of an event about a target's state."""
    report = record.report
    distance_m = None if report is None else report.estimate.distance_m
    return FollowChanged(id=record.id, label=record.label, state=record.state, distance_m=distance_m)
