"""Registry of the open connections of each sign-in or token, to end them on revocation."""

import threading
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager


class OpenStreams:
    """Counts the open connections of each sign-in or token, and ends them; callable from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._ends: defaultdict[str, list[Callable[[], None]]] = defaultdict(list)

    @contextmanager
    def opened(self, sign_in: str, end: Callable[[], None]) -> Iterator[None]:
        """Register a connection during the block; `end` ends it, and must not block."""
        with self._lock:
            self._ends[sign_in].append(end)
        try:
            yield
        finally:
            with self._lock:
                self._ends[sign_in].remove(end)
                if not self._ends[sign_in]:
                    del self._ends[sign_in]

    def end(self, sign_in: str) -> None:
        """End the connections of a sign-in or token."""
        with self._lock:
            ends = list(self._ends.get(sign_in, ()))
        for end in ends:
            end()

    def counts(self) -> Counter[str]:
        """Return how many connections each sign-in or token has open."""
        with self._lock:
            return Counter({sign_in: len(ends) for sign_in, ends in self._ends.items()})
