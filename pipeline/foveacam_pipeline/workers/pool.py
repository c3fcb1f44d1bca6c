"""Pools of workers that compute the parts of a batch, with results returned in order.

A part depends on its arguments alone, so that a batch has the same results wherever it runs.
"""

from collections import deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import Future
from typing import ParamSpec, Protocol, TypeVar

from foveacam_hardware.contract import DeviceFault

T = TypeVar("T")
Result = TypeVar("Result", covariant=True)
P = ParamSpec("P")

AHEAD = 2
"""Parts queued for each worker: no worker idles, and few results are held in memory."""


class WorkersLost(DeviceFault):
    """Workers ended or became unreachable while a batch ran; the message gives the reason."""


class PartLost(WorkersLost):
    """Workers ended during a part; the pool continues with others."""


class Part(Protocol[Result]):
    """A part that a worker computes."""

    def done(self) -> bool:
        """Return whether the part has finished, failed or been cancelled."""

    def result(self) -> Result:
        """Wait for the result; raise the part's exception."""

    def cancel(self) -> object:
        """Cancel the part unless it has begun."""


class WorkPool(Protocol):
    """Workers that compute parts."""

    @property
    def most_under_way(self) -> int:
        """Number of parts to submit at a time."""

    def submit(self, work: Callable[P, T], *arguments: P.args, **named: P.kwargs) -> Part[T]:
        """Submit a part to a worker; raise WorkersLost."""

    def result(self, part: Part[T]) -> T:
        """Wait for the result of a part; raise WorkersLost or the part's exception."""


class HereAndNow:
    """Computes each part in this process, when it is submitted."""

    most_under_way = 1

    def submit(self, work: Callable[P, T], *arguments: P.args, **named: P.kwargs) -> Part[T]:
        """Compute the part."""
        part: Future[T] = Future()
        part.set_result(work(*arguments, **named))
        return part

    def result(self, part: Part[T]) -> T:
        """Return the result."""
        return part.result()


def results_in_order(
    pool: WorkPool, work: Callable[..., T], arguments: Iterable[tuple[object, ...]]
) -> Generator[T, None, None]:
    """Yield the results of a part for each tuple of arguments, in their order.

    Few parts are under way at a time, so that a batch can be left early; those are cancelled then. Raise
    WorkersLost.
    """
    waiting: deque[Part[T]] = deque()
    try:
        for given in arguments:
            waiting.append(pool.submit(work, *given))
            if len(waiting) >= pool.most_under_way:
                yield pool.result(waiting.popleft())
        while waiting:
            yield pool.result(waiting.popleft())
    finally:
        for part in waiting:
            part.cancel()
