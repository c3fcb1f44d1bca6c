"""One run of the vergence loop: look after look, with orders of other threads executed in between."""

import queue
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass

from foveacam_hardware.contract import Cancelled, Clock, FoveaError, Head
from foveacam_pipeline.continuous_loop.autotune import TuneResult, autotune
from foveacam_pipeline.continuous_loop.relay import TuneRefused
from foveacam_pipeline.continuous_loop.split_eyes import SplitEyes, SplitStep
from foveacam_pipeline.continuous_loop.vergence_loop import LoopStep, VergenceLoop
from foveacam_server.foundation.jobs import JobContext
from foveacam_server.foundation.report_pace import ReportPace
from foveacam_server.resources.looking.loop.documents import sample_of
from foveacam_server.resources.looking.loop.schema import LoopSample, LoopStatusName, LoopTuneRequest
from foveacam_server.rig import refusals
from foveacam_server.rig.hardware import HardwareThread

WAIT_S = 0.02
"""Polling interval while another job has the rig or the trigger is latched."""
FAILED_PAUSE_S = 0.5
"""Pause after a failed exposure, during which a live view shows whether the rig works again."""
REPORT_PERIOD_NS = 2_000_000_000
HISTORY = 900
SMOOTHING = 0.2

Order = Callable[[Head], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class TuneOrder:
    """A tuning that a job waits for."""

    request: LoopTuneRequest
    context: JobContext
    done: "Future[TuneResult]"


class LoopRun:
    """The loop of one job, its last looks and its queued orders; `stop_wanted` ends it."""

    def __init__(
        self,
        loop: VergenceLoop,
        *,
        hardware: HardwareThread,
        clock: Clock,
        on_step: Callable[[LoopStep], None],
    ) -> None:
        self.loop = loop
        self.status: LoopStatusName = "initializing"
        self.last: LoopStep | None = None
        self.seen: LoopStep | None = None
        """The last look in which the target was measured."""
        self.split: SplitEyes | None = None
        """Set while each eye follows a separate place; `split_step` is its last look."""
        self.split_step: SplitStep | None = None
        self.looks = 0
        self.rate_hz = 0.0
        self.samples: deque[LoopSample] = deque(maxlen=HISTORY)
        self.tune_job_id: str | None = None
        self.stop_wanted = threading.Event()
        self._hardware = hardware
        self._clock = clock
        self._on_step = on_step
        self._orders: queue.SimpleQueue[tuple[Order, Future[None]]] = queue.SimpleQueue()
        self._tunes: queue.SimpleQueue[TuneOrder] = queue.SimpleQueue()
        self._pace = ReportPace(clock, period_ns=REPORT_PERIOD_NS)

    # Called from other threads -----------------------------------------------------------------------------

    def order(self, work: Order) -> "Future[None]":
        """Queue an order that the job executes between two looks; return its future."""
        done: Future[None] = Future()
        self._orders.put((work, done))
        return done

    def tune(self, order: TuneOrder) -> None:
        """Queue a tuning, which begins after the look under way."""
        self._tunes.put(order)

    # Called by its job -------------------------------------------------------------------------------------

    def run_while_free(self, context: JobContext) -> None:
        """Hold the rig until another job wants it or the loop is to end."""
        hardware = self._hardware
        if hardware.use.holder is not None or hardware.use.wanted:
            self.status = "waiting"
            self.stop_wanted.wait(WAIT_S)
            return
        gate = self.loop.gate
        if gate.in_a_row and self._orders.empty():  # without a session: other jobs can use the rig
            self._check(context)
            self.status = "trigger_fault"
            self.stop_wanted.wait(FAILED_PAUSE_S)
            if gate.latched:
                return
        with hardware.session(f"job {context.job.id}", cancelled=context.cancelled, gives_way=True) as head:
            while not (self.stop_wanted.is_set() or hardware.use.wanted):
                self._check(context)
                self._obey(head)
                if gate.latched:
                    return
                if self.split is None and self.loop.guide is None:
                    self.status = "initializing"
                    self.stop_wanted.wait(WAIT_S)
                    continue
                if self.split is not None:
                    self._look_apart(self.split, head)
                else:
                    self._tune_if_asked(head, context)
                    self._look(head, context)
                if gate.in_a_row:
                    return

    def close(self, error: FoveaError | None) -> None:
        """Fail all orders and tunings still queued."""
        reason = error or Cancelled("the loop has ended")
        while not self._orders.empty():
            self._orders.get()[1].set_exception(reason)
        while not self._tunes.empty():
            self._tunes.get().done.set_exception(reason)

    def _check(self, context: JobContext) -> None:
        context.check()
        if self._hardware.halted:
            raise refusals.stopped()

    def _obey(self, head: Head) -> None:
        while not self._orders.empty():
            work, done = self._orders.get()
            if not done.set_running_or_notify_cancel():
                continue
            try:
                work(head)
            except FoveaError as error:
                done.set_exception(error)
                if self._hardware.halted:
                    raise
            else:
                done.set_result(None)

    def _look(self, head: Head, context: JobContext) -> LoopStep:
        most_hz = self.loop.settings.most_hz
        due_ns = 0 if most_hz is None or self.last is None else self.last.t_ns + round(1e9 / most_hz)
        if (early_ns := due_ns - self._clock.now_ns()) > 0:
            self.stop_wanted.wait(early_ns / 1e9)
        step = self.loop.step(head)
        self.status = "auto_tune" if self.tune_job_id is not None else step.status.value
        self._keep(step)
        if self._pace.is_due():
            context.progress(self.looks, total=0, note=f"{self.rate_hz:.1f} looks a second")
        return step

    def _look_apart(self, split: SplitEyes, head: Head) -> None:
        settings, gate = self.loop.settings, self.loop.gate
        try:
            step = split.step(head, gains=settings.pan, sensitivity=settings.sensitivity)
        except FoveaError as error:
            if not gate.failed(error):
                raise
            self.status = "trigger_fault"
            return
        gate.passed()
        self._count(step.t_ns, None if self.split_step is None else self.split_step.t_ns)
        self.status, self.split_step = "split", step

    def _count(self, t_ns: int, before_ns: int | None) -> None:
        self.looks += 1
        if before_ns is not None and t_ns > before_ns:
            rate_hz = 1e9 / (t_ns - before_ns)
            self.rate_hz += (SMOOTHING if self.rate_hz else 1.0) * (rate_hz - self.rate_hz)

    def _keep(self, step: LoopStep) -> None:
        self._count(step.t_ns, None if self.last is None else self.last.t_ns)
        self.samples.append(sample_of(step, self.looks, self.status))
        if step.errors is not None:
            self.seen = step
        self.last = step
        self._on_step(step)

    def _tune_if_asked(self, head: Head, context: JobContext) -> None:
        if self._tunes.empty():
            return
        order = self._tunes.get()
        if not order.done.set_running_or_notify_cancel():
            return
        self.tune_job_id = order.context.job.id
        try:
            order.done.set_result(self._tuned(order, head, context))
        except FoveaError as error:
            order.done.set_exception(error)
            if self._hardware.halted:
                raise
        finally:
            self.tune_job_id = None

    def _tuned(self, order: TuneOrder, head: Head, context: JobContext) -> TuneResult:
        def step() -> LoopStep:
            order.context.check()
            self._check(context)
            if self.stop_wanted.is_set():
                raise Cancelled("the loop was ended while it was tuned; its gains are as before")
            if self._hardware.use.wanted:
                raise TuneRefused("another job wants the rig; tune again when it has ended")
            if self.loop.gate.latched:
                raise TuneRefused(f"exposures fail again and again: {self.loop.gate.reason}")
            return self._look(head, context)

        def report_progress(done: int, total: int) -> None:
            order.context.progress(done, total=total, note="candidates" if order.request.polish else "axes")

        return autotune(
            self.loop,
            step,
            polish=order.request.polish,
            candidates=order.request.candidates,
            on_progress=report_progress,
        )
