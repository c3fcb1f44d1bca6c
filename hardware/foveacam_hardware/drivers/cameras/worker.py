"""What the thread of a camera does: commands first, then frames; when the device is lost, it opens it again.

`step` is one turn without a thread of its own, so that every fault can be played in virtual time. The device
itself, how it is opened and given up, stands in `held_device`.
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
"""How long a grab waits before commands are looked at again."""
GRAB_MARGIN_NS = 500_000_000
"""How much longer than asked a grab may take."""
IDLE_S = 0.05
COMMAND_S = 0.1
"""How long a camera that exposes on command is left alone before it is looked at."""
FAILURES = (NotConnected, DeviceFault, Timeout)
"""After these the device is closed and opened anew; others are the caller's mistakes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraCommand:
    """Something that a caller wants done by the thread."""

    name: str
    work: Callable[["CameraWorker"], object]
    done: "Future[object]"


class CommandInbox(Protocol):
    """Where commands wait; a queue."""

    def get(self, block: bool = True, timeout: float | None = None) -> CameraCommand:
        """Return the next command or raise `queue.Empty`."""
        ...


class CameraWorker:
    """Turns over one device. All methods but the constructor belong to one thread."""

    def __init__(
        self,
        role: Role,
        factory: Callable[[], CameraDevice],
        *,
        desk: CameraSharedState,
        plan: CameraPlan,
        clock: Clock,
    ) -> None:
        self._role = role
        self._desk = desk
        self._patience = plan.patience
        self._clock = clock
        self._held = HeldDevice(role, factory, desk=desk, plan=plan, clock=clock)
        self.wanted = False
        """Whether it is to be open, and opened again."""
        self.streams = False
        """Whether it is to stream whenever it is open."""
        self._run: CameraRun | None = None
        self._next_seq = 0
        self.goes_on = True
        """False once it was closed: the thread ends."""

    @property
    def settings(self) -> CameraSettings:
        """What the device took."""
        return self._held.settings

    @property
    def info(self) -> DeviceInfo | None:
        """Who it is; None before it was opened."""
        return self._held.info

    @property
    def calls(self) -> VendorCalls:
        """What the library is asked just now; any thread may look, and give it up."""
        return self._held.calls

    @property
    def next_seq(self) -> int:
        """The number of the next frame."""
        return self._next_seq if self._run is None else self._run.next_seq

    def resume_from(self, before: "CameraWorker") -> None:
        """Take over what was wanted of another one, whose thread hangs."""
        self._held.settings, self._held.info = before.settings, before.info
        self._next_seq = before.next_seq
        self.wanted, self.streams = before.wanted, before.streams

    def give_back(self) -> None:
        """Close the device at the end of a thread that was given up; nobody hears of it."""
        self._held.give_back()

    # Commands ---------------------------------------------------------------------------------------------

    def connect(self) -> None:
        """Open the device now; when that fails, go on trying behind the caller's back."""
        self.wanted = True
        if self._held.device is None:
            self._open()

    def close(self) -> None:
        """Give the device back, and try no more."""
        self.wanted = self.streams = False
        if self._held.device is not None:
            try:
                self._halt(self._held.device)
            except FoveaError as error:
                logger.debug("camera %s: stopping: %s", self._role, error)
        self._forget_run()
        self._held.release()
        self._desk.go(CameraPhase.CLOSED, now_ns=self._clock.now_ns(), reason="closed")
        self.goes_on = False

    def configure(self, settings: CameraSettings) -> CameraSettings:
        """Apply the settings; refused ones leave everything as it was."""
        device = self._held.opened("configure")
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
        """Begin to stream; the counters start again."""
        device = self._held.opened("start")
        if self._run is None:
            self._desk.clear(counters=True)
            self.streams = True
            self._stream(device)

    def stop(self) -> None:
        """Stop streaming; what was not read is gone."""
        self.streams = False
        if self._held.device is not None:
            self._halt(self._held.device)
        self._desk.clear()

    def trigger(self) -> None:
        """Expose once."""
        device = self._held.opened("expose")
        self._held.call("expose", device.software_trigger, within_ns=self._patience.alive_ns)
        if self._run is not None:
            self._run.await_exposure(self._clock.now_ns())

    # One turn ---------------------------------------------------------------------------------------------

    def step(self, inbox: CommandInbox) -> None:
        """Do the next thing: a command, an attempt to open, a frame, or a look whether the camera lives."""
        try:
            pause_s = self._pause_s()
            command = inbox.get(timeout=pause_s) if pause_s > 0.0 else inbox.get(block=False)
        except queue.Empty:
            self._go_on()
            return
        if not command.done.set_running_or_notify_cancel():
            return
        try:
            result = self._losing(lambda: command.work(self))
        except FoveaError as error:
            command.done.set_exception(error)
        else:
            command.done.set_result(result)

    def _pause_s(self) -> float:
        """Return how long commands are waited for; a camera that streams is waited for instead."""
        if self._run is not None:
            return COMMAND_S if self._run.waits_for_command else 0.0
        return IDLE_S

    def _go_on(self) -> None:
        now_ns = self._clock.now_ns()
        try:
            if self._held.device is None:
                if self.wanted and self._held.attempt_due(now_ns):
                    self._open()
            elif self._run is not None:
                self._losing(self._look)
            elif now_ns - self._held.asked_ns >= self._patience.ask_ns:
                self._losing(self._held.ask)
        except FoveaError as error:
            logger.debug("camera %s: %s", self._role, error)  # the link tells it

    def _losing(self, work: Callable[[], T]) -> T:
        """Do something with the device; when the device fails, it is lost."""
        try:
            return work()
        except FAILURES as error:
            if self._held.device is not None:
                self._forget_run()
                self._held.lose(str(error))
            raise

    def _look(self) -> None:
        """Wait a moment for a frame, and judge it or the silence."""
        device, run = self._held.device, self._run
        if device is None or run is None:
            return
        timeout_ms = 0.0 if run.waits_for_command else SLICE_MS
        within_ns = round(timeout_ms * 1e6) + GRAB_MARGIN_NS
        grab = self._held.call(
            "deliver a frame", lambda: device.grab(timeout_ms=timeout_ms), within_ns=within_ns
        )
        now_ns = self._clock.now_ns()
        frame = None if grab is None else run.take(grab, now_ns=now_ns)
        if grab is None:
            self._judge_silence(run, now_ns)
        if run.underruns_due(now_ns):
            lost = self._held.call("count", device.underruns, within_ns=self._patience.alive_ns)
            run.count_underruns(lost, now_ns=now_ns)
        if self._held.read_back_due(now_ns):
            run.adjust(self._held.read_back())
        self._held.read_clock(device, now_ns)
        self._tell(run, now_ns)
        if frame is not None:  # last: its reader wakes up now, and wants the interpreter for itself
            self._held.delivered()
            self._desk.put(frame)

    def _judge_silence(self, run: CameraRun, now_ns: int) -> None:
        run.silent(now_ns)
        advice = run.watchdog.advice(now_ns)
        if advice is WatchdogAdvice.ASK:
            self._held.ask()
            run.watchdog.answered(self._clock.now_ns())
        elif advice is WatchdogAdvice.LOST:
            silent_s = run.watchdog.silent_ns(now_ns) / 1e9
            raise NotConnected(
                f"no frame for {silent_s:.1f} s though it runs freely; check its cable and power"
            )

    def _tell(self, run: CameraRun, now_ns: int) -> None:
        trouble = run.trouble(now_ns)
        phase = CameraPhase.STREAMING if trouble is None else CameraPhase.DEGRADED
        self._desk.go(phase, now_ns=now_ns, reason=trouble or "")

    # The device -------------------------------------------------------------------------------------------

    def _open(self) -> None:
        """Open the device and start it as it was."""
        self._held.open()
        self._losing(lambda: self._resume(self._held.opened("start")))

    def _resume(self, device: CameraDevice) -> None:
        if self.streams:
            self._stream(device)

    def _stream(self, device: CameraDevice) -> None:
        self._held.call("start", device.start, within_ns=self._patience.run_ns)
        now_ns = self._clock.now_ns()
        self._run = CameraRun(
            self._role,
            self.settings,
            desk=self._desk,
            times=self._held.times,
            patience=self._patience,
            first_seq=self._next_seq,
            now_ns=now_ns,
        )
        self._desk.go(CameraPhase.STREAMING, now_ns=now_ns)

    def _halt(self, device: CameraDevice) -> None:
        """Stop the device; what waits is of the settings before."""
        if self._run is None:
            return
        self._forget_run()
        self._held.call("stop", device.stop, within_ns=self._patience.run_ns)
        self._desk.go(CameraPhase.READY, now_ns=self._clock.now_ns())

    def _forget_run(self) -> None:
        if self._run is not None:
            self._next_seq = self._run.next_seq
            self._run = None
        self._desk.clear()
