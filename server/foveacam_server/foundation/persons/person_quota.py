"""Limits how much of a limited resource one person and all persons together hold, and queues persons fairly.

A person is a user, a service, or an address where nobody signs in; the middleware of requests sets it. Work
that the server itself starts has no person, and no limit per person.
"""

import threading
from collections import Counter, OrderedDict, deque
from collections.abc import Container, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from foveacam_server.foundation.errors import AllTaken, PersonLimit

T = TypeVar("T")
Person = str | None
"""Key of a person; None: the server itself."""

PERSON: ContextVar[Person] = ContextVar("person", default=None)
"""Person for whom the running code works."""

_TRY_AGAIN_LATER = 1013
OWN_LIMIT = 4429
"""Close code of a WebSocket beyond the limit per person."""
_REASON_BYTES = 123
"""Longest reason of a WebSocket's close (RFC 6455, 5.5)."""


class Places:
    """Limited places of one kind; callable from any thread.

    `what`: the kind in the plural, with its purpose, for messages. `remedy`: how to free a place.
    """

    def __init__(self, what: str, *, most: int, most_each: int, remedy: str) -> None:
        self.most, self.most_each = most, most_each
        self._what, self._remedy = what, remedy
        self._lock = threading.Lock()
        self._held: Counter[Person] = Counter()
        self._taken = 0

    @property
    def taken(self) -> int:
        """Number of places held."""
        return self._taken

    def take(self, person: Person) -> None:
        """Take one more place; raise `PersonLimit` or `AllTaken` beyond a limit."""
        with self._lock:
            if person is not None and self._held[person] >= self.most_each:
                raise PersonLimit(
                    f"you hold {self.most_each} {self._what}, as many as one person may",
                    asked=f"one more of {self._what}",
                    found=f"{self.most_each} held by you",
                    remedy=self._remedy,
                )
            if self._taken >= self.most:
                raise AllTaken(
                    f"all {self.most} places for {self._what} are taken",
                    asked=f"one more of {self._what}",
                    found=f"{self.most} held by all persons together",
                    remedy="try again when one is free",
                )
            self._held[person] += 1
            self._taken += 1

    def give_back(self, person: Person) -> None:
        """Release a place that was taken for this person."""
        with self._lock:
            self._taken -= 1
            self._held[person] -= 1
            if not self._held[person]:
                del self._held[person]

    @contextmanager
    def hold(self, person: Person) -> Iterator[None]:
        """Hold a place during the block."""
        self.take(person)
        try:
            yield
        finally:
            self.give_back(person)


def close_of(refusal: AllTaken | PersonLimit) -> tuple[int, str]:
    """Return code and reason for closing a WebSocket beyond a limit."""
    code = OWN_LIMIT if isinstance(refusal, PersonLimit) else _TRY_AGAIN_LATER
    return code, str(refusal).encode()[:_REASON_BYTES].decode(errors="ignore")


@dataclass(frozen=True, slots=True, kw_only=True)
class ServerPlaces:
    """The limits that belong to no service: of requests, connections and long answers."""

    requests: Places = field(
        default_factory=lambda: Places(
            "open requests", most=512, most_each=64, remedy="wait for the answers that are on their way"
        )
    )
    """Limit of requests, each from its first byte to the last byte of its answer, streams included."""
    large_bodies: Places = field(
        default_factory=lambda: Places(
            "large bodies", most=16, most_each=4, remedy="wait until one has been answered"
        )
    )
    """Limit of bodies larger than 1 MiB, from the first byte to the answer."""
    events: Places = field(
        default_factory=lambda: Places(
            "streams of events", most=256, most_each=16, remedy="close a page or a program that listens"
        )
    )
    steering: Places = field(
        default_factory=lambda: Places(
            "connections that steer", most=32, most_each=8, remedy="close a page that steers"
        )
    )
    scene_viewers: Places = field(
        default_factory=lambda: Places("3D panes", most=64, most_each=16, remedy="close a page")
    )
    long_reads: Places = field(
        default_factory=lambda: Places(
            "downloads and checks of whole datasets",
            most=16,
            most_each=3,
            remedy="wait until one has ended",
        )
    )
    """Whatever one person reads, half of the threads of requests stay free for others."""


class FairQueue(Generic[T]):
    """Fair queue: persons take turns, each one's items in order of arrival. Not thread-safe."""

    def __init__(self) -> None:
        self._waiting: OrderedDict[Person, deque[T]] = OrderedDict()

    def __len__(self) -> int:
        return sum(len(items) for items in self._waiting.values())

    def put(self, person: Person, item: T) -> None:
        """Append an item to its person's queue."""
        self._waiting.setdefault(person, deque()).append(item)

    def take(self, *, not_of: Container[Person] = ()) -> tuple[Person, T] | None:
        """Remove and return the next item; None when there is none except those of `not_of`.

        Its person becomes last in turn.
        """
        for person, items in self._waiting.items():
            if person not in not_of:
                item = items.popleft()
                self._waiting.move_to_end(person)
                if not items:
                    del self._waiting[person]
                return person, item
        return None

    def remove(self, item: T) -> bool:
        """Remove an item; return whether it was queued."""
        for person, items in self._waiting.items():
            if item in items:
                items.remove(item)
                if not items:
                    del self._waiting[person]
                return True
        return False
