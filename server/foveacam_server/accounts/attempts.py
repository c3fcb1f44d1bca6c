"""Counts wrong passwords and tokens by address or by account, and blocks one with too many for a while."""

import threading
import time
from collections import OrderedDict, deque
from collections.abc import Callable

MOST_WRONG = 10
WINDOW_S = 60.0
"""Of one address."""
ACCOUNT_MOST_WRONG = 5
ACCOUNT_WINDOW_S = 300.0
"""Of one account, whatever addresses the wrong passwords come from."""
_MOST_NAMES = 1024


class WrongAttempts:
    """Times of the newest wrong attempts of each name; callable from any thread."""

    def __init__(
        self,
        now_s: Callable[[], float] = time.monotonic,
        *,
        most: int = MOST_WRONG,
        window_s: float = WINDOW_S,
    ) -> None:
        self._now_s = now_s
        self._most, self._window_s = most, window_s
        self._lock = threading.Lock()
        self._wrong_s: OrderedDict[str, deque[float]] = OrderedDict()

    def wait_s(self, name: str) -> float:
        """Return how long a name is blocked; 0 when it may try."""
        with self._lock:
            times_s = self._wrong_s.get(name)
            if times_s is None or len(times_s) < self._most:
                return 0.0
            return max(0.0, times_s[0] + self._window_s - self._now_s())

    def add_wrong(self, name: str) -> None:
        """Count a wrong attempt."""
        with self._lock:
            times_s = self._wrong_s.setdefault(name, deque(maxlen=self._most))
            times_s.append(self._now_s())
            self._wrong_s.move_to_end(name)
            while len(self._wrong_s) > _MOST_NAMES:
                self._wrong_s.popitem(last=False)

    def forget(self, name: str) -> None:
        """Forget the wrong attempts of a name: a right one came."""
        with self._lock:
            self._wrong_s.pop(name, None)
