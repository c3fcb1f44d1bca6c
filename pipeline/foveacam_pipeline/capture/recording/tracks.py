"""Summary of a stream's message times: its runs, the gaps between them, and the messages missing in a run."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

GAP_PERIODS, GAP_NS = 8.0, 200_000_000
"""An interval longer than both, in periods and in time, is a gap."""
DROP_PERIODS = 1.6
"""Interval, in periods, from which a message is missing; only for streams with a regular period."""
REGULAR_SHARE = 0.8
"""Minimum share of intervals of one period in a stream with a regular period."""
MOST_RUNS, MOST_DROPS = 1000, 1000
"""Maximum lengths of the lists; the smallest gaps and drops are left out."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Track:
    """The messages of a stream. `period_ns`: the median interval; None with fewer than two messages.

    `runs_ns`: (n, 2) first and last message of each run; between two runs lies a gap. `drops_ns`: (m, 2) the
    messages before and after each interval in a run that lacks some, and `dropped`: (m,) how many, by the
    period; empty for a stream without a regular period.
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
    """Return the intervals within runs that lack a message; none for a stream without a regular period."""
    within = intervals <= gap_ns
    even = np.abs(intervals[within] - period_ns) < (DROP_PERIODS - 1.0) * period_ns
    if period_ns <= 0.0 or even.mean() < REGULAR_SHARE:
        return np.empty(0, dtype=np.intp)
    return _largest(np.flatnonzero(within & (intervals >= DROP_PERIODS * period_ns)), intervals, MOST_DROPS)


def _largest(found: NDArray[np.intp], intervals: NDArray[np.int64], most: int) -> NDArray[np.intp]:
    """Return the places with the longest intervals, at most `most`, in order."""
    if len(found) <= most:
        return found
    return np.sort(found[np.argsort(intervals[found])[::-1][:most]])
