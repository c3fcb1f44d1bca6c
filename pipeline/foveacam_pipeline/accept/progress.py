"""Progress of an acceptance run: how far it is, in seconds that its checks are expected to take."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from foveacam_pipeline.calibrate.watcher import ProcedureWatcher

PER_SECOND = 10
"""Units of progress: tenths of an expected second."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckCost:
    """What a check is expected to take: its steps (most of them looks), and its seconds in real time."""

    steps: int
    seconds: float


class RunProgress:
    """Reports how far a run is; a check that takes more steps than expected waits at its end."""

    def __init__(self, watch: ProcedureWatcher, costs: Mapping[str, CheckCost]) -> None:
        self._watch = watch
        self._costs = costs
        self._total = round(PER_SECOND * sum(cost.seconds for cost in costs.values()))
        self._ended_s = 0.0
        self._steps = 0
        self._cost = CheckCost(steps=1, seconds=0.0)
        self._title = ""

    def begin(self, name: str, title: str) -> None:
        """Begin a check; a check without a known cost takes no time."""
        self._cost = self._costs.get(name, CheckCost(steps=1, seconds=0.0))
        self._steps, self._title = 0, title
        self.report()

    def step(self) -> None:
        """Count one step of the check."""
        self._steps = min(self._steps + 1, self._cost.steps)
        self.report()

    def end(self) -> None:
        """End the check."""
        self._ended_s += self._cost.seconds
        self._cost, self._steps = CheckCost(steps=1, seconds=0.0), 0
        self.report()

    def report(self, note: str = "") -> None:
        """Report the progress with a note, by default the title of the check."""
        here_s = self._cost.seconds * self._steps / max(self._cost.steps, 1)
        done = round(PER_SECOND * (self._ended_s + here_s))
        self._watch.progress(min(done, self._total), total=self._total, note=note or self._title)


class NotedTurn:
    """A watcher of a turn of the rig: its notes are shown, as they may ask a person to turn it."""

    def __init__(self, watch: ProcedureWatcher, note: Callable[[str], None]) -> None:
        self._note = note
        self.show = watch.show
        self.cancelled = watch.cancelled

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        """Show the note beside the progress of the run."""
        self._note(note)


class CountedSteps:
    """A watcher of a procedure within the run: its steps count as steps of the check."""

    def __init__(self, watch: ProcedureWatcher, count: Callable[[], None]) -> None:
        self._count = count
        self.show = watch.show
        self.cancelled = watch.cancelled

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        """Count one step."""
        self._count()
