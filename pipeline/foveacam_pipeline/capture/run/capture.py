"""Runs a raster capture: the missing points of a dataset's plan, until the dataset is complete.

`shutter` exposes and the dataset's writer stores; this module controls the order, moves along the rail,
pauses, cancellation and progress.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager

from foveacam_hardware.contract import (
    Cancelled,
    DeviceFault,
    FoveaError,
    NotCalibrated,
    OutOfRange,
    PanTiltPose,
    Rail,
    RailState,
    StereoVolts,
    Timeout,
)
from foveacam_hardware.contract.spans import span
from foveacam_pipeline.capture.dataset import CapturedPoint, DatasetWriter, PlanPosition, Shot
from foveacam_pipeline.capture.plan import PlanPoint, RasterPlan, all_point_volts, plan_from, points_of_plan
from foveacam_pipeline.capture.run.access import CaptureRig, CaptureWatcher, RigAccess
from foveacam_pipeline.capture.run.describe import pan_tilt_pose, rail_position_m
from foveacam_pipeline.capture.run.shots import planned_shots, stored_shots
from foveacam_pipeline.capture.run.shutter import ShotTaker
from foveacam_pipeline.capture.run.values import CapturePhase, CaptureReport, FoveaPair, RunSettings, ShotPlan
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.fixate import fixate
from foveacam_pipeline.verge.values import DirectionTarget

DEFAULT = RunSettings()


def run_capture(
    access: RigAccess, writer: DatasetWriter, *, watch: CaptureWatcher, settings: RunSettings = DEFAULT
) -> None:
    """Capture the points of its plan that the writer's dataset lacks, and finish it.

    Plan and calibration are the dataset's own, so that a resumed dataset is consistent. Raise Cancelled
    when the watcher cancels, and the error of a device or disk that ended the capture: captured points are
    kept, and another run continues at the exact next point.
    """
    header = writer.header
    if header.calibration is None:
        raise NotCalibrated(f"dataset {writer.folder}: it has no calibration; begin another capture")
    header.calibration.check_rig(access.run_still(lambda rig: rig.rig_id))
    plan = plan_from(header.plan, what=f"plan of {writer.folder}")
    run = _CaptureRun(access, writer, plan, header.calibration, watch=watch, settings=settings)
    try:
        run.capture_points()
    finally:
        run.close()
    run.finish()


class _CaptureRun:
    """One run through the points that a dataset lacks."""

    def __init__(
        self,
        access: RigAccess,
        writer: DatasetWriter,
        plan: RasterPlan,
        calibration: Calibration,
        *,
        watch: CaptureWatcher,
        settings: RunSettings,
    ) -> None:
        self._access, self._writer, self._plan, self._calibration = access, writer, plan, calibration
        self._watch, self._settings = watch, settings
        self._shutter = ShotTaker(access, tries=settings.tries)
        self._rail = _RailMover(access, watch=watch, settings=settings)
        self._first = writer.next_point
        self._began_ns = access.clock.now_ns()
        self._idle_ns = 0
        self._pose: PanTiltPose | None = None
        self._rail_m: float | None = None
        self._unverged = 0

    def capture_points(self) -> None:
        """Capture every missing point."""
        sequence = points_of_plan(self._plan)[self._first :]
        planned = [planned_shots(self._plan, volts) for volts in all_point_volts(sequence, self._calibration)]
        self._pose, self._rail_m = self._access.run_still(
            lambda rig: (pan_tilt_pose(rig), rail_position_m(rig))
        )
        self._report_progress(CapturePhase.POINTS)
        scan: int | None = None
        for number, point in enumerate(sequence):
            self._wait_while_paused()
            if point.scan != scan:
                scan = point.scan
                self._begin_scan(point)
            following = self._following(sequence[number + 1 :], planned[number + 1 :], scan)
            with span("point", index=point.index):
                self._writer.add(self._capture_point(point, planned[number], following))
            self._report_progress(CapturePhase.POINTS)

    def finish(self) -> None:
        """Wait until everything is on disk."""
        self._report_progress(CapturePhase.CLOSING)
        self._writer.finish()
        self._report_progress(CapturePhase.POINTS)

    def close(self) -> None:
        """Restore the cameras' settings; an error is raised only if nothing else failed."""
        try:
            self._shutter.close()
        except FoveaError as error:
            if self._writer.next_point == self._writer.header.points:
                raise
            self._watch.progress(self._report(CapturePhase.POINTS, note=f"not left as it was: {error}"))

    def _begin_scan(self, point: PlanPoint) -> None:
        if point.rail_m is None:
            return
        self._shutter.discard_pending()
        self._writer.flush()
        self._report_progress(CapturePhase.RAIL, note=f"moving the rig to {1e3 * point.rail_m:g} mm")
        with self._not_counted():
            self._rail.move_to(point.rail_m)
        self._rail_m = point.rail_m
        self._wait_while_paused()

    def _following(
        self, sequence: tuple[PlanPoint, ...], planned: list[tuple[ShotPlan, ...]], scan: int
    ) -> ShotPlan | None:
        """Return the shot that may begin during this point's readout; None when none may."""
        if not sequence or sequence[0].scan != scan or self._plan.verging.each_point or self._watch.paused():
            return None
        return planned[0][0]

    def _capture_point(
        self, point: PlanPoint, planned: tuple[ShotPlan, ...], following: ShotPlan | None
    ) -> CapturedPoint:
        distance_m, shots = point.distance_m, planned
        if self._plan.verging.each_point:
            verged = self._verge_at(point)
            if verged is not None:
                distance_m, shots = verged[0], planned_shots(self._plan, verged[1])
        since_ns = self._shutter.ended_ns
        stored = list(stored_shots(self._plan, self._pairs(shots, following)))
        if self._wants_wide(point):
            wide = self._shutter.wide_since(since_ns)
            self._watch.show_frames((wide,))
            stored.append(Shot(frame=wide))
        return CapturedPoint(place=self._plan_position(point, distance_m), shots=tuple(stored))

    def _pairs(
        self, shots: tuple[ShotPlan, ...], following: ShotPlan | None
    ) -> Iterator[tuple[ShotPlan, FoveaPair]]:
        for number, shot in enumerate(shots):
            self._check()
            after = shots[number + 1] if number + 1 < len(shots) else following
            pair = self._shutter.capture_shot(shot, after)
            self._watch.show_frames((pair.left, pair.right))
            yield shot, pair

    def _wants_wide(self, point: PlanPoint) -> bool:
        return self._plan.wide == "point" or (self._plan.wide == "scan" and point.point == 0)

    def _verge_at(self, point: PlanPoint) -> tuple[float, StereoVolts] | None:
        """Return the distance found at a point and the volts that meet there; None to use the plan's."""
        self._shutter.discard_pending()
        target = DirectionTarget(ax_rad=point.ax_rad, ay_rad=point.ay_rad)
        try:
            found = fixate(
                self._access.head,
                self._calibration,
                target,
                clock=self._access.clock,
                cancelled=self._watch.cancelled,
            )
        except OutOfRange:
            found = None
        if found is None or found.distance_m is None or found.volts is None:
            self._unverged += 1
            return None
        return found.distance_m, found.volts

    def _plan_position(self, point: PlanPoint, distance_m: float) -> PlanPosition:
        return PlanPosition(
            index=point.index,
            scan=point.scan,
            column=point.column,
            row=point.row,
            aim_rad=(point.ax_rad, point.ay_rad),
            distance_m=distance_m if math.isfinite(distance_m) else None,
            rail_m=self._rail_m,
            pan_rad=None if self._pose is None else self._pose.pan_rad,
            tilt_rad=None if self._pose is None else self._pose.tilt_rad,
        )

    def _check(self) -> None:
        self._writer.check()  # a point may take minutes: a disk error is raised before the next exposure
        if self._watch.cancelled():
            taken, total = self._writer.next_point, self._writer.header.points
            raise Cancelled(f"cancelled after {taken} of {total} points; what was taken is kept, resume it")

    def _wait_while_paused(self) -> None:
        self._check()
        if not self._watch.paused():
            return
        self._shutter.discard_pending()
        self._report_progress(CapturePhase.PAUSED)
        with self._not_counted():
            while self._watch.paused():
                self._check()
                clock = self._access.clock
                clock.sleep_until_ns(clock.now_ns() + round(1e6 * self._settings.poll_ms))
        self._report_progress(CapturePhase.POINTS)

    @contextmanager
    def _not_counted(self) -> Iterator[None]:
        """Exclude this time from the rates."""
        before_ns = self._access.clock.now_ns()
        try:
            yield
        finally:
            self._idle_ns += self._access.clock.now_ns() - before_ns

    def _report_progress(self, phase: CapturePhase, note: str = "") -> None:
        self._watch.progress(self._report(phase, note=note))

    def _report(self, phase: CapturePhase, *, note: str) -> CaptureReport:
        progress, done = self._writer.progress, self._writer.next_point
        spent_s = max(1e-9, (self._access.clock.now_ns() - self._began_ns - self._idle_ns) / 1e9)
        here = done - self._first
        if not note and self._unverged:
            note = f"{self._unverged} points not verged"
        return CaptureReport(
            phase=phase,
            done=done,
            total=progress.planned,
            stored=progress.acknowledged,
            written_bytes=progress.written_bytes,
            bytes_per_s=progress.written_bytes / spent_s if here else 0.0,
            left_s=spent_s / here * (progress.planned - done) if here else None,
            note=note,
        )


class _RailMover:
    """Moves the rig to the rail positions of a plan; asks the operator where the rail has no motor."""

    def __init__(self, access: RigAccess, *, watch: CaptureWatcher, settings: RunSettings) -> None:
        self._access = access
        self._watch = watch
        self._settings = settings

    def move_to(self, place_m: float) -> None:
        """Move the rig to a position, metres from the rail's middle, and return when it is there."""
        if not self._access.run_still(lambda rig: _rail(rig).moves_itself):
            self._access.run_still(lambda rig: _rail(rig).move_to(place_m))
            self._watch.ask_operator(f"push the rig to {1e3 * place_m:g} mm on the rail, then continue")
            return
        try:
            self._move(place_m)
        except Cancelled:
            self._access.run_still(lambda rig: _rail(rig).hold())
            raise
        clock = self._access.clock
        clock.sleep_until_ns(clock.now_ns() + round(1e6 * self._settings.rail_rest_ms))

    def _move(self, place_m: float) -> None:
        state = self._until_still("the rail's last move", timeout_ms=self._settings.rail_ms)
        self._access.check_may_move()
        if not state.homed:
            self._access.run_still(lambda rig: _rail(rig).home())
            self._until_still("the rail's homing", timeout_ms=self._settings.home_ms)
        self._access.check_may_move()
        self._access.run_still(lambda rig: _rail(rig).move_to(place_m))
        state = self._until_still("the rail's move", timeout_ms=self._settings.rail_ms)
        at_m = state.position_m
        if at_m is None or abs(at_m - place_m) > self._settings.rail_near_m:
            stands = "at an unknown place" if at_m is None else f"at {1e3 * at_m:.1f} mm"
            raise DeviceFault(
                f"rail: asked to move to {1e3 * place_m:g} mm, it stands still {stands} "
                f"({state.fault or 'it was held'})",
                asked=f"{1e3 * place_m:g} mm",
                found=f"it stands still {stands}",
                remedy="free it, then resume the capture",
            )

    def _until_still(self, what: str, *, timeout_ms: float) -> RailState:
        clock = self._access.clock
        deadline_ns = clock.now_ns() + round(1e6 * timeout_ms)
        while (state := self._access.run_still(lambda rig: _rail(rig).state)).moving:
            if self._watch.cancelled():
                raise Cancelled("the capture was cancelled while the rail moved; it can be resumed")
            if clock.now_ns() > deadline_ns:
                raise Timeout(f"{what}: not over within {timeout_ms / 1e3:g} s; free it, then resume")
            clock.sleep_until_ns(clock.now_ns() + round(1e6 * self._settings.poll_ms))
        return state


def _rail(rig: CaptureRig) -> Rail:
    if rig.rail is None:
        raise OutOfRange(
            "capture: the plan moves the rig sideways, this rig has no rail; take it from one place"
        )
    return rig.rail
