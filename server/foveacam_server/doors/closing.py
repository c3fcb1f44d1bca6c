"""Closes services in the reverse order of their opening; a hanging one does not block the others."""

import asyncio
import logging
import threading
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import AbstractContextManager
from typing import TypeVar

from foveacam_hardware.contract import FoveaError

_log = logging.getLogger(__name__)
T = TypeVar("T")

CLOSE_S = 30.0
"""Time for closing when the process is not ending."""
LEAST_S = 0.05
"""Least time for each service; most need a few milliseconds."""


def full_time() -> float:
    """Return the time for closing when the process is not ending."""
    return CLOSE_S


class ClosingStack:
    """Services to close, last opened first, each on a thread of its own and with a time limit."""

    def __init__(self) -> None:
        self._steps: list[tuple[str, Callable[[], object]]] = []

    def callback(self, close: Callable[[], object]) -> None:
        """Register the function that closes a service."""
        self._steps.append((getattr(close, "__qualname__", repr(close)), close))

    def enter_context(self, context: AbstractContextManager[T]) -> T:
        """Enter a context and register its exit."""
        entered = context.__enter__()
        self._steps.append((f"{type(entered).__name__}.close", lambda: context.__exit__(None, None, None)))
        return entered

    def close(self, left_s: Callable[[], float] = full_time) -> list[str]:
        """Close all services; return the names of those that did not end in time.

        `left_s` returns the time left for all of them. Each service is given half of it, then the next one is
        closed in parallel; at the end the rest of the time goes to those that are not done.
        """
        steps, self._steps = self._steps, []
        threads = []
        for name, close in reversed(steps):
            thread = threading.Thread(target=_attempt, args=(name, close), name=name, daemon=True)
            thread.start()
            thread.join(max(LEAST_S, left_s() / 2))
            threads.append(thread)
        for thread in threads:
            thread.join(max(0.0, left_s()))
        return [thread.name for thread in threads if thread.is_alive()]


def _attempt(name: str, close: Callable[[], object]) -> None:
    try:
        close()
    except FoveaError as error:
        _log.warning("%s: %s", name, error)
    except Exception:  # noqa: BLE001 - a thread's outermost frame: the other services are closed too
        _log.exception("%s failed", name)


async def run_beside(work: Callable[[], T]) -> T:
    """Run `work` on a separate thread, as those of pools may be busy.

    The event loop must go on: a closing service may join threads that still hand work to it.
    """
    done: Future[T] = Future()

    def run() -> None:
        try:
            done.set_result(work())
        except Exception as error:  # noqa: BLE001 - raised by who waits
            done.set_exception(error)

    threading.Thread(target=run, name="foveacam-closing", daemon=True).start()
    return await asyncio.wrap_future(done)
