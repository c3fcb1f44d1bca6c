"""Counts wrong tokens by address, and blocks an address with too many for a while."""

import threading
import time
from collections import OrderedDict, deque
from collections.abc import Callable

MOST_WRONG = 10
WINDOW_S = 60.0
_MOST_ADDRESSES = 1024


class TokenAttempts:
    """Times of the newest wrong tokens of each address; callable from any thread."""

    def __init__(self, now_s: Callable[[], float] = time.monotonic) -> None:
        self._now_s = now_s
        self._lock = threading.Lock()
        self._wrong_s: OrderedDict[str, deque[float]] = OrderedDict()

    def wait_s(self, address: str) -> float:
        """Return how long an address is blocked; 0 when it may try a token."""
        with self._lock:
            times_s = self._wrong_s.get(address)
            if times_s is None or len(times_s) < MOST_WRONG:
                return 0.0
            return max(0.0, times_s[0] + WINDOW_S - self._now_s())

    def add_wrong(self, address: str) -> None:
        """Count a wrong token."""
        with self._lock:
            times_s = self._wrong_s.setdefault(address, deque(maxlen=MOST_WRONG))
            times_s.append(self._now_s())
            self._wrong_s.move_to_end(address)
            while len(self._wrong_s) > _MOST_ADDRESSES:
                self._wrong_s.popitem(last=False)
