"""Measures the lag of the event loop, and the total time for which it was blocked.

Messages that a client sends while the loop is blocked wait in the socket, so that timeouts of silent clients
must subtract that time.
"""

import asyncio

from foveacam_server.rig.status import SlidingMaximum

WINDOW_S = 10.0
PERIOD_S = 0.05
"""Period of the timer; a block of the loop is underestimated by up to this time."""
BLOCK_NS = 100_000_000
"""Delay below which the loop does not count as blocked: a client that sends every 50 ms is read in time."""


def never_blocked() -> int:
    """Return 0, the blocked time without a loop."""
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
        """Return the total blocked time since the loop's start, including a present block.

        To be used in differences: between a client's last message and now.
        """
        due_s = self._due.when()  # read first: a block ending now may count twice, but is never missed
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
