"""Growth of a process's resources over time."""

from collections.abc import Sequence

import numpy as np

from foveacam_bench.figures import Figures
from foveacam_bench.soak.soaked_server import Resources


def growth_figures(held: Sequence[Resources], *, after: int) -> Figures:
    """Return the growth from the sample `after` to the last, null where that is the last.

    Slopes are least squares through those samples.
    """
    settled = held[min(after, len(held) - 1) :]
    first, last, several = settled[0], settled[-1], len(settled) > 1
    return {
        "rss_mb": round(last.rss_mb, 1),
        "rss_slope_mb_per_h": _slope_per_h(settled, [found.rss_mb for found in settled]),
        "threads": last.threads,
        "threads_growth": last.threads - first.threads if several else None,
        "fds": last.files.total(),
        "fds_growth": last.files.total() - first.files.total() if several else None,
        "files_more": dict(last.files - first.files) if several else None,
        "database_mb": round(last.database_mb, 2),
        "database_slope_mb_per_h": _slope_per_h(settled, [found.database_mb for found in settled]),
    }


def _slope_per_h(held: Sequence[Resources], values: Sequence[float]) -> float | None:
    if len(held) < 2:
        return None
    hours = [found.t_s / 3600.0 for found in held]
    return float(np.polyfit(hours, values, 1)[0])
