"""What callers want done by a camera's thread, and where it waits for that."""

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

W = TypeVar("W")
"""Who does it: the thread's worker."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraCommand(Generic[W]):
    """Something that a caller wants done by the thread."""

    name: str
    work: Callable[[W], object]
    done: "Future[object]"


class CommandInbox(Protocol[W]):
    """Where commands wait; a queue."""

    def get(self, block: bool = True, timeout: float | None = None) -> CameraCommand[W]:
        """Return the next command or raise `queue.Empty`."""
        ...
