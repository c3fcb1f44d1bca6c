"""Shows on stderr how long a bench takes and how far it is; stdout is left to the figures."""

import json
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console

from foveacam_bench.figures import Figures, Report

LINE_PERIOD_S, SCREEN_PERIOD_S = 15.0, 1.0
"""Between two lines of a log, and between two changes of the line of a terminal."""


@contextmanager
def shown_progress(name: str, *, limits_s: tuple[int, int], notes: Sequence[str] = ()) -> Iterator[Report]:
    """Show the duration and `notes` at once, and what is reported with the elapsed time until the end."""
    console = Console(stderr=True, highlight=False, soft_wrap=True)
    expected = duration_text(limits_s)
    console.print(f"bench {name}: {expected} on two cores", *notes, sep="; ")
    began_s, part, ended = time.monotonic(), "", threading.Event()

    def line() -> str:
        elapsed = f"{time.monotonic() - began_s:.0f} s ({expected})"
        return f"bench {name}: {part}, {elapsed}" if part else f"bench {name}: {elapsed}"

    def report(progress: str) -> None:
        nonlocal part
        part = progress

    def show() -> None:
        if not console.is_terminal:
            while not ended.wait(LINE_PERIOD_S):
                console.print(line())
            return
        with console.status(line()) as status:
            while not ended.wait(SCREEN_PERIOD_S):
                status.update(line())

    thread = threading.Thread(target=show, name="bench-progress")
    thread.start()
    try:
        yield report
    finally:
        ended.set()
        thread.join()


def show_part(figures: Figures) -> None:
    """Show the figures of a part on stderr, as a line of JSON: what a bench that is cut off has measured."""
    show_note(json.dumps(figures, default=str))


def show_note(text: str) -> None:
    """Show a line on stderr: what a figure counts, or why it is null."""
    Console(stderr=True, highlight=False, soft_wrap=True).print(text, markup=False)


def duration_text(limits_s: tuple[int, int]) -> str:
    """Return a range of durations in words: seconds up to two minutes, minutes above."""
    least, most = limits_s
    if least == 0:
        return f"meant for {most} s"
    return f"{least} to {most} s" if most <= 120 else f"{least // 60} to {-(-most // 60)} min"
