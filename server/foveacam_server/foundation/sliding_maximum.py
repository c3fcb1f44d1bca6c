"""The largest of the values that came within a window of time."""

from collections import deque


class SlidingMaximum:
    """Keeps the largest value of the last `window_ns`; one thread adds, any thread reads."""

    def __init__(self, window_ns: int) -> None:
        self._window_ns = window_ns
        self._falling: deque[tuple[int, int]] = deque()
        """Times and values; each value is larger than all that came after it."""

    def add(self, value: int, *, t_ns: int) -> None:
        """Add a value of the moment `t_ns`, which is no earlier than the last one."""
        while self._falling and self._falling[-1][1] <= value:
            self._falling.pop()
        while self._falling and self._falling[0][0] < t_ns - self._window_ns:
            self._falling.popleft()
        self._falling.append((t_ns, value))

    def largest(self, now_ns: int) -> int | None:
        """Return the largest value of the window that ends now; None when none came within it."""
        begin_ns = now_ns - self._window_ns
        return max((value for t_ns, value in tuple(self._falling) if t_ns >= begin_ns), default=None)
