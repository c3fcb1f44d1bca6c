"""Runs the vergence loop as a job that yields the rig to other jobs; accepts orders from any thread."""

import threading
from collections.abc import Callable
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeout
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from foveacam_hardware.contract import Busy, Clock, FoveaError, Frame, OutOfRange, Role
from foveacam_hardware.contract.spans import untraced
from foveacam_pipeline.capture.dataset.pictures import png_bytes
from foveacam_pipeline.capture.recording.values import TrackedBox
from foveacam_pipeline.continuous_loop.pictures import match_picture
from foveacam_pipeline.continuous_loop.settings import LoopSettings
from foveacam_pipeline.continuous_loop.split_eyes import SplitEyes
from foveacam_pipeline.continuous_loop.vergence_loop import LoopStep, VergenceLoop
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.surroundings.depth_samples import DepthContext
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.events import EventLevel, EventLog
from foveacam_server.foundation.jobs import JobContext, JobRunner
from foveacam_server.resources.looking.fixations.request import check_target, direction_of, target_of
from foveacam_server.resources.looking.fixations.schema import FixationRequest
from foveacam_server.resources.looking.loop.description import boxes_of, describe_loop, marks_of
from foveacam_server.resources.looking.loop.loop_run import LoopRun, Order
from foveacam_server.resources.looking.loop.orders import (
    FirstTarget,
    apply_patch,
    choose_target,
    configure,
    part_eyes,
    unite,
)
from foveacam_server.resources.looking.loop.schema import (
    EyeName,
    LoopDocument,
    LoopDrag,
    LoopEyePlace,
    LoopPatch,
    LoopSample,
    LoopSettingsDocument,
    LoopSettingsGroup,
    LoopSettingsPatch,
    LoopStatusChanged,
    LoopStatusName,
    LoopTargetRequest,
)
from foveacam_server.resources.looking.loop.settings_file import (
    describe_settings,
    load_settings,
    patched,
    store_settings,
    with_defaults,
)
from foveacam_server.resources.looking.loop.tuning import URL, LoopTuning, check_not_tuned
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.ports import CalibrationInForce
from foveacam_server.rig.schema import FollowMark

KIND = "loop"
OBEYED_S = 2.0
"""Time for which a request waits for the look under way, so that its answer shows the change."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopTools:
    """Services that the loop needs. `folder`: directory of its settings file."""

    hardware: HardwareThread
    calibration: CalibrationInForce
    jobs: JobRunner
    events: EventLog
    clock: Clock
    context: DepthContext
    folder: Path
    following: Callable[[], bool]
    """Returns whether targets are followed; the two cannot be active at once."""
    on_distance: Callable[[float], None]
    """Called with the distance at which the foveae meet, m."""


class LoopService:
    """The server's vergence loop, of which at most one runs; callable from any thread."""

    def __init__(self, tools: LoopTools) -> None:
        self._tools = tools
        self._lock = threading.Lock()
        self._settings = load_settings(tools.folder)
        self._run: LoopRun | None = None
        self._job_id: str | None = None
        self.tuning = LoopTuning(jobs=tools.jobs, events=tools.events, run=self._need, keep=self._keep)
        tools.jobs.handle(KIND, self._work, parallel=True)

    @property
    def running(self) -> bool:
        """Whether the loop runs."""
        return self._run is not None

    # Target, end, sliders ----------------------------------------------------------------------------------

    def look_at(self, request: LoopTargetRequest) -> LoopDocument:
        """Choose a target; start the loop if it does not run.

        Raise at once where that is not possible now.
        """
        tools = self._tools
        calibration = tools.calibration.require()
        target = target_of(FixationRequest(pixel=request.pixel, direction=request.direction))
        check_target(target, calibration)
        self._check_free()
        run = self._begin(calibration)
        wanted = FirstTarget(
            target=target,
            place=np.tan(np.array(direction_of(target, calibration))),
            clicked=tools.hardware.recent_wide.chosen(request.frame_seq, now_ns=tools.clock.now_ns()),
            distance_m=request.distance_m,
        )
        self._order(
            run,
            lambda head: choose_target(
                run, head, wanted, calibration=calibration, clock=tools.clock, context=tools.context
            ),
        )
        return self.describe()

    def change(self, patch: LoopPatch) -> LoopDocument:
        """Pause, hold axes, or set their commands; raise `Busy` while the loop does not run."""
        run = self._need()
        check_not_tuned(run)
        self._await(run.order(lambda _: apply_patch(run.loop, patch)))
        return self.describe()

    def drag(self, place: LoopDrag | None) -> None:
        """Point both eyes in parallel at a place of the wide view; None releases them."""
        run, calibration = self._need(), self._tools.calibration.require()
        check_not_tuned(run)
        if place is None:
            run.order(lambda _: run.loop.drag(None))
            return
        calibration.wide.check_pixel(place.x_px, place.y_px)
        tangents = np.tan(calibration.wide.angles_rad([(place.x_px, place.y_px)])[0])
        run.order(lambda _: run.loop.drag(tangents))

    def follow_apart(self, eye: EyeName, place: LoopEyePlace) -> LoopDocument:
        """Make one eye keep a place of its picture centred; the other keeps its own place, or rests."""
        calibration = self._tools.calibration.require()
        width, height = calibration.fovea_width, calibration.fovea_height
        if not (0.0 <= place.x_px <= width - 1 and 0.0 <= place.y_px <= height - 1):
            raise OutOfRange(
                f"the place ({place.x_px:g}, {place.y_px:g}) is outside the fovea of {width} x {height} px; "
                "choose one inside"
            )
        self._check_free()
        run = self._begin(calibration)
        pixel, hardware, clock = (place.x_px, place.y_px), self._tools.hardware, self._tools.clock
        self._order(
            run,
            lambda head: part_eyes(
                run,
                head,
                Role(eye),
                pixel,
                hardware=hardware,
                new_split=lambda: SplitEyes(calibration, clock=clock),
            ),
        )
        return self.describe()

    def reunite(self) -> LoopDocument:
        """End the split of the eyes; without a common target the loop ends."""
        run = self._need()
        if run.loop.guide is None:
            run.stop_wanted.set()
        else:
            self._await(run.order(lambda _: unite(run)))
        return self.describe()

    def end(self) -> None:
        """End the loop; the mirrors stay where they are. No effect when it does not run."""
        if (run := self._run) is not None:
            run.stop_wanted.set()

    def reset_trigger(self) -> LoopDocument:
        """Reset the trigger of a loop latched by failed exposures; raise `Busy` when it does not run."""
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
        if run is not None:
            check_not_tuned(run)
            self._await(run.order(lambda head: configure(run.loop, settings, head)))
        store_settings(self._tools.folder, settings)
        self._settings = settings
        return describe_settings(settings)

    def _keep(self, tuned: LoopSettings) -> None:
        """Store the gains of a tuning as the loop's settings."""
        self._settings = replace(self._settings, pan=tuned.pan, depth=tuned.depth, vertical=tuned.vertical)
        store_settings(self._tools.folder, self._settings)

    # Answers -----------------------------------------------------------------------------------------------

    def describe(self) -> LoopDocument:
        """Return the present state of the loop."""
        return describe_loop(
            self._run,
            job_id=self._job_id,
            settings=self._settings,
            tuned=self.tuning.last,
            calibration=self._tools.calibration.current,
            now_ns=self._tools.clock.now_ns(),
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

    def marks(self) -> list[FollowMark]:
        """Return the target's mark in the wide view; empty while the loop does not run."""
        run = self._run
        return [] if run is None else marks_of(run, self._tools.clock.now_ns())

    def boxes(self, frame: Frame) -> list[TrackedBox]:
        """Return the target's box in a wide frame; empty while the loop tracks nothing."""
        run = self._run
        return [] if run is None else boxes_of(run, frame)

    # The job -----------------------------------------------------------------------------------------------

    def _begin(self, calibration: Calibration) -> LoopRun:
        """Return the present run, or start a new one."""
        with self._lock:
            run = self._run
            if run is not None and not run.stop_wanted.is_set():
                return run
            if run is not None:
                raise Busy("the loop is ending", found="a loop that ends", remedy="try again")
            loop = VergenceLoop(calibration, clock=self._tools.clock, settings=self._settings)
            self._run = LoopRun(
                loop, hardware=self._tools.hardware, clock=self._tools.clock, on_step=self._take
            )
            run = self._run
        try:
            self._job_id = self._tools.jobs.submit(KIND).id
        except FoveaError:
            self._run = None
            raise
        self._emit("loop.started", "initializing", "the vergence loop runs")
        return run

    def _work(self, context: JobContext) -> str:
        run, ended = self._need(), None
        try:
            with untraced():  # runs for hours: kept out of the job's trace
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
        """Draw outlines at the distance of a look; emit an event when the trigger latches."""
        if step.errors is not None and step.errors.point is not None:
            self._tools.on_distance(step.errors.point.distance_m)
        run = self._run
        if run is not None and step.sighting is None and run.loop.gate.latched:
            message = f"the loop waits: exposures fail again and again: {run.loop.gate.reason}"
            self._emit("loop.latched", "trigger_fault", message, level=EventLevel.WARNING)

    def _check_free(self) -> None:
        """Raise unless the mirrors may move and no targets are followed."""
        self._tools.hardware.check_may_move()
        if self._tools.following():
            raise Busy(
                "the foveae follow targets",
                found="followed targets",
                remedy="let them go first: DELETE /api/v1/follows",
            )

    def _order(self, run: LoopRun, work: Order) -> None:
        """Execute an order between two looks; end the loop where it fails and there is no other target."""
        check_not_tuned(run)
        try:
            self._await(run.order(work))
        except FoveaError:
            if run.loop.guide is None and run.split is None:
                run.stop_wanted.set()
            raise

    def _need(self) -> LoopRun:
        run = self._run
        if run is None:
            raise Busy(
                "the vergence loop does not run",
                found="no loop",
                remedy='choose a target first: POST /api/v1/loop {"pixel": {"x_px": 720, "y_px": 540}}',
            )
        return run

    def _await(self, done: "Future[None]") -> None:
        """Wait for an order, for a limited time only, as another job may have the rig."""
        try:
            done.result(OBEYED_S)
        except FutureTimeout:
            return

    def _emit(
        self, kind: str, status: LoopStatusName, message: str, *, level: EventLevel = EventLevel.INFO
    ) -> None:
        data = LoopStatusChanged(status=status, detail=message)
        self._tools.events.emit(kind, message, level=level, data=data)
