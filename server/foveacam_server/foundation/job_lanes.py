"""Runs the jobs of some kinds on a limited number of threads, each person's in turn."""

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
    """Callable from any thread. Of several threads one person never has all."""

    def __init__(self, name: str, *, at_once: int) -> None:
        """`name`: of its threads, each of which is started when there is work for it, and stays."""
        self._name, self._at_once = name, at_once
        self._each = max(1, at_once - 1)
        self._changed = threading.Condition()
        self._waiting: FairQueue[Work] = FairQueue()
        self._running: Counter[Person] = Counter()
        self._threads: list[threading.Thread] = []
        self._started = self._closed = False

    def start(self) -> None:
        """Start to run what was put."""
        with self._changed:
            self._started = True
            self._add_thread()

    def put(self, person: Person, work: Work) -> None:
        """Run `work` when its turn has come."""
        with self._changed:
            self._waiting.put(person, work)
            self._add_thread()
            self._changed.notify()

    def withdraw(self, work: Work) -> bool:
        """Take back work that waits; return whether it did."""
        with self._changed:
            return self._waiting.remove(work)

    def close(self) -> list[threading.Thread]:
        """Let the threads end when nothing waits any more; return them."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
            return list(self._threads)

    def _add_thread(self) -> None:
        """Start one more thread where all are at work; called with the lock."""
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
        """Return the next work, once there is any; None once the lane is closed and nothing waits."""
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
