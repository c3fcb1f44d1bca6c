"""Run work in a child process: report progress and errors, and end with the parent.

Progress and errors are JSON lines on stdout. The process ends when its stdin is closed.
"""

import os
import sys
import threading
from collections.abc import Callable, Mapping
from typing import Self

from pydantic import BaseModel

from foveacam_hardware.contract import FoveaError
from foveacam_server.foundation.errors import KINDS

NICENESS = 10
"""Niceness: lower priority than the server's."""


class ChildProgress(BaseModel):
    """Progress of the work; `share`: its completed share."""

    done: int
    total: int
    note: str
    share: float


class ChildError(BaseModel):
    """The error that ended the work; `error`: name of its class."""

    error: str
    statement: str
    asked: str | None
    found: str | None
    remedy: str | None

    @classmethod
    def of(cls, error: FoveaError) -> Self:
        """Return an error as a message."""
        return cls(
            error=type(error).__name__,
            statement=error.statement,
            asked=error.asked,
            found=error.found,
            remedy=error.remedy,
        )

    def as_error(self) -> FoveaError:
        """Return the error."""
        named = {kind.__name__: kind for kind in KINDS}
        kind = named.get(self.error, FoveaError)
        return kind(self.statement, asked=self.asked, found=self.found, remedy=self.remedy)


class StdoutProgress:
    """Implements `ProgressWatcher`: writes each step to stdout. To cancel, kill the process.

    `costs`: relative duration of a step of each kind, 1 for others; `rounds`: number of steps of each kind.
    """

    def __init__(self, rounds: int, costs: Mapping[str, float]) -> None:
        self._rounds, self._costs, self._done, self._over = rounds, costs, 0, 0.0

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        """Write the progress."""
        self._over += (done - self._done) * self._costs.get(note, 1.0)
        self._done = done
        other = max(0, total - len(self._costs) * self._rounds)
        whole = self._rounds * sum(self._costs.values()) + other
        share = min(1.0, self._over / whole)
        report_progress(ChildProgress(done=done, total=total, note=note, share=share))

    def cancelled(self) -> bool:
        """Never cancel."""
        return False


def report_progress(step: ChildProgress) -> None:
    """Write a step to stdout."""
    _write_message(step)


def _write_message(message: BaseModel) -> None:
    """Write one message as a JSON line to stdout."""
    sys.stdout.write(message.model_dump_json() + "\n")
    sys.stdout.flush()


def become_child() -> None:
    """Lower this process's priority, and make it end with its parent."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    os.nice(NICENESS)


def run_child(make: Callable[[], None]) -> int:
    """Run `make` at low priority; return the exit status: 0, or 1 after writing its error."""
    become_child()
    try:
        make()
    except FoveaError as error:
        _write_message(ChildError.of(error))
        return 1
    return 0


def _end_with_parent() -> None:
    while os.read(sys.stdin.fileno(), 1):  # not `sys.stdin.read`: it would hold a lock at exit
        pass
    os._exit(2)
