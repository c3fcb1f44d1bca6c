"""Implements the contract's Camera over any `CameraDevice`: its own thread makes every call, with a deadline.

Callers never wait for the vendor's library longer than they allow. The thread's work is in `worker`.
"""

import concurrent.futures
import queue
import threading
from collections.abc import Callable, Iterator
from typing import TypeVar

from foveacam_hardware.contract import (
    CameraCounters,
    CameraLink,
    CameraPhase,
    CameraRanges,
    CameraSettings,
    Clock,
    DeviceFault,
    DeviceInfo,
    FoveaError,
    Frame,
    InvalidInput,
    NotConnected,
    OutOfRange,
    Role,
    Timeout,
    TriggerSource,
)
from foveacam_hardware.drivers.cameras.device import CameraDevice
from foveacam_hardware.drivers.cameras.held_device import CameraPlan
from foveacam_hardware.drivers.cameras.ranges import refuse_binning, refuse_outside
from foveacam_hardware.drivers.cameras.shared_state import CameraSharedState
from foveacam_hardware.drivers.cameras.vendor_calls import CallAbandoned, VendorCall
from foveacam_hardware.drivers.cameras.worker import CameraCommand, CameraWorker

T = TypeVar("T")

LATEST_TIMEOUT_MS = 1000.0
POLL_S = 0.1
"""Period at which a waiting caller checks whether the thread hangs."""
DOWN = (CameraPhase.LOST, CameraPhase.BACKOFF, CameraPhase.OPENING)


class SupervisedCamera:
    """The contract's Camera over any `CameraDevice`; any thread may call, each frame goes to one reader.

    `expected`: identity as far as known before opening. A lost camera is reopened automatically with all its
    settings; `connect` is only needed the first time.
    """

    def __init__(
        self,
        role: Role,
        device_factory: Callable[[], CameraDevice],
        *,
        clock: Clock,
        plan: CameraPlan,
        expected: DeviceInfo,
    ) -> None:
        self._role = role
        self._factory = device_factory
        self._clock = clock
        self._plan = plan
        self._expected = expected
        self._timeouts = plan.timeouts
        self._shared = CameraSharedState(frames=plan.frames)
        self._inbox: queue.SimpleQueue[CameraCommand] = queue.SimpleQueue()
        self._worker = self._new_worker()
        self._thread: threading.Thread | None = None
        self._lock = threading.Lock()

    # Properties -------------------------------------------------------------------------------------------

    @property
    def role(self) -> Role:
        """Role of the camera in the rig."""
        return self._role

    @property
    def info(self) -> DeviceInfo:
        """Identity of the camera."""
        return self._worker.info or self._expected

    @property
    def settings(self) -> CameraSettings:
        """Settings in force; before the first opening, the initial settings."""
        return self._worker.settings

    @property
    def counters(self) -> CameraCounters:
        """Frame statistics since `start`."""
        return self._shared.counters

    @property
    def waiting(self) -> int:
        """Number of unread frames."""
        with self._shared.changed:
            return self._shared.waiting

    @property
    def ranges(self) -> CameraRanges:
        """Accepted values of every setting; empty before the first opening."""
        return self._shared.ranges

    @property
    def link(self) -> CameraLink:
        """State of the link, and the reason when frames are not delivered."""
        return self._link_now(self._overdue_call())

    # Calls ------------------------------------------------------------------------------------------------

    def connect(self) -> None:
        """Open the device; wait only briefly for a camera that is known to be lost."""
        if self.link.phase not in (*DOWN, CameraPhase.CLOSED):
            return
        within_ns = self._timeouts.open_ns if self._thread is None else self._timeouts.reconnect_ns
        with self._lock:
            if self._thread is None:
                self._start_thread(self._worker)
        try:
            self._ask("connect", CameraWorker.connect, within_ns=within_ns)
        except (Timeout, DeviceFault) as error:
            raise NotConnected(str(error)) from error

    def close(self) -> None:
        """Release the device; do nothing when closed."""
        with self._lock:
            thread, self._thread = self._thread, None
        if thread is None:
            return
        try:
            self._ask("close", CameraWorker.close, within_ns=self._timeouts.call_ns)
        except Timeout:
            self._abandon()
            self._shared.go(CameraPhase.CLOSED, now_ns=self._clock.now_ns(), reason="closed")
        else:
            thread.join(self._timeouts.call_ns / 1e9)

    def configure(self, settings: CameraSettings) -> CameraSettings:
        """Apply the settings; return those in force."""
        self._require_open("configure", self.link)
        refuse_binning(f"camera {self._role}", settings, self._shared.ranges)
        try:
            refuse_outside(settings, self._shared.ranges)
        except OutOfRange as refused:
            raise OutOfRange(f"camera {self._role}: {refused}") from None
        return self._ask(
            "configure", lambda worker: worker.configure(settings), within_ns=self._timeouts.call_ns
        )

    def start(self) -> None:
        """Start delivering frames and reset the counters."""
        self._require_open("start", self.link)
        self._ask("start", CameraWorker.start, within_ns=self._timeouts.call_ns)

    def stop(self) -> None:
        """Stop delivering; do nothing when closed."""
        if self._thread is not None:
            self._ask("stop", CameraWorker.stop, within_ns=self._timeouts.call_ns)

    def software_trigger(self) -> None:
        """Queue one software trigger and return; a failure shows in `read` and `link`."""
        self._require_streaming("expose", self.link)
        settings = self.settings
        if not settings.triggered or settings.trigger_source is not TriggerSource.SOFTWARE:
            raise InvalidInput(
                f"camera {self._role}: asked to expose by software, but it runs freely or waits for its line;"
                " configure it as triggered by software"
            )
        # Not awaited: a caller that has to wake up twice would be late for its frame.
        done: concurrent.futures.Future[object] = concurrent.futures.Future()
        self._inbox.put(CameraCommand(name="expose", work=CameraWorker.trigger, done=done))

    def read(self, *, timeout_ms: float = 1000.0) -> Frame:
        """Return the oldest frame not yet read."""
        return self._await(self._shared.take_oldest, timeout_ms=timeout_ms)

    def latest(self, *, max_age_ms: float) -> Frame:
        """Return the newest frame, waiting for one when it is older than `max_age_ms`."""
        oldest_ns = self._clock.now_ns() - round(max_age_ms * 1e6)
        return self._await(
            lambda: self._shared.take_newest(oldest_ns=oldest_ns), timeout_ms=LATEST_TIMEOUT_MS
        )

    def frames(self, n: int, *, timeout_ms: float = 1000.0) -> Iterator[Frame]:
        """Yield the next `n` frames in order."""
        for _ in range(n):
            yield self.read(timeout_ms=timeout_ms)

    def _link_now(self, late: VendorCall | None) -> CameraLink:
        """Return the link; an overdue call counts as a loss that the thread has not reported yet."""
        link = self._shared.state.link
        if late is None or link.phase in (*DOWN, CameraPhase.CLOSED):
            return link
        reason = late.overdue(self._clock.now_ns()) or link.reason
        return CameraLink(phase=CameraPhase.LOST, since_ns=late.deadline_ns, reason=reason, epoch=link.epoch)

    # Waiting ----------------------------------------------------------------------------------------------

    def _await(self, take: Callable[[], Frame | None], *, timeout_ms: float) -> Frame:
        deadline_ns = self._clock.now_ns() + round(timeout_ms * 1e6)
        while True:
            late = self._overdue_call()  # before locking the shared state: it may have to replace the thread
            with self._shared.changed:
                self._require_streaming("read", self._link_now(late))
                frame = take()
                if frame is not None:
                    return frame
                left_s = (deadline_ns - self._clock.now_ns()) / 1e9
                if left_s <= 0.0:
                    raise Timeout(self._no_frame_message())
                self._shared.changed.wait(min(left_s, POLL_S))

    def _no_frame_message(self) -> str:
        if self.settings.triggered:
            return f"camera {self._role}: no trigger arrived in time; check the trigger cable, or trigger it"
        return f"camera {self._role}: no frame in time; allow more than its exposure and frame period"

    def _require_open(self, action: str, link: CameraLink) -> None:
        if link.phase in (*DOWN, CameraPhase.CLOSED):
            remedy = "connect it" if link.phase is CameraPhase.CLOSED else "it is tried again by itself"
            reason = link.reason or "it is being opened"
            raise NotConnected(
                f"camera {self._role}: asked to {action}, but it is not connected: {reason}; {remedy}"
            )

    def _require_streaming(self, action: str, link: CameraLink) -> None:
        self._require_open(action, link)
        if link.phase is CameraPhase.READY:
            raise InvalidInput(f"camera {self._role}: asked to {action}, but it is stopped; start it first")

    # The thread -------------------------------------------------------------------------------------------

    def _ask(self, name: str, work: Callable[[CameraWorker], T], *, within_ns: int) -> T:
        """Run a command on the thread and return its result; stop at the deadline or on an overdue call."""
        done: concurrent.futures.Future[object] = concurrent.futures.Future()
        self._inbox.put(CameraCommand(name=name, work=work, done=done))
        began_ns = self._clock.now_ns()
        try:
            return self._result(done, polls=max(1, round(within_ns / 1e9 / POLL_S)))  # type: ignore[return-value]  # the future of this very work
        except concurrent.futures.TimeoutError:
            done.cancel()
            took_s = (self._clock.now_ns() - began_ns) / 1e9
            late = self.link.reason or "its library has not answered yet"
            raise Timeout(
                f"camera {self._role}: asked to {name}, and it did not within {took_s:.1f} s: {late}"
            ) from None
        except FoveaError as error:
            raise type(error)(f"camera {self._role}: {error}") from error

    def _result(self, done: "concurrent.futures.Future[object]", *, polls: int) -> object:
        """Wait for a command's result, checking periodically whether the thread hangs in another call."""
        for _ in range(polls):
            try:
                return done.result(POLL_S)
            except concurrent.futures.TimeoutError:
                if not done.done() and self._overdue_call() is not None:
                    break
        return done.result(0.0)

    def _overdue_call(self) -> VendorCall | None:
        """Return the overdue vendor call, if any; replace a thread that has hung for too long."""
        call, now_ns = self._worker.calls.now, self._clock.now_ns()
        late = None if call is None else call.overdue(now_ns)
        if call is None or late is None:
            return None
        if now_ns > call.deadline_ns + self._timeouts.abandon_ns:
            with self._lock:
                if self._thread is not None and self._worker.calls.now is call:
                    self._replace(late, now_ns)
        return call

    def _replace(self, reason: str, now_ns: int) -> None:
        """Continue with a new thread and a new device in the state of the hanging one."""
        before = self._worker
        self._abandon()
        self._shared.clear()
        self._shared.go(CameraPhase.LOST, now_ns=now_ns, reason=reason)
        self._start_thread(before)

    def _start_thread(self, before: CameraWorker) -> None:
        """Start a thread that continues from a previous worker's state."""
        self._inbox = queue.SimpleQueue()
        self._worker = self._new_worker()
        self._worker.resume_from(before)
        self._thread = threading.Thread(
            target=_run_worker, args=(self._worker, self._inbox), name=f"camera-{self._role}", daemon=True
        )
        self._thread.start()

    def _abandon(self) -> None:
        self._worker.calls.abandon()

    def _new_worker(self) -> CameraWorker:
        return CameraWorker(
            self._role, self._factory, shared=self._shared, plan=self._plan, clock=self._clock
        )


def _run_worker(worker: CameraWorker, inbox: "queue.SimpleQueue[CameraCommand]") -> None:
    """Run the worker until it is closed or abandoned."""
    while worker.running:
        try:
            worker.step(inbox)
        except CallAbandoned:
            worker.close_abandoned()
            return
