"""The clock of the soaked server: monotonic time, in which idle hours are skipped."""

import threading
import time


class SkippingClock:
    """Monotonic time plus what was skipped so far; thread-safe."""

    def __init__(self) -> None:
        self._skipped_ns = 0
        self._changed = threading.Condition()

    def now_ns(self) -> int:
        """Return the time, ns."""
        return time.monotonic_ns() + self._skipped_ns

    def sleep_until_ns(self, t_ns: int) -> None:
        """Sleep until `t_ns`; a skip of time wakes sleepers whose time has come."""
        with self._changed:
            while (wait_ns := t_ns - self.now_ns()) > 0:
                self._changed.wait(wait_ns / 1e9)

    def skip(self, duration_ns: int) -> None:
        """Advance the time by `duration_ns` at once."""
        with self._changed:
            self._skipped_ns += duration_ns
            self._changed.notify_all()
