"""Runs studies for the command line: recalls what is kept, shows bars, keeps what is done at Ctrl-C."""

import _thread
import json
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from types import FrameType

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from foveacam_hardware.contract import Cancelled, FoveaError
from foveacam_pipeline.study.report.cache import CachedStudy, DamagedFile, StudyCache, key_of
from foveacam_pipeline.study.report.page import ReportedStudy
from foveacam_server.study_command.output import as_document, show, write_all
from foveacam_server.study_command.recipes import StudyRecipe

_POLL_S = 0.1


@contextmanager
def heard_ctrl_c(on_first: Callable[[], None]) -> Iterator[None]:
    """Call `on_first` at the first Ctrl-C; the next raises KeyboardInterrupt. On the main thread only.

    A terminal sends Ctrl-C to worker processes too, which would die of it amid their work. They inherit which
    signals are blocked: it is blocked here, and a thread waits for it.
    """
    pressed = 0

    def interrupt(_signal: int, _frame: FrameType | None) -> None:
        nonlocal pressed
        pressed += 1
        if pressed > 1:
            raise KeyboardInterrupt
        on_first()

    over = threading.Event()
    handler = signal.signal(signal.SIGINT, interrupt)
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    listener = threading.Thread(target=_listen, args=(over,), name="ctrl-c", daemon=True)
    listener.start()
    try:
        yield
    finally:
        over.set()
        listener.join()
        signal.signal(signal.SIGINT, handler)
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def _listen(over: threading.Event) -> None:
    """Pass a blocked Ctrl-C on to the main thread's handler."""
    while not over.is_set():
        if signal.sigtimedwait({signal.SIGINT}, _POLL_S) is not None:
            _thread.interrupt_main()


_FAILURE, _INTERRUPTED = 1, 130


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportOptions:
    """What shall become of the findings. `every`: all were asked for; one that fails stops no other."""

    as_json: bool = False
    out: Path | None = None
    fresh: bool = False
    every: bool = False


@dataclass(slots=True, kw_only=True)
class _Progress:
    """What came of the studies so far."""

    told: list[ReportedStudy] = field(default_factory=list)
    failed: list[str] = field(default_factory=list)
    interrupted: bool = False


class StudyProgressBar:
    """Implements `ProgressWatcher` with a bar; the first Ctrl-C ends the study well, the second at once."""

    def __init__(self, progress: Progress, task: TaskID) -> None:
        self._progress, self._task = progress, task
        self._over = False

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        """Move the bar."""
        self._progress.update(self._task, completed=done, total=total, told=note)

    def cancelled(self) -> bool:
        """Tell whether Ctrl-C was pressed."""
        return self._over

    def end(self) -> None:
        """End after the step under way."""
        self._over = True


def run_studies(recipes: Sequence[StudyRecipe], wanted: ReportOptions) -> None:
    """Compute or recall the studies, write the report, print; Ctrl-C ends with 130, a failed study with 1."""
    console = Console(stderr=True, quiet=wanted.as_json)
    cache = StudyCache(cache_folder())
    state = _Progress()
    with _bars(console) as progress:
        for recipe in recipes:
            if not _run_one(recipe, wanted, cache, progress=progress, state=state):
                break
    folder = wanted.out if wanted.as_json else wanted.out or Path("foveacam-study")
    report = write_all(state.told, folder, failed=state.failed) if folder is not None and state.told else None
    if wanted.as_json:
        typer.echo(json.dumps(as_document(state.told, every=wanted.every, report=report), allow_nan=False))
    else:
        show(state.told, Console(), folder=folder, report=report)
    for line in state.failed:
        Console(stderr=True, soft_wrap=True).print(line, markup=False, highlight=False)
    if state.interrupted or state.failed:
        raise typer.Exit(_INTERRUPTED if state.interrupted else _FAILURE)


def _run_one(
    recipe: StudyRecipe, wanted: ReportOptions, cache: StudyCache, *, progress: Progress, state: _Progress
) -> bool:
    """Run one study; return whether to go on with the next."""
    task = progress.add_task(recipe.name, total=None, told="")
    watch = StudyProgressBar(progress, task)
    with heard_ctrl_c(watch.end):
        try:
            told = _found_or_made(recipe, wanted, cache, watch=watch)
        except (Cancelled, KeyboardInterrupt):
            state.failed.append(
                f"{recipe.name}: ended before it was finished; the same command computes it again, "
                "and recalls what is finished"
            )
            state.interrupted = True
            return False
        except FoveaError as error:
            if not wanted.every:
                raise
            state.failed.append(f"{recipe.name}: {error}")
            return True
    progress.update(task, completed=1, total=1, told=f"{told.kept.took_s:.1f} s" if told.fresh else "kept")
    state.told.append(told)
    state.interrupted = watch.cancelled()
    return not state.interrupted


def _found_or_made(
    recipe: StudyRecipe, wanted: ReportOptions, cache: StudyCache, *, watch: StudyProgressBar
) -> ReportedStudy:
    key = key_of(recipe.name, recipe.settings, files=recipe.files)
    if not wanted.fresh:
        try:
            kept = cache.find(recipe.name, key)
        except DamagedFile as error:
            Console(stderr=True, soft_wrap=True).print(
                f"{error}; computed anew", markup=False, highlight=False
            )
            kept = None
        if kept is not None:
            return ReportedStudy(kept=kept, fresh=False)
    began_s = time.monotonic()
    study = recipe.compute(watch)
    kept = CachedStudy(
        study=study,
        took_s=time.monotonic() - began_s,
        made_utc=datetime.now(UTC).isoformat(timespec="seconds"),
    )
    cache.keep(key, kept)
    return ReportedStudy(kept=kept, fresh=True)


@contextmanager
def _bars(console: Console) -> Iterator[Progress]:
    columns = (
        TextColumn("{task.description:>9}"),
        BarColumn(bar_width=24),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[told]}", markup=False),
    )
    with Progress(*columns, console=console, disable=console.quiet) as progress:
        yield progress


def cache_folder() -> Path:
    """Return the folder of kept results (XDG base directories)."""
    root = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(root) / "foveacam" / "studies"
