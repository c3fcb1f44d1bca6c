"""Measures how late the event loop calls what is due."""

import asyncio

from foveacam_server.rig.status import SlidingMaximum

WINDOW_S = 10.0
PERIOD_S = 0.2
"""Of the timer: a block of the loop is measured as up to this much shorter."""


class LoopLag:
    """A timer of the event loop that measures its own delay, until closed; any thread may read it."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._lags_ns = SlidingMaximum(round(1e9 * WINDOW_S))
        self._due = self._next()

    def worst_ms(self) -> float | None:
        """Return the longest delay of the last `WINDOW_S`; None before the first measurement."""
        largest_ns = self._lags_ns.largest(round(1e9 * self._loop.time()))
        return None if largest_ns is None else largest_ns / 1e6

    def close(self) -> None:
        """End the timer; from any thread while the loop runs."""
        self._loop.call_soon_threadsafe(lambda: self._due.cancel())

    def _next(self) -> asyncio.TimerHandle:
        return self._loop.call_later(PERIOD_S, self._measure)

    def _measure(self) -> None:
        now_s = self._loop.time()
        self._lags_ns.add(round(1e9 * (now_s - self._due.when())), t_ns=round(1e9 * now_s))
        self._due = self._next()
