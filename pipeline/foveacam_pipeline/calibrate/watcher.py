"""Watchers of a procedure: they receive its progress and its pictures, and may cancel it."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Cancelled


class ProcedureWatcher(Protocol):
    """Receiver of a procedure's progress; every method may be called from the procedure's thread."""

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        """Report that `done` of `total` steps are over."""
        ...

    def cancelled(self) -> bool:
        """Return whether the procedure shall end; what was measured is kept."""
        ...

    def show(self, name: str, image: NDArray[np.uint8]) -> None:
        """Show an annotated picture, (h, w, 3) uint8 RGB; `name`: "wide", "left" or "right"."""
        ...


class SilentWatcher:
    """A watcher that ignores everything and never cancels."""

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        """Ignore it."""

    def cancelled(self) -> bool:
        """Return False."""
        return False

    def show(self, name: str, image: NDArray[np.uint8]) -> None:
        """Ignore it."""


def raise_if_cancelled(watch: ProcedureWatcher, *, doing: str) -> None:
    """Raise `Cancelled` when the watcher has cancelled; `doing` names the procedure."""
    if watch.cancelled():
        raise Cancelled(f"{doing} was cancelled; what was measured is kept, and it can be resumed")
