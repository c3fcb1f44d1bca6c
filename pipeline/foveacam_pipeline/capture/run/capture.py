"""A raster capture: point after point of a plan, from where its dataset stands, until it is whole.

Looks are `shutter`'s, files the dataset writer's; here are the order, pauses, cancelling and what is told.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager

from foveacam_hardware.contract import (
    Cancelled,
    FoveaError,
    NotCalibrated,
    OutOfRange,
    PanTiltPose,
    StereoVolts,
)
from foveacam_pipeline.capture.dataset import CapturedPoint, DatasetWriter, PlanPosition, Shot
from foveacam_pipeline.capture.plan import PlanPoint, RasterPlan, all_point_volts, plan_from, points_of_plan
from foveacam_pipeline.capture.run.access import CaptureWatcher, RigAccess
from foveacam_pipeline.capture.run.describe import bearing, rail_m
from foveacam_pipeline.capture.run.rail_mover import RailMover
from foveacam_pipeline.capture.run.shutter import ShotTaker
from foveacam_pipeline.capture.run.stacks import kept_of, shots_of
from foveacam_pipeline.capture.run.values import CapturePhase, CaptureReport, FoveaPair, RunSettings, ShotPlan
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.loop import fixate
from foveacam_pipeline.verge.values import DirectionTarget

DEFAULT = RunSettings()


def run_capture(
    access: RigAccess, writer: DatasetWriter, *, watch: CaptureWatcher, settings: RunSettings = DEFAULT
) -> None:
    """Take what the writer's dataset lacks of its plan, and finish it.

    Plan and calibration are the dataset's own, so that one gone on with is of one piece. Raise Cancelled when
    the watcher has had enough, and the error of the device or disk that ended it: what was taken before is
    kept, and another run goes on at the exact next point.
    """
    header = writer.header
    if header.calibration is None:
        raise NotCalibrated(f"dataset {writer.folder}: it has no calibration; begin another capture")
    header.calibration.check_rig(access.still(lambda rig: rig.rig_id))
    plan = plan_from(header.plan, what=f"plan of {writer.folder}")
    run = _Run(access, writer, plan, header.calibration, watch=watch, settings=settings)
    try:
        run.take_all()
    finally:
        run.close()
    run.finish()


class _Run:
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
        self._sideways = RailMover(access, watch=watch, settings=settings)
        self._first = writer.next_point
        self._began_ns = access.clock.now_ns()
        self._idle_ns = 0
        self._pose: PanTiltPose | None = None
        self._rail_m: float | None = None
        self._unverged = 0

    def take_all(self) -> None:
        """Take every point that is missing."""
        sequence = points_of_plan(self._plan)[self._first :]
        planned = [shots_of(self._plan, volts) for volts in all_point_volts(sequence, self._calibration)]
        self._pose, self._rail_m = self._access.still(lambda rig: (bearing(rig), rail_m(rig)))
        self._tell(CapturePhase.POINTS)
        scan: int | None = None
        for number, point in enumerate(sequence):
            self._wait_while_paused()
            if point.scan != scan:
                scan = point.scan
                self._begin_scan(point)
            following = self._following(sequence[number + 1 :], planned[number + 1 :], scan)
            self._writer.add(self._taken(point, planned[number], following))
            self._tell(CapturePhase.POINTS)

    def finish(self) -> None:
        """Wait until the disk has everything."""
        self._tell(CapturePhase.CLOSING)
        self._writer.finish()
        self._tell(CapturePhase.POINTS)

    def close(self) -> None:
        """Leave the cameras as they were; whatever ails the rig then was told already."""
        try:
            self._shutter.close()
        except FoveaError as error:
            if self._writer.next_point == self._writer.header.points:
                raise
            self._watch.progress(self._report(CapturePhase.POINTS, note=f"not left as it was: {error}"))

    def _begin_scan(self, point: PlanPoint) -> None:
        if point.rail_m is None:
            return
        self._shutter.drop()
        self._writer.flush()
        self._tell(CapturePhase.RAIL, note=f"moving the rig to {1e3 * point.rail_m:g} mm")
        with self._not_counted():
            self._sideways.go_to(point.rail_m)
        self._rail_m = point.rail_m
        self._wait_while_paused()

    def _following(
        self, sequence: tuple[PlanPoint, ...], planned: list[tuple[ShotPlan, ...]], scan: int
    ) -> ShotPlan | None:
        """Return the shot that may begin while this point is read out; None when it may not."""
        if not sequence or sequence[0].scan != scan or self._plan.verging.each_point or self._watch.paused():
            return None
        return planned[0][0]

    def _taken(
        self, point: PlanPoint, planned: tuple[ShotPlan, ...], following: ShotPlan | None
    ) -> CapturedPoint:
        distance_m, shots = point.distance_m, planned
        if self._plan.verging.each_point:
            verged = self._verged(point)
            if verged is not None:
                distance_m, shots = verged[0], shots_of(self._plan, verged[1])
        since_ns = self._shutter.ended_ns
        kept = list(kept_of(self._plan, self._pairs(shots, following)))
        if self._wants_wide(point):
            wide = self._shutter.wide_since(since_ns)
            self._watch.saw((wide,))
            kept.append(Shot(frame=wide))
        return CapturedPoint(place=self._place(point, distance_m), shots=tuple(kept))

    def _pairs(
        self, shots: tuple[ShotPlan, ...], following: ShotPlan | None
    ) -> Iterator[tuple[ShotPlan, FoveaPair]]:
        for number, shot in enumerate(shots):
            self._check()
            after = shots[number + 1] if number + 1 < len(shots) else following
            pair = self._shutter.take(shot, after)
            self._watch.saw((pair.left, pair.right))
            yield shot, pair

    def _wants_wide(self, point: PlanPoint) -> bool:
        return self._plan.wide == "point" or (self._plan.wide == "scan" and point.point == 0)

    def _verged(self, point: PlanPoint) -> tuple[float, StereoVolts] | None:
        """Return the distance found at a point and the drive that meets there; None: the plan's counts."""
        self._shutter.drop()
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

    def _place(self, point: PlanPoint, distance_m: float) -> PlanPosition:
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
        self._writer.check()  # a point may take minutes: a disk that failed is told before the next exposure
        if self._watch.cancelled():
            taken, total = self._writer.next_point, self._writer.header.points
            raise Cancelled(f"cancelled after {taken} of {total} points; what was taken is kept, resume it")

    def _wait_while_paused(self) -> None:
        self._check()
        if not self._watch.paused():
            return
        self._shutter.drop()
        self._tell(CapturePhase.PAUSED)
        with self._not_counted():
            while self._watch.paused():
                self._check()
                clock = self._access.clock
                clock.sleep_until_ns(clock.now_ns() + round(1e6 * self._settings.poll_ms))
        self._tell(CapturePhase.POINTS)

    @contextmanager
    def _not_counted(self) -> Iterator[None]:
        """Leave this time out of the rates."""
        before_ns = self._access.clock.now_ns()
        try:
            yield
        finally:
            self._idle_ns += self._access.clock.now_ns() - before_ns

    def _tell(self, phase: CapturePhase, note: str = "") -> None:
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
