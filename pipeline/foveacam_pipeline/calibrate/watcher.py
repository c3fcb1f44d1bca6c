"""Who watches a procedure: is told how far it is, shown what it sees, and may end it."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Cancelled


class ProcedureWatcher(Protocol):
    """The operator's side of a long procedure; every method may be called from the procedure's thread."""

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        """Take note that `done` of `total` steps are over."""
        ...

    def cancelled(self) -> bool:
        """Tell whether the procedure shall end; what was measured is kept."""
        ...

    def show(self, name: str, image: NDArray[np.uint8]) -> None:
        """Show an annotated picture, (h, w, 3) uint8 RGB; `name`: "wide", "left" or "right"."""
        ...


class SilentWatcher:
    """A watcher who does not watch."""

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        """Ignore it."""

    def cancelled(self) -> bool:
        """Go on."""
        return False

    def show(self, name: str, image: NDArray[np.uint8]) -> None:
        """Look away."""


def raise_if_cancelled(watch: ProcedureWatcher, *, doing: str) -> None:
    """Raise `Cancelled` when the watcher has had enough."""
    if watch.cancelled():
        raise Cancelled(f"{doing} was cancelled; what was measured is kept, and it can be resumed")
