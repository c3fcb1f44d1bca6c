"""Limits delays of the event loop and the stop, and memory: threads, garbage collection, arenas."""

import contextlib
import ctypes
import gc
import sys
from types import TracebackType
from typing import Any, cast

import anyio
from anyio._backends._asyncio import _default_thread_limiter

from foveacam_server.foundation.persons.person_quota import PERSON
from foveacam_server.foundation.persons.person_turns import Turns

REQUEST_THREADS, REQUEST_THREADS_EACH = 6, 4
"""Threads of requests, in all and of one person. Each computing thread delays the event loop: by 200 ms with
the framework's default of 40. Some stay free for others, whatever one person requests."""
SWITCH_S = 0.001
"""Switch interval: delay of the event loop and the stop by each computing thread; Python's default is 5
ms."""
MOST_ARENAS = 2
"""Number of malloc arenas; by default up to 8 per core, each of which retains freed pictures."""
_M_ARENA_MAX = -8
"""Constant of glibc's <malloc.h>."""


class PersonThreads(anyio.CapacityLimiter):
    """Limiter of the threads of requests, in all and per person; waiting persons take turns."""

    def __new__(cls) -> "PersonThreads":
        """Return an instance of this class, where the library would make its own."""
        return object.__new__(cls)

    def __init__(self) -> None:
        self._turns = Turns(REQUEST_THREADS, each=REQUEST_THREADS_EACH)

    async def __aenter__(self) -> None:
        """Wait for a thread."""
        await self._turns.begin(PERSON.get())

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Release the thread."""
        self._turns.end(PERSON.get())


def bound_threads() -> None:
    """Limit the threads of this event loop's requests; called on the loop."""
    # the library has no option for the class of its default limiter
    _default_thread_limiter.set(cast(Any, PersonThreads()))  # Any: of the library's own class
    sys.setswitchinterval(SWITCH_S)


def keep_start_objects() -> None:
    """Exclude all present objects from garbage collection; called once the rig is open.

    A full collection stops every thread: for 0.2 to 0.4 s with the 290 000 objects of a started server,
    all of which live until it ends.
    """
    gc.collect()
    gc.freeze()


def bound_arenas() -> None:
    """Limit the allocator's arenas; called before threads start. Without glibc nothing happens."""
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL("libc.so.6").mallopt(_M_ARENA_MAX, MOST_ARENAS)
