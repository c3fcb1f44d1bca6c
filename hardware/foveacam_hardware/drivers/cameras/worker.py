"""The work of a camera's thread: commands first, then frames; a lost device is opened again.

`step` is one iteration, callable without a thread, so that tests can play every fault in virtual time.
Opening and closing the device is left to `held_device`.
"""

import logging
import queue
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Protocol, TypeVar

from foveacam_hardware.contract import (
    CameraPhase,
    CameraSettings,
    Clock,
    DeviceFault,
    DeviceInfo,
    FoveaError,
    NotConnected,
    Role,
    Timeout,
)
from foveacam_hardware.drivers.cameras.device import CameraDevice
from foveacam_hardware.drivers.cameras.held_device import CameraPlan, HeldDevice
from foveacam_hardware.drivers.cameras.run import CameraRun
from foveacam_hardware.drivers.cameras.shared_state import CameraSharedState
from foveacam_hardware.drivers.cameras.vendor_calls import VendorCalls
from foveacam_hardware.drivers.cameras.watchdog import WatchdogAdvice

logger = logging.getLogger(__name__)

T = TypeVar("T")

SLICE_MS = 20.0
"""Longest wait of a grab before commands are checked again."""
GRAB_MARGIN_NS = 500_000_000
"""How much longer than its timeout a grab may take."""
IDLE_S = 0.05
COMMAND_S = 0.1
"""Wait for commands between checks of a camera that exposes on software triggers."""
FAILURES = (NotConnected, DeviceFault, Timeout)
"""Errors after which the device is closed and reopened; others are the caller's mistakes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraCommand:
    """A call that the thread makes on behalf of a caller."""

    name: str
    work: Callable[["CameraWorker"], object]
    done: "Future[object]"


class CommandInbox(Protocol):
    """The queue of waiting commands."""

    def get(self, block: bool = True, timeout: float | None = None) -> CameraCommand:
        """Return the next command or raise `queue.Empty`."""
        ...


class CameraWorker:
    """Runs one device. All methods except the constructor are called by one thread."""

    def __init__(
        self,
        role: Role,
        factory: Callable[[], CameraDevice],
        *,
        shared: CameraSharedState,
        plan: CameraPlan,
        clock: Clock,
    ) -> None:
        self._role = role
        self._shared = shared
        self._timeouts = plan.timeouts
        self._clock = clock
        self._held = HeldDevice(role, factory, shared=shared, plan=plan, clock=clock)
        self.wanted = False
        """Whether the device should be open, and be reopened after a loss."""
        self.streams = False
        """Whether the device should stream whenever it is open."""
        self._run: CameraRun | None = None
        self._next_seq = 0
        self.running = True
        """False once it was closed, which ends the thread."""

    @property
    def settings(self) -> CameraSettings:
        """Settings in force."""
        return self._held.settings

    @property
    def info(self) -> DeviceInfo | None:
        """Identity of the camera; None before the first opening."""
        return self._held.info

    @property
    def calls(self) -> VendorCalls:
        """The vendor call in progress; any thread may read or abandon it."""
        return self._held.calls

    @property
    def next_seq(self) -> int:
        """Number of the next frame."""
        return self._next_seq if self._run is None else self._run.next_seq

    def resume_from(self, before: "CameraWorker") -> None:
        """Take over the state of another worker, whose thread hangs."""
        self._held.settings, self._held.info = before.settings, before.info
        self._next_seq = before.next_seq
        self.wanted, self.streams = before.wanted, before.streams

    def close_abandoned(self) -> None:
        """Close the device at the end of an abandoned thread."""
        self._held.close_abandoned()

    # Commands ---------------------------------------------------------------------------------------------

    def connect(self) -> None:
        """Open the device now; when that fails, keep trying in the background."""
        self.wanted = True
        if self._held.device is None:
            self._open()

    def close(self) -> None:
        """Close the device and stop trying to open it."""
        self.wanted = self.streams = False
        if self._held.device is not None:
            try:
                self._halt(self._held.device)
            except FoveaError as error:
                logger.debug("camera %s: stopping: %s", self._role, error)
        self._forget_run()
        self._held.release()
        self._shared.go(CameraPhase.CLOSED, now_ns=self._clock.now_ns(), reason="closed")
        self.running = False

    def configure(self, settings: CameraSettings) -> CameraSettings:
        """Apply the settings; when they are refused, restore the previous ones and raise."""
        device = self._held.require_open("configure")
        self._halt(device)
        try:
            self._held.configure(settings)
        except FAILURES:
            raise
        except FoveaError:
            self._held.configure(self.settings)
            self._resume(device)
            raise
        self._resume(device)
        return self.settings

    def start(self) -> None:
        """Start streaming and reset the counters."""
        device = self._held.require_open("start")
        if self._run is None:
            self._shared.clear(counters=True)
            self.streams = True
            self._stream(device)

    def stop(self) -> None:
        """Stop streaming and discard unread frames."""
        self.streams = False
        if self._held.device is not None:
            self._halt(self._held.device)
        self._shared.clear()

    def trigger(self) -> None:
        """Send one software trigger."""
        device = self._held.require_open("expose")
        self._held.call("expose", device.software_trigger, within_ns=self._timeouts.alive_ns)
        if self._run is not None:
            self._run.await_exposure(self._clock.now_ns())

    # One iteration ----------------------------------------------------------------------------------------

    def step(self, inbox: CommandInbox) -> None:
        """Execute the next command, or attempt to open, grab a frame, or check that the camera is alive."""
        try:
            pause_s = self._pause_s()
            command = inbox.get(timeout=pause_s) if pause_s > 0.0 else inbox.get(block=False)
        except queue.Empty:
            self._idle_step()
            return
        if not command.done.set_running_or_notify_cancel():
            return
        try:
            result = self._close_on_failure(lambda: command.work(self))
        except FoveaError as error:
            command.done.set_exception(error)
        else:
            command.done.set_result(result)

    def _pause_s(self) -> float:
        """Return the wait for a command; 0 for a streaming camera, whose grab waits instead."""
        if self._run is not None:
            return COMMAND_S if self._run.waits_for_command else 0.0
        return IDLE_S

    def _idle_step(self) -> None:
        now_ns = self._clock.now_ns()
        try:
            if self._held.device is None:
                if self.wanted and self._held.attempt_due(now_ns):
                    self._open()
            elif self._run is not None:
                self._close_on_failure(self._grab_frame)
            elif now_ns - self._held.asked_ns >= self._timeouts.ask_ns:
                self._close_on_failure(self._held.check_alive)
        except FoveaError as error:
            logger.debug("camera %s: %s", self._role, error)  # the link shows it

    def _close_on_failure(self, work: Callable[[], T]) -> T:
        """Do something with the device; when the device fails, close it for a later attempt and raise."""
        try:
            return work()
        except FAILURES as error:
            if self._held.device is not None:
                self._forget_run()
                self._held.lose(str(error))
            raise

    def _grab_frame(self) -> None:
        """Wait briefly for a frame; deliver it, or react to the silence."""
        device, run = self._held.device, self._run
        if device is None or run is None:
            return
        timeout_ms = 0.0 if run.waits_for_command else SLICE_MS
        within_ns = round(timeout_ms * 1e6) + GRAB_MARGIN_NS
        grab = self._held.call(
            "deliver a frame", lambda: device.grab(timeout_ms=timeout_ms), within_ns=within_ns
        )
        now_ns = self._clock.now_ns()
        frame = None if grab is None else run.make_frame(grab, now_ns=now_ns)
        if grab is None:
            self._judge_silence(run, now_ns)
        if run.underruns_due(now_ns):
            lost = self._held.call("count", device.underruns, within_ns=self._timeouts.alive_ns)
            run.count_underruns(lost, now_ns=now_ns)
        if self._held.read_back_due(now_ns):
            run.adjust(self._held.read_back())
        self._held.read_clock(device, now_ns)
        self._update_phase(run, now_ns)
        if frame is not None:  # last: it wakes the reader, which then needs the interpreter lock
            self._held.note_delivery()
            self._shared.put(frame)

    def _judge_silence(self, run: CameraRun, now_ns: int) -> None:
        run.expire_triggers(now_ns)
        advice = run.watchdog.advice(now_ns)
        if advice is WatchdogAdvice.ASK:
            self._held.check_alive()
            run.watchdog.note_answer(self._clock.now_ns())
        elif advice is WatchdogAdvice.LOST:
            silent_s = run.watchdog.silent_ns(now_ns) / 1e9
            raise NotConnected(
                f"no frame for {silent_s:.1f} s though it runs freely; check its cable and power"
            )

    def _update_phase(self, run: CameraRun, now_ns: int) -> None:
        reason = run.degradation(now_ns)
        phase = CameraPhase.STREAMING if reason is None else CameraPhase.DEGRADED
        self._shared.go(phase, now_ns=now_ns, reason=reason or "")

    # Device -----------------------------------------------------------------------------------------------

    def _open(self) -> None:
        """Open the device and resume streaming if it should stream."""
        self._held.open()
        self._close_on_failure(lambda: self._resume(self._held.require_open("start")))

    def _resume(self, device: CameraDevice) -> None:
        if self.streams:
            self._stream(device)

    def _stream(self, device: CameraDevice) -> None:
        self._held.call("start", device.start, within_ns=self._timeouts.run_ns)
        now_ns = self._clock.now_ns()
        self._run = CameraRun(
            self._role,
            self.settings,
            shared=self._shared,
            times=self._held.times,
            timeouts=self._timeouts,
            first_seq=self._next_seq,
            now_ns=now_ns,
            host_averages=self._held.host_averages,
        )
        self._shared.go(CameraPhase.STREAMING, now_ns=now_ns)

    def _halt(self, device: CameraDevice) -> None:
        """Stop the device and discard its buffered frames."""
        if self._run is None:
            return
        self._forget_run()
        self._held.call("stop", device.stop, within_ns=self._timeouts.run_ns)
        self._shared.go(CameraPhase.READY, now_ns=self._clock.now_ns())

    def _forget_run(self) -> None:
        if self._run is not None:
            self._next_seq = self._run.next_seq
            self._run = None
        self._shared.clear()
