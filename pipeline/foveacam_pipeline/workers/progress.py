"""Progress and cancellation of long work: the watcher it reports to, and the counter of its steps."""

from typing import Protocol

from foveacam_hardware.contract import Cancelled


class ProgressWatcher(Protocol):
    """Receives the progress of a long task and may cancel it; called on the thread of the task."""

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        """Record that `done` of `total` steps are finished."""
        ...

    def cancelled(self) -> bool:
        """Return whether the work is to stop."""
        ...


class SilentProgress:
    """A watcher that shows nothing and never cancels."""

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        """Ignore the progress."""

    def cancelled(self) -> bool:
        """Return False."""
        return False


SILENT = SilentProgress()


class ProgressSteps:
    """Counts steps, reports them to the watcher, and raises Cancelled when the watcher cancels.

    `ended`: the text of that error: what was cancelled, what is left of it, how to go on.
    """

    def __init__(self, watch: ProgressWatcher, total: int, *, ended: str) -> None:
        self._watch, self._total, self._done, self._ended = watch, total, 0, ended

    def step(self, note: str, count: int = 1) -> None:
        """Count `count` finished steps. Raise Cancelled."""
        self._done += count
        self._watch.progress(self._done, total=self._total, note=note)
        if self._watch.cancelled():
            raise Cancelled(self._ended)
