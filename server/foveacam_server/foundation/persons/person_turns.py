"""A fair semaphore on the event loop: a few turns at once, fewer of one person, waiting persons in turn."""

import asyncio
from collections import Counter
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from foveacam_server.foundation.persons.person_quota import PERSON, FairQueue, Person


class Turns:
    """A fair semaphore; to be used on one event loop only."""

    def __init__(self, at_once: int, *, each: int) -> None:
        self.at_once, self._each = at_once, each
        self._running: Counter[Person] = Counter()
        self._waiting: FairQueue[asyncio.Future[None]] = FairQueue()

    @property
    def running(self) -> int:
        """Number of turns held."""
        return self._running.total()

    @asynccontextmanager
    async def turn(self) -> AsyncIterator[None]:
        """Wait for a turn for the person of the running code, and hold it during the block."""
        person = PERSON.get()
        await self.begin(person)
        try:
            yield
        finally:
            self.end(person)

    async def begin(self, person: Person) -> None:
        """Wait for a turn; release it by `end`."""
        granted = asyncio.get_running_loop().create_future()
        self._waiting.put(person, granted)
        self._grant()
        try:
            await granted
        except asyncio.CancelledError:
            if granted.cancelled():
                self._waiting.remove(granted)
            else:
                self.end(person)
            raise

    def end(self, person: Person) -> None:
        """Release a turn of this person."""
        self._running[person] -= 1
        if not self._running[person]:
            del self._running[person]
        self._grant()

    def _grant(self) -> None:
        while self.running < self.at_once:
            busy = [person for person, count in self._running.items() if count >= self._each]
            found = self._waiting.take(not_of=busy)
            if found is None:
                return
            person, granted = found
            if not granted.cancelled():
                self._running[person] += 1
                granted.set_result(None)
