"""Runs computations for which a request waits, within limits, persons taking turns.

Those whose cost depends on the request run in child processes, which are killed beyond their limits; those
bounded by the server's own state run one at a time on a thread. Several at once would slow down the live
views and all requests, as threads share the interpreter.
"""

import asyncio
import queue
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from typing import TypeVar

from foveacam_hardware.contract.spans import span
from foveacam_server.foundation.computing.compute_worker import ComputeLimits, ComputeProcess
from foveacam_server.foundation.persons.person_quota import PERSON, Places
from foveacam_server.foundation.persons.person_turns import Turns
from foveacam_server.foundation.watching.flows import count_flow, this_part

T = TypeVar("T")
R = TypeVar("R")

MOST_OPEN, MOST_OPEN_EACH = 64, 16
"""Largest number of queued and running computations, of all persons and of one."""
PROCESSES = 2
"""Number of processes; one person uses only one at a time, so that the other is free for the next person."""
PART = "foveacam-compute"
"""Name of the threads."""


class ComputeQueue:
    """Queue of computations; to be used on the event loop only."""

    def __init__(self, modules: Sequence[str] = (), *, limits: ComputeLimits | None = None) -> None:
        """`modules`: modules of functions that run in processes, which import them at their start."""
        self.places = Places(
            "computations",
            most=MOST_OPEN,
            most_each=MOST_OPEN_EACH,
            remedy="ask again when one has been answered",
        )
        self._processes = tuple(
            ComputeProcess(modules, limits=limits or ComputeLimits()) for _ in range(PROCESSES)
        )
        self._idle: queue.LifoQueue[ComputeProcess] = queue.LifoQueue()
        for process in self._processes:
            self._idle.put(process)
        self._apart, self._here = Turns(PROCESSES, each=1), Turns(1, each=1)
        self._threads = ThreadPoolExecutor(PROCESSES + 1, thread_name_prefix=PART)

    async def run(self, work: Callable[[], R]) -> R:
        """Return the result of `work`, computed on a thread; its cost is bounded by the server's own state.

        Raise `PersonLimit` or `AllTaken` when too many wait.
        """
        with self.places.hold(PERSON.get()):
            async with self._here.turn():
                return await self._on_thread(work)

    async def run_apart(self, function: Callable[[T], R], argument: T) -> R:
        """Return the result of a module's function, computed in a process; raise its error.

        Raise `PersonLimit` or `AllTaken` when too many wait, InvalidInput beyond the limits of one.
        """
        with self.places.hold(PERSON.get()):
            async with self._apart.turn():
                return await self._on_thread(lambda: self._compute(function, argument))

    async def prepare(self) -> None:
        """Start the process of the next computation in advance, unless it runs: that takes half a second."""
        await self._on_thread(self._prepare)

    def end(self) -> None:
        """End the processes, which fails all waiting requests; called when the server shuts down."""
        for process in self._processes:
            process.kill()

    def close(self) -> None:
        """Kill the computations in processes, finish the one on the thread, drop queued ones."""
        self.end()
        self._threads.shutdown(cancel_futures=True)
        for process in self._processes:
            process.end()

    def _compute(self, function: Callable[[T], R], argument: T) -> R:
        process = self._idle.get()
        try:
            return process.compute(function, argument)
        finally:
            self._idle.put(process)

    def _prepare(self) -> None:
        process = self._idle.get()
        try:
            process.prepare()
        finally:
            self._idle.put(process)

    async def _on_thread(self, work: Callable[[], R]) -> R:
        count_flow(this_part(), PART, "computations")
        context = copy_context()  # keeps ids and trace of the request
        return await asyncio.get_running_loop().run_in_executor(self._threads, context.run, _traced, work)


def _traced(work: Callable[[], R]) -> R:
    with span("computation"):
        return work()
