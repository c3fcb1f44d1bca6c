"""Limits what delays the event loop and the stop, and what memory keeps: threads, collection, arenas."""

import contextlib
import ctypes
import gc
import sys

import anyio.to_thread

REQUEST_THREADS = 6
"""Each thread that computes delays the event loop: by 200 ms with the framework's default of 40."""
SWITCH_S = 0.001
"""Delay of the event loop and the stop by each thread that computes; Python's default is 5 ms."""
MOST_ARENAS = 2
"""By default every thread has its own, of 8 a core; freed pictures stay in each."""
_M_ARENA_MAX = -8
"""Of glibc's <malloc.h>."""


def bound_threads() -> None:
    """Limit the threads of this event loop's requests; called on the loop."""
    anyio.to_thread.current_default_thread_limiter().total_tokens = REQUEST_THREADS
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
