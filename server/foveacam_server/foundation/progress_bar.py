"""The progress bar of the commands: shows a procedure's stages on the terminal and handles Ctrl-C."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeRemainingColumn
from rich.table import Column

from foveacam_pipeline.models.calibration import Calibration


class ProgressBar:
    """Implements `ProgressWatcher` and `StepWatcher` with one bar per stage, each with the time left."""

    def __init__(self, bars: Progress) -> None:
        self._bars = bars
        self._task: TaskID | None = None
        self._cancelled = False
        self.fitted_ids: list[str] = []

    def stage(self, name: str) -> None:
        """Complete the previous bar and add one for the stage `name`."""
        self.finish()
        self._task = self._bars.add_task(name, total=None, note="")

    def finish(self) -> None:
        """Complete the bar."""
        if self._task is not None:
            self._bars.update(self._task, completed=self._bars.tasks[self._task].total)

    def progress(self, done: int, *, total: int | None, note: str = "") -> None:
        """Advance the bar; `note` is shown after it."""
        if self._task is not None:
            self._bars.update(self._task, completed=done, total=total, note=note)

    def cancel(self) -> None:
        """Cancel the procedure at its next step."""
        self._cancelled = True

    def cancelled(self) -> bool:
        """Return whether the procedure was cancelled."""
        return self._cancelled

    def interrupt(self, _signal: int, _frame: FrameType | None) -> None:
        """Cancel the procedure; the next Ctrl-C ends the program."""
        self.cancel()
        signal.signal(signal.SIGINT, signal.default_int_handler)

    def show(self, name: str, image: NDArray[np.uint8]) -> None:
        """Ignore a picture."""

    def sample(self, sample_id: str) -> None:
        """Ignore a view of the board."""

    def pose(self, station: str, *, index: int, left: str, right: str) -> None:
        """Ignore a pose: the note names it."""

    def fitted(self, calibration: Calibration) -> None:
        """Remember the id of a new calibration."""
        self.fitted_ids.append(calibration.id)


@contextmanager
def progress_bar(
    console: Console, *, stage: str | None = None, silent: bool = False, cancels: bool = False
) -> Iterator[ProgressBar]:
    """Show a bar, unless `silent`; with `cancels` the first Ctrl-C cancels what it shows."""
    columns = (
        TextColumn("{task.description:>7}", markup=False, table_column=Column(no_wrap=True, min_width=7)),
        BarColumn(bar_width=20),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn(
            "{task.fields[note]}",
            markup=False,
            table_column=Column(no_wrap=True, overflow="ellipsis", ratio=1),
        ),
    )
    with Progress(*columns, console=console, expand=True, disable=silent or console.quiet) as bars:
        bar = ProgressBar(bars)
        if stage is not None:
            bar.stage(stage)
        before = signal.signal(signal.SIGINT, bar.interrupt) if cancels else None
        try:
            yield bar
        finally:
            if before is not None:
                signal.signal(signal.SIGINT, before)
