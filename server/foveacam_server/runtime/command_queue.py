"""Work for the hardware thread: bounded, in order, each with its answer."""

import queue
from collections.abc import Callable
from concurrent.futures import Future, InvalidStateError
from dataclasses import dataclass
from typing import Generic, TypeVar

from foveacam_hardware.contract import Busy, FoveaError
from foveacam_server.runtime.ports import AssembledRig

T = TypeVar("T")

LENGTH = 32


@dataclass(frozen=True, slots=True)
class HardwareCommand(Generic[T]):
    """One piece of work and where its answer goes."""

    work: Callable[[AssembledRig], T]
    answer: "Future[T]"

    def run(self, rig: AssembledRig) -> BaseException | None:
        """Do the work unless nobody waits for it any more; return what went wrong."""
        if not self.answer.set_running_or_notify_cancel():
            return None
        try:
            result = self.work(rig)
        except Exception as error:  # noqa: BLE001 - whoever waits gets it, whatever it is; the thread lives on
            self.refuse(error)
            return error
        self.answer.set_result(result)
        return None

    def refuse(self, error: BaseException) -> None:
        """Answer with an error."""
        try:
            self.answer.set_exception(error)
        except InvalidStateError:
            return  # cancelled meanwhile: nobody listens


class CommandQueue:
    """First come, first served; full means busy."""

    def __init__(self) -> None:
        self._waiting: queue.Queue[HardwareCommand[object]] = queue.Queue(maxsize=LENGTH)

    def put(self, work: Callable[[AssembledRig], T]) -> "Future[T]":
        """Enqueue `work`; raise `Busy` when too much waits already."""
        answer: Future[T] = Future()
        command: HardwareCommand[object] = HardwareCommand(work, answer)  # type: ignore[arg-type]  # the queue mixes result types
        try:
            self._waiting.put_nowait(command)
        except queue.Full:
            raise Busy(
                f"the rig has {LENGTH} commands waiting; try again in a moment",
                found=f"{LENGTH} commands waiting",
                remedy="try again in a moment",
            ) from None
        return answer

    def take(self, *, timeout_s: float) -> HardwareCommand[object] | None:
        """Return the next command, or None when none came in time."""
        try:
            return self._waiting.get(timeout=timeout_s) if timeout_s > 0 else self._waiting.get_nowait()
        except queue.Empty:
            return None

    def refuse_all(self, error: FoveaError) -> None:
        """Answer everything that waits with `error`."""
        while (command := self.take(timeout_s=0.0)) is not None:
            command.refuse(error)
