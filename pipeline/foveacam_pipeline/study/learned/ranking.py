"""Statistics of the methods' figures: means, deviations, gaps, and contradictions between two measures."""

import math
import statistics
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from foveacam_pipeline.study.learned.outcomes import Method, RowFigures

Measure = Callable[[RowFigures], float | None]
Rows = Mapping[Method, Sequence[RowFigures]]
MEASURES: Mapping[str, Measure] = {
    "photometric": lambda row: row.photometric,
    "photometric_seen": lambda row: row.photometric_seen,
    "l1": lambda row: row.absolute,
    "epe_px": lambda row: row.epe_px,
    "bad_1": lambda row: row.bad_1,
    "abs_rel": lambda row: row.abs_rel,
    "answered": lambda row: row.answered,
    "within_1_sigma": lambda row: row.within_1_sigma,
}
"""Columns of the table, by their keys; smaller is better but for the last two."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """Mean over seeds and standard deviation of one seed; NaN of a single one."""

    mean: float
    deviation: float

    def text(self, form: str) -> str:
        """Return mean ± standard deviation, or the mean alone."""
        mean = format(self.mean, form)
        return f"{mean} ± {format(self.deviation, form)}" if math.isfinite(self.deviation) else mean


def spread(rows: Sequence[RowFigures], measure: Measure) -> Spread | None:
    """Return the spread of a measure over seeds; None where a method has none."""
    found = [value for row in rows if (value := measure(row)) is not None]
    if not found:
        return None
    deviation = statistics.stdev(found) if len(found) > 1 else math.nan
    return Spread(mean=statistics.fmean(found), deviation=deviation)


def gap(worse: Sequence[RowFigures], better: Sequence[RowFigures], measure: Measure) -> Spread:
    """Return by how much one method is worse than another, and the standard deviation of that difference.

    Positive where it is worse. The deviation is that of one seed's difference: both variances added, halved.
    """
    first, second = spread(worse, measure), spread(better, measure)
    if first is None or second is None:
        raise ValueError("a gap is that of two methods which have the measure")
    pooled = math.sqrt((first.deviation**2 + second.deviation**2) / 2.0)
    return Spread(mean=first.mean - second.mean, deviation=pooled)


def in_deviations(found: Spread) -> float | None:
    """Return a gap in standard deviations; None where there is no deviation."""
    return found.mean / found.deviation if found.deviation > 0.0 else None


def misranked(rows: Rows) -> list[tuple[Method, Method]]:
    """Return pairs of methods of which the first has the smaller photometric error and the larger EPE.

    Both differences exceed their standard deviation, where there is one. Methods that leave holes are left
    out: each measure then counts other pixels.
    """
    whole = [method for method, found in rows.items() if min(row.answered for row in found) > 0.999]
    found = []
    for one, other in combinations(whole, 2):
        photometric, epe = (gap(rows[one], rows[other], MEASURES[key]) for key in ("photometric", "epe_px"))
        chance = any(abs(each.mean) <= each.deviation for each in (photometric, epe))
        if photometric.mean * epe.mean < 0.0 and not chance:
            found.append((one, other) if photometric.mean < 0.0 else (other, one))
    return found
