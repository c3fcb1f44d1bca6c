"""Runs computations that a request waits for, one at a time on a thread of their own.

Several at once would slow down each other, the live views and all requests, as they share the interpreter.
"""

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from typing import TypeVar

from foveacam_hardware.contract import Busy
from foveacam_hardware.contract.spans import span
from foveacam_server.foundation.watching.flows import count_flow, this_part

T = TypeVar("T")

MAX_WAITING = 16
PART = "foveacam-compute"
"""Name of the thread."""


class ComputeQueue:
    """First come, first served; used on the event loop alone."""

    def __init__(self) -> None:
        self._thread = ThreadPoolExecutor(1, thread_name_prefix=PART)
        self._waiting = 0

    async def run(self, work: Callable[[], T]) -> T:
        """Return the result of `work` when its turn has come; raise `Busy` when too many wait."""
        if self._waiting >= MAX_WAITING:
            raise Busy(
                f"{self._waiting} computations wait already, each for the one before it; ask again later",
                asked="one more computation",
                found=f"{self._waiting} waiting",
                remedy="ask again when one has been answered",
            )
        self._waiting += 1
        count_flow(this_part(), PART, "computations")
        context = copy_context()  # with ids and trace of the request
        try:
            return await asyncio.get_running_loop().run_in_executor(self._thread, context.run, _traced, work)
        finally:
            self._waiting -= 1

    def close(self) -> None:
        """Finish the computation that runs, drop those that wait."""
        self._thread.shutdown(cancel_futures=True)


def _traced(work: Callable[[], T]) -> T:
    with span("computation"):
        return work()
