"""Numba decorators of the project's kernels: without the GIL, cached on disk, sums not reassociated.

Numba caches beside the module, in NUMBA_CACHE_DIR when that is set, else in the user's cache folder.
Where none of them is writable or the disk is full, each process compiles the kernels again.
"""

import hashlib
import inspect
import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

from numba import njit
from numba.core.caching import FunctionCache, NullCache
from numba.core.dispatcher import Dispatcher
from numba.core.event import Listener, install_listener

_log = logging.getLogger(__name__)

_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
_PART_OPTIONS: dict[str, Any] = {**_OPTIONS, "no_cpython_wrapper": True}
"""Any: numba's stubs do not declare the options that omit wrappers."""


@lru_cache(maxsize=8)
def _folder_digest(folder: Path) -> str:
    """Return a hash of the sources in a folder."""
    digest = hashlib.blake2b(digest_size=8)
    for path in sorted(folder.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


class _KernelCache(FunctionCache):
    """Numba's cache of a function, except for two things.

    It is invalid when any module of the function's folder changes: numba checks the function's own file,
    although code of other modules is linked into it. A compiled function that cannot be stored is still used;
    `trouble` then holds the reason.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]  # numba's cache has no types
        self.trouble: str | None = None
        index = self._cache_file
        index._version = f"{index._version} {_folder_digest(Path(inspect.getfile(function)).parent)}"  # noqa: SLF001

    def save_overload(self, sig: object, data: object) -> None:
        """Store a compiled function, if that is possible."""
        try:
            super().save_overload(sig, data)  # type: ignore[no-untyped-call]
        except OSError as error:
            self.trouble = f"{self.cache_path}: {error.strerror or error}"
            _log.warning("a compiled kernel cannot be stored in %s", self.trouble)


def kernel(function: Callable[..., Any]) -> Any:  # noqa: ANN401 (numba ships no types)
    """Compile a function on its first call; it releases the GIL and is bit-reproducible."""
    return _cached(njit(**_OPTIONS)(function))


def part(function: Callable[..., Any]) -> Any:  # noqa: ANN401 (numba ships no types)
    """Compile a function that only kernels call, without the wrapper for calls from Python.

    It becomes part of the kernels that call it, and is cached with them.
    """
    return njit(**_PART_OPTIONS)(function)


def cached_part(function: Callable[..., Any]) -> Any:  # noqa: ANN401 (numba ships no types)
    """Compile a function as `part` does, and cache it separately, so that processes can share the work."""
    return _cached(part(function))


def _cached(dispatcher: Any) -> Any:  # noqa: ANN401 (numba ships no types)
    with suppress(RuntimeError):  # numba: "no locator available", that is, no folder to write the cache to
        dispatcher._cache = _KernelCache(dispatcher.py_func)  # noqa: SLF001 (numba offers no other way)
    return dispatcher


def is_cached(dispatcher: Any) -> bool:  # noqa: ANN401 (numba ships no types)
    """Return whether compiled code of a kernel is in the cache, for any processor."""
    try:
        return bool(dispatcher._cache._cache_file._load_index())  # noqa: SLF001 (numba offers no other way)
    except (AttributeError, OSError):
        return False


def cache_trouble(dispatcher: Any) -> str | None:  # noqa: ANN401 (numba ships no types)
    """Return why compiled code of a kernel cannot be stored; None where it can."""
    cache = dispatcher._cache  # noqa: SLF001 (numba offers no other way)
    if isinstance(cache, NullCache):
        return "no folder for compiled kernels can be written"
    return cache.trouble if isinstance(cache, _KernelCache) else None


def kernels_within(dispatcher: Any) -> set[str]:  # noqa: ANN401 (numba ships no types)
    """Return the names of a kernel and of all functions that are compiled with it."""
    found, waiting = {}, [dispatcher]
    while waiting:
        each = waiting.pop()
        found[_name(each)] = each
        named = map(each.py_func.__globals__.get, each.py_func.__code__.co_names)
        waiting += [part for part in named if isinstance(part, Dispatcher) and _name(part) not in found]
    return set(found)


@contextmanager
def compiling_watched(on_compiled: Callable[[str], None]) -> Iterator[None]:
    """Call `on_compiled` with the name of each kernel that this process compiles within the context."""

    def take(_: object, event: Any) -> None:  # noqa: ANN401 (numba ships no types)
        on_compiled(_name(event.data["dispatcher"]))

    listener = type("Compiled", (Listener,), {"on_start": lambda *_: None, "on_end": take})()
    with install_listener("numba:compile", listener):
        yield


def _name(dispatcher: Any) -> str:  # noqa: ANN401 (numba ships no types)
    return f"{dispatcher.py_func.__module__}.{dispatcher.py_func.__qualname__}"
