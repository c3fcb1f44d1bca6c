"""Calls into a vendor's library, each with a deadline; other threads can see the call in progress."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from foveacam_hardware.contract import Clock, Timeout

T = TypeVar("T")


class CallAbandoned(Exception):
    """A call returned after it was abandoned: not an error, but the end of its thread."""


@dataclass(frozen=True, slots=True, kw_only=True)
class VendorCall:
    """One call in progress."""

    name: str
    began_ns: int
    deadline_ns: int

    def overdue(self, now_ns: int) -> str | None:
        """Return a message that the call is late; None while it is not."""
        if now_ns <= self.deadline_ns:
            return None
        return (
            f"asked to {self.name}, its library has not answered for {(now_ns - self.began_ns) / 1e9:.1f} s;"
            " check its cable and power"
        )


class VendorCalls:
    """Makes the calls of one thread."""

    def __init__(self, *, clock: Clock) -> None:
        self._clock = clock
        self._now: VendorCall | None = None
        self._abandoned = False

    @property
    def now(self) -> VendorCall | None:
        """The call in progress; any thread may read it."""
        return self._now

    def abandon(self) -> None:
        """Abandon the call in progress: its thread ends when it returns."""
        self._abandoned = True

    def make(self, name: str, call: Callable[[], T], *, within_ns: int) -> T:
        """Make a call and return its result; raise `Timeout` when it took longer than allowed."""
        began_ns = self._clock.now_ns()
        running = VendorCall(name=name, began_ns=began_ns, deadline_ns=began_ns + within_ns)
        self._now = running
        try:
            result = call()
        finally:
            self._now = None
            if self._abandoned:
                raise CallAbandoned(name)
        late = running.overdue(self._clock.now_ns())
        if late is not None:
            raise Timeout(late)
        return result
