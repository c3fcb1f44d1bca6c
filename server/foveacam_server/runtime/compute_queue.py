"""Computations that a request waits for, one at a time on a thread of their own.

Several at once would slow each other, the live views and every other request: they share the interpreter.
"""

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from foveacam_hardware.contract import Busy

T = TypeVar("T")

MOST_WAITING = 16


class ComputeQueue:
    """Takes turns; used on the event loop alone."""

    def __init__(self) -> None:
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="foveacam-compute")
        self._waiting = 0

    async def run(self, work: Callable[[], T]) -> T:
        """Return what `work` gives when its turn has come; raise `Busy` when too many wait."""
        if self._waiting >= MOST_WAITING:
            raise Busy(
                f"{self._waiting} computations wait already, each for the one before it; ask again later",
                asked="one more computation",
                found=f"{self._waiting} waiting",
                remedy="ask again when one has been answered",
            )
        self._waiting += 1
        try:
            return await asyncio.get_running_loop().run_in_executor(self._thread, work)
        finally:
            self._waiting -= 1

    def close(self) -> None:
        """Let the computation under way end, those that wait be dropped."""
        self._thread.shutdown(cancel_futures=True)
