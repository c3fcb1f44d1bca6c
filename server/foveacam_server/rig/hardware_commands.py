"""Access of other threads to the rig: a bounded queue of commands, their results, a job's `Head`."""

import queue
import time
from collections.abc import Callable
from concurrent.futures import Future, InvalidStateError
from concurrent.futures import TimeoutError as FutureTimeout
from contextvars import Context, copy_context
from dataclasses import dataclass, field, replace
from typing import Generic, Protocol, TypeVar

from foveacam_hardware.contract import (
    Busy,
    Cancelled,
    FoveaError,
    Frame,
    LookOptions,
    Sighting,
    StereoVolts,
    Timeout,
)
from foveacam_hardware.contract.spans import note_span
from foveacam_server.foundation.watching import timings
from foveacam_server.foundation.watching.flows import HARDWARE, count_flow, this_part
from foveacam_server.rig.hardware_thread.moves import RigMoves
from foveacam_server.rig.ports import AssembledRig

T = TypeVar("T")

LENGTH = 32
COMMANDS = "commands"


@dataclass(frozen=True, slots=True)
class HardwareCommand(Generic[T]):
    """Work for the hardware thread, the future of its result, and the ids of its request and job."""

    work: Callable[[AssembledRig], T]
    answer: "Future[T]"
    put_s: float = field(default_factory=time.perf_counter)
    context: Context = field(default_factory=copy_context)

    def run(self, rig: AssembledRig) -> BaseException | None:
        """Run the work unless its future was cancelled; return the error that it raised."""
        if not self.answer.set_running_or_notify_cancel():
            return None
        waited_s = time.perf_counter() - self.put_s
        timings.QUEUE.observe(waited_s)
        self.context.run(note_span, "queue", took_s=waited_s)
        try:
            result = self.context.run(self.work, rig)
        except Exception as error:  # noqa: BLE001 - the future carries it, whatever it is; the thread goes on
            self.refuse(error)
            return error
        self.answer.set_result(result)
        return None

    def refuse(self, error: BaseException) -> None:
        """Set an error as the result."""
        try:
            self.answer.set_exception(error)
        except InvalidStateError:
            return  # cancelled meanwhile: nobody waits for it


class CommandQueue:
    """A bounded FIFO queue of commands."""

    def __init__(self) -> None:
        self._waiting: queue.Queue[HardwareCommand[object]] = queue.Queue(maxsize=LENGTH)
        self.idle_s = 0.0
        """Total time in which the hardware thread has waited for a command; written only by that thread."""

    @property
    def waiting(self) -> int:
        """Number of queued commands."""
        return self._waiting.qsize()

    def put(self, work: Callable[[AssembledRig], T]) -> "Future[T]":
        """Enqueue `work`; raise `Busy` when the queue is full."""
        answer: Future[T] = Future()
        command: HardwareCommand[object] = HardwareCommand(work, answer)  # type: ignore[arg-type]  # the queue mixes result types
        try:
            self._waiting.put_nowait(command)
        except queue.Full:
            count_flow(this_part(), HARDWARE, COMMANDS, passed=0, dropped=1)
            raise Busy(
                f"the rig has {LENGTH} commands waiting",
                found=f"{LENGTH} commands waiting",
                remedy="try again in a moment",
            ) from None
        count_flow(this_part(), HARDWARE, COMMANDS)
        return answer

    def take(self, *, timeout_s: float) -> HardwareCommand[object] | None:
        """Remove and return the next command; None on timeout."""
        begin_s = time.perf_counter()
        try:
            return self._waiting.get(timeout=timeout_s) if timeout_s > 0 else self._waiting.get_nowait()
        except queue.Empty:
            return None
        finally:
            self.idle_s += time.perf_counter() - begin_s

    def refuse_all(self, error: FoveaError) -> None:
        """Set `error` as the result of every queued command."""
        while (command := self.take(timeout_s=0.0)) is not None:
            command.refuse(error)


DEADLINE_S = 10.0
"""Timeout of a look for a job; the devices' own timeouts are far shorter."""


class CommandTaker(Protocol):
    """Access of a job's head to the hardware thread."""

    def check_may_move(self, *, one_eyed: bool = False) -> None:
        """Raise `Stopped` or `NotConnected` when the mirrors cannot move now."""
        ...

    def submit(self, work: Callable[[AssembledRig], T]) -> "Future[T]":
        """Enqueue any work with the rig."""
        ...

    def wide_frame(self, *, max_age_ms: float) -> "Future[Frame]":
        """Enqueue one wide frame."""
        ...


class RequestedLook:
    """Implements `PendingLook`: the answer of the hardware thread."""

    def __init__(self, answer: "Future[Sighting]") -> None:
        self._answer = answer

    def result(self) -> Sighting:
        """Wait for the frames of all three cameras."""
        return answer_of(self._answer, asked="a look")


class ExclusiveHead:
    """Implements `AheadHead` for one job: looks go through the hardware thread until it is cancelled."""

    def __init__(
        self, hardware: CommandTaker, moves: RigMoves, *, cancelled: Callable[[], bool], one_eyed: bool
    ) -> None:
        self._hardware = hardware
        self._moves = moves
        self._cancelled = cancelled
        self._one_eyed = one_eyed

    def look(self, volts: StereoVolts, *, options: LookOptions = LookOptions()) -> Sighting:
        """Steer, settle, expose, and return the frames of all three cameras."""
        return self.begin_look(volts, options=options).result()

    def begin_look(self, volts: StereoVolts, *, options: LookOptions = LookOptions()) -> RequestedLook:
        """Request a look without waiting for it; its frames feed the views."""
        self._check()
        asked = replace(options, one_eyed=self._one_eyed)
        self._hardware.check_may_move(one_eyed=asked.one_eyed)
        return RequestedLook(self._hardware.submit(lambda rig: self._moves.look(rig, volts, options=asked)))

    def wide(self, *, max_age_ms: float = 200.0) -> Frame:
        """Return a recent wide frame."""
        self._check()
        return answer_of(self._hardware.wide_frame(max_age_ms=max_age_ms), asked="a wide frame")

    def expose_foveae(self, *, exposure_ns: int, gain_db: float) -> None:
        """Set both foveae's exposure and gain; allowed to a cancelled job, to restore them."""

        def change(rig: AssembledRig) -> None:
            rig.head.expose_foveae(exposure_ns=exposure_ns, gain_db=gain_db)

        answer_of(self._hardware.submit(change), asked="another exposure")

    def set_low_pass(self, cutoff_hz: int) -> int:
        """Set the cut-off of the drive filters; allowed to a cancelled job, to restore it."""
        change = self._hardware.submit(lambda rig: rig.head.set_low_pass(cutoff_hz))
        return answer_of(change, asked="another filter")

    def _check(self) -> None:
        if self._cancelled():
            raise Cancelled("the job was cancelled before its next look")


def answer_of(answer: "Future[T]", *, asked: str, within_s: float = DEADLINE_S) -> T:
    """Return the result of a command; raise `Timeout` without one within `within_s`."""
    try:
        return answer.result(within_s)
    except FutureTimeout:
        answer.cancel()
        raise Timeout(
            f"asked the rig for {asked}: no answer within {within_s:g} s",
            asked=asked,
            found=f"no answer within {within_s:g} s",
            remedy="look at the devices' problems",
        ) from None
