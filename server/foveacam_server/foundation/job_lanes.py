"""Runs the jobs of some kinds on a limited number of threads, persons taking turns."""

import threading
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

from foveacam_server.foundation.persons.person_quota import FairQueue, Person


@dataclass(frozen=True, slots=True, eq=False)
class Work:
    """A job to run."""

    run: Callable[[], None]


class JobLane:
    """Queue and threads of a lane; callable from any thread.

    One person never occupies all of several threads.
    """

    def __init__(self, name: str, *, at_once: int) -> None:
        """`name`: of its threads; each is started when it is first needed, and stays."""
        self._name, self._at_once = name, at_once
        self._each = max(1, at_once - 1)
        self._changed = threading.Condition()
        self._waiting: FairQueue[Work] = FairQueue()
        self._running: Counter[Person] = Counter()
        self._threads: list[threading.Thread] = []
        self._started = self._closed = False

    def start(self) -> None:
        """Start to run the queued work."""
        with self._changed:
            self._started = True
            self._add_thread()

    def put(self, person: Person, work: Work) -> None:
        """Queue `work`."""
        with self._changed:
            self._waiting.put(person, work)
            self._add_thread()
            self._changed.notify()

    def withdraw(self, work: Work) -> bool:
        """Remove queued work; return whether it was queued."""
        with self._changed:
            return self._waiting.remove(work)

    def close(self) -> list[threading.Thread]:
        """Make the threads end when the queue is empty; return them."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
            return list(self._threads)

    def _add_thread(self) -> None:
        """Start one more thread if all are busy; call with the lock held."""
        wanted = min(self._at_once, self._running.total() + len(self._waiting))
        if self._started and len(self._threads) < wanted:
            thread = threading.Thread(target=self._run, name=self._name, daemon=True)
            self._threads.append(thread)
            thread.start()

    def _run(self) -> None:
        while (found := self._next()) is not None:
            person, work = found
            work.run()
            with self._changed:
                self._running[person] -= 1
                if not self._running[person]:
                    del self._running[person]
                self._changed.notify()

    def _next(self) -> tuple[Person, Work] | None:
        """Wait for the next work and return it; None once the lane is closed and the queue empty."""
        with self._changed:
            while True:
                busy = [person for person, count in self._running.items() if count >= self._each]
                found = self._waiting.take(not_of=busy)
                if found is not None:
                    self._running[found[0]] += 1
                    return found
                if self._closed and not self._waiting:
                    return None
                self._changed.wait()
