"""Measures how late the event loop calls what is due, and for how long it read nothing.

What a client sends while the loop is blocked waits in its socket. Whoever judges a client by its silence
leaves that time out.
"""

import asyncio

from foveacam_server.rig.status import SlidingMaximum

WINDOW_S = 10.0
PERIOD_S = 0.05
"""Of the timer: a block of the loop is measured as up to this much shorter."""
BLOCK_NS = 100_000_000
"""A shorter delay is none: a client that says something every 50 ms is heard in time."""


def never_blocked() -> int:
    """Return the time for which no loop was blocked: none."""
    return 0


class LoopLag:
    """A timer of the event loop that measures its own delay, until closed; any thread may read it."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._lags_ns = SlidingMaximum(round(1e9 * WINDOW_S))
        self._blocked_ns = 0
        self._due = self._next()

    def worst_ms(self) -> float | None:
        """Return the longest delay of the last `WINDOW_S`; None before the first measurement."""
        largest_ns = self._lags_ns.largest(round(1e9 * self._loop.time()))
        return None if largest_ns is None else largest_ns / 1e6

    def blocked_ns(self) -> int:
        """Return for how long the loop has been blocked since its start, with a block that goes on.

        Differences of it count: from when a client was heard until now.
        """
        due_s = self._due.when()  # first: a block that ends in between counts twice for a moment, never not
        return _block_ns(round(1e9 * (self._loop.time() - due_s))) + self._blocked_ns

    def close(self) -> None:
        """End the timer; from any thread while the loop runs."""
        self._loop.call_soon_threadsafe(lambda: self._due.cancel())

    def _next(self) -> asyncio.TimerHandle:
        return self._loop.call_later(PERIOD_S, self._measure)

    def _measure(self) -> None:
        now_s = self._loop.time()
        lag_ns = round(1e9 * (now_s - self._due.when()))
        self._lags_ns.add(lag_ns, t_ns=round(1e9 * now_s))
        self._blocked_ns += _block_ns(lag_ns)
        self._due = self._next()


def _block_ns(lag_ns: int) -> int:
    return lag_ns if lag_ns > BLOCK_NS else 0
