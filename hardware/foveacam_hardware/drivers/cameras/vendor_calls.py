"""Calls into a vendor's library, each with a deadline; what runs now can be seen from other threads."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from foveacam_hardware.contract import Clock, Timeout

T = TypeVar("T")


class CallAbandoned(Exception):
    """The call came back after everybody had given it up: no error, but the end of its thread."""


@dataclass(frozen=True, slots=True, kw_only=True)
class VendorCall:
    """One call that has not returned yet."""

    name: str
    began_ns: int
    deadline_ns: int

    def overdue(self, now_ns: int) -> str | None:
        """Return that it is late, in words; None while it is not."""
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
        """What runs; any thread may look."""
        return self._now

    def abandon(self) -> None:
        """Give up what runs: its thread ends when it returns."""
        self._abandoned = True

    def make(self, name: str, call: Callable[[], T], *, within_ns: int) -> T:
        """Return what the call returns; raise `Timeout` when it took longer than allowed."""
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
