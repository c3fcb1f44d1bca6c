"""Watchers of a procedure: they receive its progress and its pictures, and may cancel it."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Cancelled
from foveacam_pipeline.workers.progress import ProgressWatcher, SilentProgress


class ProcedureWatcher(ProgressWatcher, Protocol):
    """A watcher that also receives a procedure's pictures; what was measured is kept when it cancels."""

    def show(self, name: str, image: NDArray[np.uint8]) -> None:
        """Show an annotated picture, (h, w, 3) uint8 RGB; `name`: "wide", "left" or "right"."""
        ...


class SilentWatcher(SilentProgress):
    """A watcher that ignores everything and never cancels."""

    def show(self, name: str, image: NDArray[np.uint8]) -> None:
        """Ignore it."""


def raise_if_cancelled(watch: ProcedureWatcher, *, doing: str) -> None:
    """Raise `Cancelled` when the watcher has cancelled; `doing` names the procedure."""
    if watch.cancelled():
        raise Cancelled(f"{doing} was cancelled; what was measured is kept, and it can be resumed")
