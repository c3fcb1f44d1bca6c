"""Numba decorators of the project's kernels: without the GIL, cached on disk, sums not reassociated.

Numba caches beside the module, in NUMBA_CACHE_DIR when that is set, else in the user's cache folder.
Where none of them is writable, each process compiles the kernels again.
"""

import hashlib
import inspect
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

from numba import njit


@lru_cache(maxsize=8)
def _folder_digest(folder: Path) -> str:
    """Return a hash of the sources in a folder."""
    digest = hashlib.blake2b(digest_size=8)
    for path in sorted(folder.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _invalidate_with_folder(dispatcher: Any, folder: Path) -> None:  # noqa: ANN401 (numba ships no types)
    """Invalidate the cached code of a kernel when any module of its folder changes.

    Numba checks the kernel's own file only, although code of other modules is linked into it.
    """
    try:
        index = dispatcher._cache._cache_file  # noqa: SLF001 (numba offers no other way)
        index._version = f"{index._version} {_folder_digest(folder)}"  # noqa: SLF001
    except (AttributeError, OSError):
        return


def kernel(function: Callable[..., Any]) -> Any:  # noqa: ANN401 (numba ships no types)
    """Compile a function on its first call; it releases the GIL and is bit-reproducible."""
    try:
        dispatcher = njit(nogil=True, cache=True, error_model="numpy")(function)
    except RuntimeError:  # numba: "no locator available", that is, no folder to write the cache to
        return njit(nogil=True, error_model="numpy")(function)
    _invalidate_with_folder(dispatcher, Path(inspect.getfile(function)).parent)
    return dispatcher


def inlined(function: Callable[..., Any]) -> Any:  # noqa: ANN401 (numba ships no types)
    """Inline a function into each kernel that calls it, which saves compiling it separately."""
    return njit(inline="always", error_model="numpy")(function)
