"""Keeps the process small over days: few arenas of the C library's allocator."""

import contextlib
import ctypes

MOST_ARENAS = 2
"""By default every thread has its own, of 8 a core; freed pictures stay in each."""
_M_ARENA_MAX = -8
"""Of glibc's <malloc.h>."""


def bound_arenas() -> None:
    """Limit the allocator's arenas; called before threads start. Without glibc nothing happens."""
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL("libc.so.6").mallopt(_M_ARENA_MAX, MOST_ARENAS)
