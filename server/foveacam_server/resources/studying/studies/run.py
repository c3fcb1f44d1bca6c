"""Run studies for the command line: read cached results, show progress bars, end cleanly at Ctrl-C.

Finished studies are cached, also when a later one is interrupted. How each is computed is in `recipes`.
"""

import _thread
import json
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

from foveacam_hardware.contract import Cancelled, FoveaError
from foveacam_pipeline.study.report.cache import CachedStudy, DamagedFile, StudyCache, cache_key
from foveacam_pipeline.study.report.page import ReportedStudy
from foveacam_server.foundation.progress_bar import ProgressBar, progress_bar
from foveacam_server.resources.studying.studies.output import describe_results, print_results, write_report
from foveacam_server.resources.studying.studies.recipes import StudyRecipe, cache_folder

_POLL_S = 0.1


@contextmanager
def catch_ctrl_c(on_first: Callable[[], None]) -> Iterator[None]:
    """Call `on_first` at the first Ctrl-C; the next raises KeyboardInterrupt. For the main thread only.

    A terminal sends Ctrl-C to worker processes too, which would end during their work. They inherit the mask
    of blocked signals: SIGINT is blocked here, and a thread waits for it.
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
    """Forward a blocked Ctrl-C to the main thread's handler."""
    while not over.is_set():
        if signal.sigtimedwait({signal.SIGINT}, _POLL_S) is not None:
            _thread.interrupt_main()


_FAILURE, _INTERRUPTED = 1, 130


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportOptions:
    """Output of the results. `every`: all studies were requested; a failed one does not stop the others."""

    as_json: bool = False
    out: Path | None = None
    fresh: bool = False
    every: bool = False


@dataclass(slots=True, kw_only=True)
class _Outcome:
    """The studies finished and failed so far."""

    finished: list[ReportedStudy] = field(default_factory=list)
    failed: list[str] = field(default_factory=list)
    interrupted: bool = False


def run_studies(recipes: Sequence[StudyRecipe], wanted: ReportOptions) -> None:
    """Compute the studies or read them from the cache, write the report, and print the results.

    Exit with 130 after Ctrl-C, with 1 after a failed study.
    """
    console = Console(stderr=True, quiet=wanted.as_json)
    cache = StudyCache(cache_folder())
    outcome = _Outcome()
    for recipe in recipes:
        with progress_bar(console, stage=recipe.name) as bar:
            if not _run_one(recipe, wanted, cache, bar=bar, outcome=outcome):
                break
    folder = wanted.out if wanted.as_json else wanted.out or Path("foveacam-study")
    report = (
        write_report(outcome.finished, folder, failed=outcome.failed)
        if folder is not None and outcome.finished
        else None
    )
    if wanted.as_json:
        typer.echo(
            json.dumps(describe_results(outcome.finished, every=wanted.every, report=report), allow_nan=False)
        )
    else:
        print_results(outcome.finished, Console(), folder=folder, report=report)
    for line in outcome.failed:
        Console(stderr=True, soft_wrap=True).print(line, markup=False, highlight=False)
    if outcome.interrupted or outcome.failed:
        raise typer.Exit(_INTERRUPTED if outcome.interrupted else _FAILURE)


def _run_one(
    recipe: StudyRecipe, wanted: ReportOptions, cache: StudyCache, *, bar: ProgressBar, outcome: _Outcome
) -> bool:
    """Run one study; return whether to continue with the next."""
    with catch_ctrl_c(bar.cancel):
        try:
            reported = _cached_or_computed(recipe, wanted, cache, bar=bar)
        except (Cancelled, KeyboardInterrupt):
            outcome.failed.append(
                f"{recipe.name}: ended before it was finished; the same command computes it again, "
                "and reads what is finished from the cache"
            )
            outcome.interrupted = True
            return False
        except FoveaError as error:
            if not wanted.every:
                raise
            outcome.failed.append(f"{recipe.name}: {error}")
            return True
    outcome.finished.append(reported)
    if reported.study.ended_early:
        outcome.failed.append(f"{recipe.name}: {reported.study.ended_early}")
    else:
        bar.progress(1, total=1, note=f"{reported.cached.took_s:.1f} s" if reported.fresh else "cached")
    outcome.interrupted = bar.cancelled()
    return not outcome.interrupted


def _cached_or_computed(
    recipe: StudyRecipe, wanted: ReportOptions, cache: StudyCache, *, bar: ProgressBar
) -> ReportedStudy:
    key = cache_key(recipe.name, recipe.settings, files=recipe.files)
    if not wanted.fresh:
        try:
            cached = cache.find(recipe.name, key)
        except DamagedFile as error:
            Console(stderr=True, soft_wrap=True).print(
                f"{error}; computed again", markup=False, highlight=False
            )
            cached = None
        if cached is not None:
            return ReportedStudy(cached=cached, fresh=False)
    began_s = time.monotonic()
    study = recipe.compute(bar)
    cached = CachedStudy(
        study=study,
        took_s=time.monotonic() - began_s,
        made_utc=datetime.now(UTC).isoformat(timespec="seconds"),
    )
    if not study.ended_early:
        cache.store(key, cached)
    return ReportedStudy(cached=cached, fresh=True)
