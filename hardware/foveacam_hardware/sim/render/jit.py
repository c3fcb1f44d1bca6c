"""How the renderer's kernels are compiled: no GIL, cached on disk, no reassociation of sums.

Numba caches beside the module, in NUMBA_CACHE_DIR when that is set, else in the user's cache folder;
where none of them can be written the kernels still work, and are compiled anew by each process.
"""

from collections.abc import Callable
from typing import Any

from numba import njit


def kernel(function: Callable[..., Any]) -> Any:  # numba ships no types: a dispatcher is Any
    """Compile a function on its first call; it releases the GIL and gives the same bits on every run."""
    try:
        return njit(nogil=True, cache=True, error_model="numpy")(function)
    except RuntimeError:  # numba: "no locator available", that is, no folder to write the cache to
        return njit(nogil=True, error_model="numpy")(function)
