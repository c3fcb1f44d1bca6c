"""What the thread of a camera does: commands first, then frames; when the device is lost, it opens it again.

`step` is one turn without a thread of its own, so that every fault can be played in virtual time.
"""

import logging
import queue
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

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
from foveacam_hardware.drivers.cameras.commands import Inbox
from foveacam_hardware.drivers.cameras.desk import CameraDesk
from foveacam_hardware.drivers.cameras.device import CameraDevice, ReadsItsClock
from foveacam_hardware.drivers.cameras.exposure_times import ExposureTimes
from foveacam_hardware.drivers.cameras.link import BackOff
from foveacam_hardware.drivers.cameras.ranges import refuse_outside
from foveacam_hardware.drivers.cameras.run import CameraRun
from foveacam_hardware.drivers.cameras.vendor_calls import VendorCalls
from foveacam_hardware.drivers.cameras.watchdog import Advice, Patience

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
class CameraPlan:
    """What a camera is opened with: its frames' size where the rig file tells, and its sensor's readout."""

    settings: CameraSettings
    readout_ns: int = 0
    """Used where the camera's clock cannot be read."""
    frames: int = 8
    """How many wait for their reader."""
    patience: Patience = field(default_factory=Patience)


class CameraWorker:
    """Owns the device. All methods but the constructor belong to one thread."""

    def __init__(
        self,
        role: Role,
        factory: Callable[[], CameraDevice],
        *,
        desk: CameraDesk,
        plan: CameraPlan,
        clock: Clock,
    ) -> None:
        self._role = role
        self._factory = factory
        self._desk = desk
        self._plan = plan
        self._patience = plan.patience
        self._clock = clock
        self.calls = VendorCalls(clock=clock)
        self.settings = plan.settings
        """What the device took; it is opened with this again."""
        self.info: DeviceInfo | None = None
        self._device: CameraDevice | None = None
        self.wanted = False
        """Whether it is to be open, and opened again."""
        self.streams = False
        """Whether it is to stream whenever it is open."""
        self._run: CameraRun | None = None
        self._next_seq = 0
        self._times = ExposureTimes()
        self._backoff = BackOff(
            first_ns=self._patience.backoff_first_ns, most_ns=self._patience.backoff_most_ns
        )
        self._attempt_ns = 0
        self._asked_ns = 0
        self.goes_on = True
        """False once it was closed: the thread ends."""

    @property
    def next_seq(self) -> int:
        """The number of the next frame."""
        return self._next_seq if self._run is None else self._run.next_seq

    def resume_from(self, before: "CameraWorker") -> None:
        """Take over what was wanted of another one, whose thread hangs."""
        self.settings, self.info = before.settings, before.info
        self._next_seq = before.next_seq
        self.wanted, self.streams = before.wanted, before.streams

    def give_back(self) -> None:
        """Close the device at the end of a thread that was given up; nobody hears of it."""
        device, self._device = self._device, None
        if device is not None:
            try:
                device.close()
            except FoveaError as error:
                logger.debug("camera %s: closing after all: %s", self._role, error)

    # Commands ---------------------------------------------------------------------------------------------

    def connect(self) -> None:
        """Open the device now; when that fails, go on trying behind the caller's back."""
        self.wanted = True
        if self._device is None:
            self._open()

    def close(self) -> None:
        """Give the device back, and try no more."""
        self.wanted = self.streams = False
        if self._device is not None:
            try:
                self._halt(self._device)
            except FoveaError as error:
                logger.debug("camera %s: stopping: %s", self._role, error)
        self._release()
        self._desk.go(CameraPhase.CLOSED, now_ns=self._clock.now_ns(), reason="closed")
        self.goes_on = False

    def configure(self, settings: CameraSettings) -> CameraSettings:
        """Apply the settings; refused ones leave everything as it was."""
        device = self._opened("configure")
        self._halt(device)
        try:
            self.settings = self._call("configure", lambda: device.configure(settings))
        except FAILURES:
            raise
        except FoveaError:
            self.settings = self._call("configure", lambda: device.configure(self.settings))
            self._resume(device)
            raise
        self._resume(device)
        return self.settings

    def start(self) -> None:
        """Begin to stream; the counters start again."""
        device = self._opened("start")
        if self._run is None:
            self._desk.clear(counters=True)
            self.streams = True
            self._stream(device)

    def stop(self) -> None:
        """Stop streaming; what was not read is gone."""
        self.streams = False
        if self._device is not None:
            self._halt(self._device)
        self._desk.clear()

    def trigger(self) -> None:
        """Expose once."""
        device = self._opened("expose")
        self._call("expose", device.software_trigger, within_ns=self._patience.alive_ns)
        if self._run is not None:
            self._run.await_exposure(self._clock.now_ns())

    # One turn ---------------------------------------------------------------------------------------------

    def step(self, inbox: "Inbox[CameraWorker]") -> None:
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
            if self._device is None:
                if self.wanted and now_ns >= self._attempt_ns:
                    self._open()
            elif self._run is not None:
                self._losing(self._look)
            elif now_ns - self._asked_ns >= self._patience.ask_ns:
                self._losing(self._ask)
        except FoveaError as error:
            logger.debug("camera %s: %s", self._role, error)  # the link tells it

    def _losing(self, work: Callable[[], T]) -> T:
        """Do something with the device; when the device fails, it is lost."""
        try:
            return work()
        except FAILURES as error:
            if self._device is not None:
                self._lose(str(error))
            raise

    def _look(self) -> None:
        """Wait a moment for a frame, and judge it or the silence."""
        device, run = self._device, self._run
        if device is None or run is None:
            return
        timeout_ms = 0.0 if run.waits_for_command else SLICE_MS
        within_ns = round(timeout_ms * 1e6) + GRAB_MARGIN_NS
        grab = self._call("deliver a frame", lambda: device.grab(timeout_ms=timeout_ms), within_ns=within_ns)
        now_ns = self._clock.now_ns()
        frame = None if grab is None else run.take(grab, now_ns=now_ns)
        if grab is None:
            self._judge_silence(run, now_ns)
        if run.underruns_due(now_ns):
            lost = self._call("count", device.underruns, within_ns=self._patience.alive_ns)
            run.count_underruns(lost, now_ns=now_ns)
        self._read_clock(device, now_ns)
        self._tell(run, now_ns)
        if frame is not None:  # last: its reader wakes up now, and wants the interpreter for itself
            self._backoff.reset()
            self._desk.put(frame)

    def _judge_silence(self, run: CameraRun, now_ns: int) -> None:
        run.silent(now_ns)
        advice = run.watchdog.advice(now_ns)
        if advice is Advice.ASK:
            self._ask()
            run.watchdog.answered(self._clock.now_ns())
        elif advice is Advice.LOST:
            silent_s = run.watchdog.silent_ns(now_ns) / 1e9
            raise NotConnected(
                f"no frame for {silent_s:.1f} s though it runs freely; check its cable and power"
            )

    def _ask(self) -> None:
        device = self._device
        self._asked_ns = self._clock.now_ns()
        if device is None:
            return
        if not self._call("read a register", device.alive, within_ns=self._patience.alive_ns):
            raise NotConnected("it does not answer any more; check its cable and power")

    def _tell(self, run: CameraRun, now_ns: int) -> None:
        trouble = run.trouble(now_ns)
        phase = CameraPhase.STREAMING if trouble is None else CameraPhase.DEGRADED
        self._desk.go(phase, now_ns=now_ns, reason=trouble or "")

    # The device -------------------------------------------------------------------------------------------

    def _open(self) -> None:
        """Open, configure and start as it was; undo everything when a part of it fails."""
        self._desk.go(CameraPhase.OPENING, now_ns=self._clock.now_ns())
        device = self._factory()
        self._device = device
        try:
            within_ns = self._patience.open_ns
            self.info = self._call("open", device.open, within_ns=within_ns)
            ranges = self._desk.ranges = self._call("tell its ranges", device.ranges)
            refuse_outside(self.settings, ranges, first=True)
            self.settings = self._call("configure", lambda: device.configure(self.settings))
            self._times = ExposureTimes(readout_ns=self._plan.readout_ns)
            self._read_clock(device, self._clock.now_ns())
        except FoveaError as error:
            self._lose(str(error))
            raise
        self._desk.go(CameraPhase.READY, now_ns=self._clock.now_ns())
        self._losing(lambda: self._resume(device))

    def _resume(self, device: CameraDevice) -> None:
        if self.streams:
            self._stream(device)

    def _stream(self, device: CameraDevice) -> None:
        self._call("start", device.start)
        now_ns = self._clock.now_ns()
        self._run = CameraRun(
            self._role,
            self.settings,
            desk=self._desk,
            times=self._times,
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
        self._call("stop", device.stop)
        self._desk.go(CameraPhase.READY, now_ns=self._clock.now_ns())

    def _forget_run(self) -> None:
        if self._run is not None:
            self._next_seq = self._run.next_seq
            self._run = None
        self._desk.clear()

    def _lose(self, reason: str) -> None:
        """Give up the device until the next attempt."""
        self._desk.go(CameraPhase.LOST, now_ns=self._clock.now_ns(), reason=reason)
        logger.info("camera %s: %s", self._role, reason)
        self._release()
        now_ns = self._clock.now_ns()
        self._attempt_ns = now_ns + self._backoff.pause_ns()
        self._desk.go(CameraPhase.BACKOFF, now_ns=now_ns)

    def _release(self) -> None:
        self._forget_run()
        device, self._device = self._device, None
        if device is not None:
            try:
                self._call("close", device.close)
            except FoveaError as error:
                logger.debug("camera %s: closing: %s", self._role, error)

    def _read_clock(self, device: CameraDevice, now_ns: int) -> None:
        if self._times.reading_due(now_ns) and isinstance(device, ReadsItsClock):
            reading = self._call("read its clock", device.read_clock, within_ns=self._patience.alive_ns)
            self._times.read(reading)

    def _opened(self, action: str) -> CameraDevice:
        if self._device is None:
            reason = self._desk.state.link.reason
            raise NotConnected(f"asked to {action}, but it is not connected: {reason}")
        return self._device

    def _call(self, name: str, call: Callable[[], T], *, within_ns: int | None = None) -> T:
        return self.calls.make(name, call, within_ns=within_ns or self._patience.call_ns)
