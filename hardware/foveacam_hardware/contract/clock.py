"""Time as an argument: every timestamp of the product comes from one injected Clock."""

import time
from typing import Protocol


class Clock(Protocol):
    """A monotonic clock in nanoseconds that can also be waited on."""

    def now_ns(self) -> int:
        """Return the current time, ns, monotonic."""
        ...

    def sleep_until_ns(self, t_ns: int) -> None:
        """Return at `t_ns` or at once when it has passed."""
        ...


class MonotonicClock:
    """The machine's own monotonic clock."""

    def now_ns(self) -> int:
        """Return CLOCK_MONOTONIC, ns."""
        return time.monotonic_ns()

    def sleep_until_ns(self, t_ns: int) -> None:
        """Sleep until `t_ns`."""
        wait_ns = t_ns - self.now_ns()
        if wait_ns > 0:
            time.sleep(wait_ns / 1e9)


class VirtualClock:
    """Simulated time: sleeping moves it on at once, so that a test runs faster than the clock."""

    def __init__(self, start_ns: int = 0) -> None:
        self._now_ns = start_ns

    def now_ns(self) -> int:
        """Return the simulated time, ns."""
        return self._now_ns

    def sleep_until_ns(self, t_ns: int) -> None:
        """Jump to `t_ns`; never backwards."""
        self._now_ns = max(self._now_ns, t_ns)
