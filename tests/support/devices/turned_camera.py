"""A camera's worker turned by hand: no thread, virtual time, every command and every frame in its turn."""

import queue
from collections.abc import Callable
from concurrent.futures import Future
from typing import TypeVar

from foveacam_hardware.contract import CameraPhase, CameraSettings, Frame, Role, VirtualClock
from foveacam_hardware.drivers.cameras.held_device import CameraPlan
from foveacam_hardware.drivers.cameras.shared_state import CameraSharedState
from foveacam_hardware.drivers.cameras.worker import CameraCommand, CameraWorker
from tests.support.devices.fake_camera import READOUT_NS, SETTINGS, FakeCamera, FakeDevice

T = TypeVar("T")
S = 1_000_000_000


class VirtualInbox:
    """Commands of a test; waiting for one moves the clock on."""

    def __init__(self, clock: VirtualClock) -> None:
        self._clock = clock
        self._commands: list[CameraCommand] = []

    def put(self, command: CameraCommand) -> None:
        self._commands.append(command)

    def get(self, block: bool = True, timeout: float | None = None) -> CameraCommand:
        if self._commands:
            return self._commands.pop(0)
        if block:
            self._clock.sleep_until_ns(self._clock.now_ns() + round((timeout or 0.0) * S))
        raise queue.Empty


class Bench:
    """A worker, turned by hand."""

    def __init__(self, *, settings: CameraSettings = SETTINGS, frames: int = 8) -> None:
        self.clock = VirtualClock(100 * S)
        self.camera = FakeCamera(self.clock)
        self.shared = CameraSharedState(frames=frames)
        self.inbox = VirtualInbox(self.clock)
        self.worker = CameraWorker(
            Role.LEFT,
            lambda: FakeDevice(self.camera),
            shared=self.shared,
            plan=CameraPlan(settings=settings, readout_ns=READOUT_NS, frames=frames),
            clock=self.clock,
        )

    def do(self, work: Callable[[CameraWorker], T]) -> T:
        """Let the worker do a command in its next turn."""
        done: Future[object] = Future()
        self.inbox.put(CameraCommand(name="test", work=work, done=done))
        self.worker.step(self.inbox)
        return done.result(0.0)  # type: ignore[return-value]  # the future of this very work

    def streaming(self) -> "Bench":
        self.do(CameraWorker.connect)
        self.do(CameraWorker.start)
        return self

    def turn_until(self, reached: Callable[[], bool], *, within_s: float) -> float:
        """Turn until something is so; return how long that took, s."""
        began_ns = self.clock.now_ns()
        while not reached():
            self.worker.step(self.inbox)
            assert self.clock.now_ns() - began_ns <= within_s * S, f"not within {within_s} s: {self.phase}"
        return (self.clock.now_ns() - began_ns) / S

    def turn_for(self, seconds: float) -> None:
        until_ns = self.clock.now_ns() + round(seconds * S)
        while self.clock.now_ns() < until_ns:
            self.worker.step(self.inbox)

    def frame(self, *, within_s: float = 1.0) -> Frame:
        self.turn_until(lambda: self.shared.waiting > 0, within_s=within_s)
        frame = self.shared.take_oldest()
        assert frame is not None
        return frame

    @property
    def phase(self) -> CameraPhase:
        return self.shared.state.link.phase

    def is_down(self) -> bool:
        return self.phase in (CameraPhase.LOST, CameraPhase.BACKOFF)

    def is_up(self) -> bool:
        return self.phase is CameraPhase.STREAMING
