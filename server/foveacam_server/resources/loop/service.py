"""Runs the vergence loop as a job that gives way to others, and takes orders from any thread."""

import threading
from collections.abc import Callable
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeout
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Busy, Clock, FoveaError, Frame, Head, Role
from foveacam_pipeline.capture.dataset.pictures import png_bytes
from foveacam_pipeline.capture.recording.values import STREAM_OF_ROLE, TrackedBox
from foveacam_pipeline.loop.autotune import TuneResult
from foveacam_pipeline.loop.match_picture import match_picture
from foveacam_pipeline.loop.settings import Axis, LoopSettings
from foveacam_pipeline.loop.tune_picture import tune_picture
from foveacam_pipeline.loop.vergence_loop import LoopStep, VergenceLoop
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.track.watching_head import WatchingHead
from foveacam_pipeline.verge.loop import PriorKnowledge, fixate
from foveacam_pipeline.verge.surroundings.depth_samples import DepthContext
from foveacam_pipeline.verge.values import Basis, Target
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.events import EventLevel, EventLog
from foveacam_server.foundation.job_table import Job
from foveacam_server.foundation.jobs import JobContext, JobRunner
from foveacam_server.foundation.names import utc_now
from foveacam_server.resources.fixations.request import check_target, direction_of, target_of
from foveacam_server.resources.fixations.schema import FixationRequest
from foveacam_server.resources.loop.documents import (
    DETAILS,
    TunedLoop,
    describe_axes,
    describe_target,
    describe_trigger,
    describe_tuning,
    first_limits_rad,
)
from foveacam_server.resources.loop.loop_run import LoopRun, TuneOrder
from foveacam_server.resources.loop.schema import (
    LoopDocument,
    LoopDrag,
    LoopPatch,
    LoopSample,
    LoopSettingsDocument,
    LoopSettingsGroup,
    LoopSettingsPatch,
    LoopStatusChanged,
    LoopStatusName,
    LoopTargetRequest,
    LoopTuned,
    LoopTuneRequest,
)
from foveacam_server.resources.loop.settings_file import (
    describe_settings,
    load_settings,
    patched,
    store_settings,
    with_defaults,
)
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.ports import CalibrationInForce
from foveacam_server.rig.schema import FollowMark

KIND, TUNE_KIND = "loop", "loop_tune"
URL = "/api/v1/loop"
FIRST_INVERSE_Z_PER_M = 0.2
"""Where the loop begins when nothing is known of the target's distance."""
MARK = "Loop"
"""Name of the target in the wide view and in recordings."""
OBEYED_S = 2.0
"""So long an answer waits for the look under way, so that it shows what was changed."""
TRACKER_SETTINGS = ("tracker", "box_width_px", "box_height_px")


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopTools:
    """Services that the loop needs. `folder`: keeps its settings."""

    hardware: HardwareThread
    calibration: CalibrationInForce
    jobs: JobRunner
    events: EventLog
    clock: Clock
    context: DepthContext
    folder: Path
    following: Callable[[], bool]
    """Whether the eyes follow targets: the loop would fight with it."""
    on_distance: Callable[[float], None]
    """Called with the distance at which the foveae meet, m."""


class LoopService:
    """The loop of the server: at most one runs; callable from any thread."""

    def __init__(self, tools: LoopTools) -> None:
        self._tools = tools
        self._lock = threading.Lock()
        self._settings = load_settings(tools.folder)
        self._run: LoopRun | None = None
        self._job_id: str | None = None
        self._tuned: TunedLoop | None = None
        tools.jobs.handle(KIND, self._work, parallel=True)
        tools.jobs.handle(TUNE_KIND, self._tune, parallel=True)

    @property
    def running(self) -> bool:
        """Whether the loop runs."""
        return self._run is not None

    @property
    def settings(self) -> LoopSettings:
        """The settings in force."""
        return self._settings

    # Target, end, sliders ----------------------------------------------------------------------------------

    def look_at(self, request: LoopTargetRequest) -> LoopDocument:
        """Choose a target; the loop begins where it does not run. Raise at once what cannot be done now."""
        tools = self._tools
        calibration = tools.calibration.require()
        target = target_of(FixationRequest(pixel=request.pixel, direction=request.direction))
        check_target(target, calibration)
        tools.hardware.check_may_move()
        if tools.following():
            raise Busy(
                "the foveae follow targets; let them go first",
                found="followed targets",
                remedy="let them go: DELETE /api/v1/follows",
            )
        run = self._begin(calibration)
        clicked = None if request.frame_seq is None else tools.hardware.recent_wide(request.frame_seq)
        place = np.tan(np.array(direction_of(target, calibration)))
        try:
            self._await(run.order(lambda head: self._choose(run, head, target, place, clicked, request)))
        except FoveaError:
            if run.loop.guide is None:  # it has nothing else to look at
                run.stop_wanted.set()
            raise
        return self.describe()

    def change(self, patch: LoopPatch) -> LoopDocument:
        """Pause, hold axes, or set their commands; raise `Busy` while the loop does not run."""
        run = self._need()
        self._await(run.order(lambda _: _apply(run.loop, patch)))
        return self.describe()

    def drag(self, place: LoopDrag | None) -> None:
        """Let both eyes look in parallel at a place of the wide view; None: the loop goes on."""
        run, calibration = self._need(), self._tools.calibration.require()
        if place is None:
            run.order(lambda _: run.loop.drag(None))
            return
        calibration.wide.check_pixel(place.x_px, place.y_px)
        tangents = np.tan(calibration.wide.angles_rad([(place.x_px, place.y_px)])[0])
        run.order(lambda _: run.loop.drag(tangents))

    def end(self) -> None:
        """End the loop; the mirrors stay where they are. No effect where none runs."""
        if (run := self._run) is not None:
            run.stop_wanted.set()

    def reset_trigger(self) -> LoopDocument:
        """Let a loop whose exposures failed go on; raise `Busy` while none runs."""
        run = self._need()
        self._await(run.order(lambda _: run.loop.gate.reset()))
        return self.describe()

    # Settings ----------------------------------------------------------------------------------------------

    def change_settings(self, patch: LoopSettingsPatch) -> LoopSettingsDocument:
        """Change settings now and for later runs; raise `InvalidInput` for values out of their bounds."""
        return self._use(patched(self._settings, patch))

    def reset_settings(self, group: LoopSettingsGroup | None) -> LoopSettingsDocument:
        """Put one group of settings, or all, back to their defaults."""
        return self._use(with_defaults(self._settings, group))

    def _use(self, settings: LoopSettings) -> LoopSettingsDocument:
        run = self._run
        if run is not None and run.tune_job_id is not None:
            raise Busy(
                "the loop is being tuned; wait until that has ended, or cancel it",
                found=f"job {run.tune_job_id}",
                remedy="wait, or cancel that job",
            )
        if run is not None:
            self._await(run.order(lambda head: _configure(run.loop, settings, head)))
        store_settings(self._tools.folder, settings)
        self._settings = settings
        return describe_settings(settings)

    # Tuning ------------------------------------------------------------------------------------------------

    def tune(self, request: LoopTuneRequest, *, idempotency_key: str | None = None) -> Job:
        """Tune the gains as a job; raise `Busy` while the loop has no target, or is being tuned."""
        run = self._need()
        if run.tune_job_id is not None:
            raise Busy("the loop is being tuned already", found=f"job {run.tune_job_id}", remedy="wait")
        return self._tools.jobs.submit(TUNE_KIND, request, idempotency_key=idempotency_key)

    def _tune(self, context: JobContext) -> str:
        run, done = self._need(), Future[TuneResult]()
        run.tune(TuneOrder(request=context.job.parse_request(LoopTuneRequest), context=context, done=done))
        result = done.result()
        self._settings = replace(
            self._settings,
            pan=result.settings.pan,
            depth=result.settings.depth,
            vertical=result.settings.vertical,
        )
        store_settings(self._tools.folder, self._settings)
        self._tuned = TunedLoop(result=result, tuned_utc=utc_now())
        self._tools.events.emit(
            "loop.tuned",
            f"the loop was tuned: the cost of a step fell from {result.cost_before:.2f} to {result.cost:.2f}",
            data=LoopTuned(cost_before=result.cost_before, cost=result.cost),
        )
        return URL

    # Answers -----------------------------------------------------------------------------------------------

    def describe(self) -> LoopDocument:
        """Return the loop as it is now."""
        run = self._run
        last = None if run is None else run.last
        shown = None if run is None else run.seen
        errors = None if shown is None else shown.errors
        point = None if errors is None else errors.point
        match = None if last is None else last.match
        status: LoopStatusName = "off" if run is None else run.status
        return LoopDocument(
            running=run is not None,
            job_id=self._job_id or None,
            tune_job_id=None if run is None else run.tune_job_id,
            status=status,
            detail=_detail(status, run),
            paused=run is not None and run.loop.paused,
            dragged=run is not None and run.loop.dragged,
            looks=0 if run is None else run.looks,
            rate_hz=0.0 if run is None else round(run.rate_hz, 2),
            lead_ms=None if last is None or run is None else run.loop.lead_ms,
            target=None if run is None else describe_target(run.loop, self._tools.clock.now_ns()),
            axes=describe_axes(
                np.zeros(4) if run is None else run.loop.command_rad,
                first_limits_rad(self._tools.calibration.current),
                None if errors is None else errors.values_rad,
                frozenset() if run is None else frozenset(axis.value for axis in run.loop.held),
            ),
            distance_m=None if point is None else point.distance_m,
            distance_sigma_m=None if point is None else point.distance_sigma_m,
            point_rig_m=None if point is None else point.point_rig_m,
            fine=None if errors is None else errors.fine,
            score_left=None if match is None else match.left.score,
            score_right=None if match is None else match.right.score,
            trigger=describe_trigger(None if run is None else run.loop, last),
            settings=describe_settings(self._settings),
            tuned=None if self._tuned is None else describe_tuning(self._tuned),
        )

    def history(self, after_look: int) -> list[LoopSample]:
        """Return the looks after a given one, oldest first; at most the last 900."""
        run = self._run
        return [] if run is None else [one for one in list(run.samples) if one.look > after_look]

    def match_picture(self) -> bytes:
        """Return the match of the last look as a PNG; raise `NotFound` where there is none."""
        run = self._run
        match = None if run is None or run.last is None else run.last.match
        if match is None:
            raise NotFound("the loop has matched nothing yet; choose a target", asked="the loop's match")
        return png_bytes(match_picture(match))

    def tune_picture(self, *, form: str) -> bytes:
        """Return the steps before and after the last tuning; raise `NotFound` where there was none."""
        if self._tuned is None:
            raise NotFound("the loop was not tuned yet", asked="a tuning's picture")
        return tune_picture(self._tuned.result, form=form)

    def marks(self) -> list[FollowMark]:
        """Return where the wide view shows the target; empty while the loop does not run."""
        run = self._run
        target = None if run is None else describe_target(run.loop, self._tools.clock.now_ns())
        if target is None or run is None:
            return []
        state = "followed" if run.status in {"tracking", "held", "frozen", "auto_tune"} else "lost"
        return [FollowMark(id="loop", label=MARK, state=state, x_px=target.x_px, y_px=target.y_px)]

    def boxes(self, frame: Frame) -> list[TrackedBox]:
        """Return the box of a tracked target in a wide frame, without a place where it is lost."""
        run = self._run
        target = None if run is None else describe_target(run.loop, frame.t_ns)
        if target is None or target.state == "fixed":
            return []
        width, height = self._settings.box_width_px, self._settings.box_height_px
        box = (target.x_px - width / 2.0, target.y_px - height / 2.0, float(width), float(height))
        return [
            TrackedBox(
                slot=MARK,
                t_ns=frame.t_ns,
                bbox_px=box if target.state == "tracked" else None,
                frames={STREAM_OF_ROLE[Role.WIDE]: frame.seq},
            )
        ]

    # The job -----------------------------------------------------------------------------------------------

    def _begin(self, calibration: Calibration) -> LoopRun:
        """Return the run, a new one where the loop does not run."""
        with self._lock:
            run = self._run
            if run is not None and not run.stop_wanted.is_set():
                return run
            if run is not None:
                raise Busy("the loop is ending; try again", found="a loop that ends", remedy="try again")
            loop = VergenceLoop(calibration, clock=self._tools.clock, settings=self._settings)
            self._run = LoopRun(
                loop, hardware=self._tools.hardware, clock=self._tools.clock, on_step=self._take
            )
            run = self._run
        self._job_id = self._tools.jobs.submit(KIND).id
        self._emit("loop.started", "initializing", "the vergence loop runs")
        return run

    def _work(self, context: JobContext) -> str:
        run, ended = self._need(), None
        try:
            while not (run.stop_wanted.is_set() or context.cancelled()):
                run.run_while_free(context)
        except FoveaError as error:
            ended = error
            raise
        finally:
            self._run, self._job_id = None, None
            run.close(ended)
            reason = "on request" if ended is None else str(ended)
            level = EventLevel.INFO if ended is None else EventLevel.WARNING
            self._emit("loop.ended", "off", f"the vergence loop has ended: {reason}", level=level)
        context.check()
        return URL

    def _take(self, step: LoopStep) -> None:
        """Draw outlines at the distance of a look, and tell when the trigger latches."""
        if step.errors is not None and step.errors.point is not None:
            self._tools.on_distance(step.errors.point.distance_m)
        run = self._run
        if run is not None and step.sighting is None and run.loop.gate.latched:
            message = f"the loop waits: exposures fail again and again: {run.loop.gate.reason}"
            self._emit("loop.latched", "trigger_fault", message, level=EventLevel.WARNING)

    def _choose(
        self,
        run: LoopRun,
        head: Head,
        target: Target,
        place: NDArray[np.float64],
        clicked: Frame | None,
        request: LoopTargetRequest,
    ) -> None:
        """Begin at a target: where its distance is not given, both foveae look for it first."""
        tools, calibration = self._tools, self._tools.calibration.require()
        frame = head.wide() if clicked is None else clicked
        known = request.distance_m
        inverse_z = FIRST_INVERSE_Z_PER_M if known is None else float(np.hypot(1.0, np.hypot(*place))) / known
        run.loop.choose(frame, place, inverse_z_per_m=inverse_z)
        if known is not None or Axis.VERGE in run.loop.held:
            return
        found = fixate(
            WatchingHead(head, run.loop.see_wide),
            calibration,
            target,
            known=PriorKnowledge(context=tools.context),
            clicked=clicked,
            clock=tools.clock,
        )
        if found.basis is Basis.BOTH_FOVEAE and found.point_rig_m is not None:
            run.loop.set_command(Axis.VERGE, calibration.baseline_m / found.point_rig_m[2])

    def _need(self) -> LoopRun:
        run = self._run
        if run is None:
            raise Busy(
                "the vergence loop does not run; choose a target first",
                found="no loop",
                remedy='choose a target: POST /api/v1/loop {"pixel": {"x_px": 720, "y_px": 540}}',
            )
        return run

    def _await(self, done: "Future[None]") -> None:
        """Wait for an order, but not for long: another job may have the rig."""
        try:
            done.result(OBEYED_S)
        except FutureTimeout:
            return

    def _emit(
        self, kind: str, status: LoopStatusName, message: str, *, level: EventLevel = EventLevel.INFO
    ) -> None:
        data = LoopStatusChanged(status=status, detail=message)
        self._tools.events.emit(kind, message, level=level, data=data)


def _apply(loop: VergenceLoop, patch: LoopPatch) -> None:
    for name, command_deg in (patch.command_deg or {}).items():
        loop.held.add(Axis(name))
        loop.set_command(Axis(name), float(np.radians(command_deg)))
    for name, held in (patch.held or {}).items():
        (loop.held.add if held else loop.held.discard)(Axis(name))
    if patch.paused is not None:
        loop.paused = patch.paused


def _configure(loop: VergenceLoop, settings: LoopSettings, head: Head) -> None:
    """Use other settings; a tracker that cannot learn the target leaves all as they were."""
    before = loop.settings
    loop.settings = settings
    if all(getattr(before, name) == getattr(settings, name) for name in TRACKER_SETTINGS):
        return
    try:
        loop.learn_again(head.wide())
    except FoveaError:
        loop.settings = before
        raise


def _detail(status: LoopStatusName, run: LoopRun | None) -> str:
    """Return what to do about a status."""
    if status != "trigger_fault" or run is None:
        return DETAILS.get(status, "")
    waits = " The loop waits: reset the trigger once that is mended." if run.loop.gate.latched else ""
    return f"{run.loop.gate.reason}{waits}"
