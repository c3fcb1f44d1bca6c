"""When a stream has messages, in short: its runs, the gaps between them, and what is missing in a run."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

GAP_PERIODS, GAP_NS = 8.0, 200_000_000
"""A gap is longer than so many periods, and than so long."""
DROP_PERIODS = 1.6
"""An interval of so many periods lacks a message, in a stream that keeps its period."""
REGULAR_SHARE = 0.8
"""Share of the intervals that are one period, from which on a stream keeps its period."""
MOST_RUNS, MOST_DROPS = 1000, 1000
"""Longer lists are shortened: the smallest gaps and drops are left out."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Track:
    """The messages of a stream. `period_ns`: the median interval; None with fewer than two messages.

    `runs_ns`: (n, 2) first and last message of each run; between two runs lies a gap. `drops_ns`: (m, 2) the
    messages before and after each interval in a run that lacks some, and `dropped`: (m,) how many, by the
    period; empty where the stream keeps none.
    """

    count: int
    period_ns: float | None
    runs_ns: NDArray[np.int64]
    drops_ns: NDArray[np.int64]
    dropped: NDArray[np.int64]


NO_TIMES = np.empty((0, 2), dtype=np.int64)


def track_of(t_ns: NDArray[np.int64]) -> Track:
    """Return the track of ascending times, (n,)."""
    if len(t_ns) < 2:
        runs = np.repeat(t_ns[:, None], 2, axis=1)
        return Track(count=len(t_ns), period_ns=None, runs_ns=runs, drops_ns=NO_TIMES, dropped=NO_TIMES[:, 0])
    intervals = np.diff(t_ns)
    period_ns = float(np.median(intervals))
    gap_ns = max(GAP_PERIODS * period_ns, GAP_NS)
    gaps = _largest(np.flatnonzero(intervals > gap_ns), intervals, MOST_RUNS - 1)
    runs = np.column_stack([t_ns[np.r_[0, gaps + 1]], t_ns[np.r_[gaps, len(t_ns) - 1]]])
    drops = _drops(intervals, period_ns, gap_ns)
    return Track(
        count=len(t_ns),
        period_ns=period_ns,
        runs_ns=runs,
        drops_ns=np.column_stack([t_ns[drops], t_ns[drops + 1]]),
        dropped=np.rint(intervals[drops] / max(period_ns, 1.0)).astype(np.int64) - 1,
    )


def _drops(intervals: NDArray[np.int64], period_ns: float, gap_ns: float) -> NDArray[np.intp]:
    """Return the intervals within runs that lack a message; none where the stream keeps no period."""
    within = intervals <= gap_ns
    even = np.abs(intervals[within] - period_ns) < (DROP_PERIODS - 1.0) * period_ns
    if period_ns <= 0.0 or even.mean() < REGULAR_SHARE:
        return np.empty(0, dtype=np.intp)
    return _largest(np.flatnonzero(within & (intervals >= DROP_PERIODS * period_ns)), intervals, MOST_DROPS)


def _largest(found: NDArray[np.intp], intervals: NDArray[np.int64], most: int) -> NDArray[np.intp]:
    """Return at most so many of the places, those with the longest intervals, in order."""
    if len(found) <= most:
        return found
    return np.sort(found[np.argsort(intervals[found])[::-1][:most]])
