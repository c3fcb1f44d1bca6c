"""Something made of a dataset in many steps, a mosaic or a reference: who watches it, and how it is ended."""

from typing import Protocol

from foveacam_hardware.contract import Cancelled


class ProgressWatcher(Protocol):
    """Who waits for what is made; called on the thread that makes it."""

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        """Take note that `done` of `total` steps are over."""
        ...

    def cancelled(self) -> bool:
        """Tell whether it shall end."""
        ...


class SilentProgress:
    """Watches nothing."""

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        """Ignore it."""

    def cancelled(self) -> bool:
        """Go on."""
        return False


SILENT = SilentProgress()


class ProgressSteps:
    """Counts the steps for the watcher, and ends the work when the watcher has had enough.

    `ended`: what is then said: what was cancelled, what is left of it, how to go on.
    """

    def __init__(self, watch: ProgressWatcher, total: int, *, ended: str) -> None:
        self._watch, self._total, self._done, self._ended = watch, total, 0, ended

    def step(self, note: str, count: int = 1) -> None:
        """Take note of steps that are over. Raise Cancelled."""
        self._done += count
        self._watch.progress(self._done, total=self._total, note=note)
        if self._watch.cancelled():
            raise Cancelled(self._ended)
