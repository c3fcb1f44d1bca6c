"""The wide context in figures."""

import time

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.context.values import ContextMap, DepthSource
from foveacam_pipeline.context.wide_context import WideContext
from foveacam_server.resources.wide_depth.schema import WideDepthDocument

DEPTH_DIGITS, SHARE_DIGITS = 4, 5


def summary(
    known: ContextMap,
    context: WideContext,
    *,
    surveyed_fraction: float | None,
    survey_job_id: str | None,
    url: str,
) -> WideDepthDocument:
    """Return the document of a snapshot of `context`."""
    at = known.known[0]
    q, age_s = known.inverse_z_per_m[0][at], time.time() - known.measured_s[0][at]
    source = known.source[0][at]
    cells = len(q)
    return WideDepthDocument(
        columns=context.columns,
        rows=context.rows,
        cell_px=context.cell_px,
        known_cells=cells,
        known_fraction=round(cells / at.size, SHARE_DIGITS),
        sources={each.name.lower(): int(np.count_nonzero(source == each)) for each in DepthSource},
        nearest_m=_quantile(1.0 / q, 0.05, DEPTH_DIGITS),
        farthest_m=_quantile(1.0 / q, 0.95, DEPTH_DIGITS),
        relative_sigma_median=_quantile(known.sigma_per_m[0][at] / q, 0.5, SHARE_DIGITS + 1),
        age_median_s=_quantile(age_s, 0.5, 1),
        oldest_s=_quantile(age_s, 1.0, 1),
        surveyed_fraction=None if surveyed_fraction is None else round(surveyed_fraction, SHARE_DIGITS),
        survey_job_id=survey_job_id,
        png_url=f"{url}.png",
        ply_url=f"{url}.ply",
    )


def _quantile(values: NDArray[np.float64], share: float, digits: int) -> float | None:
    return None if len(values) == 0 else round(float(np.quantile(values, share)), digits)
