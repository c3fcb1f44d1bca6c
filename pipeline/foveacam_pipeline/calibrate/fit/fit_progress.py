"""How far a fit is, and whether it shall go on: counted in fits of a whole rig."""

from foveacam_pipeline.calibrate.fit.fit import DOING
from foveacam_pipeline.calibrate.watcher import ProcedureWatcher, raise_if_cancelled

ELECTION_PARTS = 4
"""A fit that tries every model takes so much longer than one whose models are known."""


class FitProgress:
    """Counts what is done of a fit and tells the watcher, who may end it between any two parts."""

    def __init__(self, watch: ProcedureWatcher, *, comparisons: int) -> None:
        self.watch = watch
        self._total = ELECTION_PARTS + comparisons + 1
        self._done = 0

    def begin(self, what: str) -> None:
        """Tell what is fitted next; raise Cancelled when the watcher has had enough."""
        raise_if_cancelled(self.watch, doing=DOING)
        self.watch.progress(self._done, total=self._total, note=what)

    def end(self, parts: int = 1) -> None:
        """Count what was begun as done."""
        self._done += parts

    def finish(self) -> None:
        """Tell that everything is done, whatever was left out."""
        self._done = self._total
        self.begin("fitted")
