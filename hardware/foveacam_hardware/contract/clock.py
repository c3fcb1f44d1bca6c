"""The injected clock from which every timestamp is taken, in real and in simulated time."""

import time
from typing import Protocol


class Clock(Protocol):
    """A monotonic clock in nanoseconds that can also sleep."""

    def now_ns(self) -> int:
        """Return the current time, ns, monotonic."""
        ...

    def sleep_until_ns(self, t_ns: int) -> None:
        """Sleep until `t_ns`; return at once when it has passed."""
        ...


class MonotonicClock:
    """The system's monotonic clock."""

    def now_ns(self) -> int:
        """Return CLOCK_MONOTONIC, ns."""
        return time.monotonic_ns()

    def sleep_until_ns(self, t_ns: int) -> None:
        """Sleep until `t_ns`."""
        wait_ns = t_ns - self.now_ns()
        if wait_ns > 0:
            time.sleep(wait_ns / 1e9)


class VirtualClock:
    """Simulated time: sleeping advances it at once, so that tests run faster than real time."""

    def __init__(self, start_ns: int = 0) -> None:
        self._now_ns = start_ns

    def now_ns(self) -> int:
        """Return the simulated time, ns."""
        return self._now_ns

    def sleep_until_ns(self, t_ns: int) -> None:
        """Advance to `t_ns`; never go backwards."""
        self._now_ns = max(self._now_ns, t_ns)
