"""Least-squares adjustment of a mosaic: each view may shift, and all may turn and stretch alike.

Drift of a mount during a scan shifts views one by one; its roll, or an error of the focal length, turns or
stretches all of them about their gazes. Weak priors for no change determine what the overlaps do not.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from foveacam_pipeline.capture.mosaic.correspondences import ViewCorrespondence
from foveacam_pipeline.capture.mosaic.values import SeamFigures
from foveacam_pipeline.capture.mosaic.views import Floats, MosaicView

SHIFT_PRIOR_PX = 3.0
TURN_PRIOR = 0.005
GAIN_PRIOR = 0.3
GAIN_NOISE = 0.01
"""Relative standard deviation of the brightness ratio of two views of one point, apart from the gains."""
HUBER_SIGMAS = 3.0
ROUNDS = 4
LEAST_F_RATIO = 2.0
"""Minimum F ratio of the improvement by an adjustment to what its free parameters achieve by chance."""
TURN_PARAMETERS = 4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Adjustment:
    """`shifts_px`: (n, 2) per view; `turn`: (2, 2) of all; `gains`: (n,); residuals before and after."""

    shifts_px: Floats
    turn: Floats
    gains: Floats
    figures: SeamFigures


def adjust_views(
    count: int, links: Sequence[ViewCorrespondence], *, rejected: int, allowed: bool = True
) -> Adjustment:
    """Return the adjustment of `count` views; no change when it is not larger than its own error."""
    fitting = [link for link in links if not link.held_out]
    held_out = [link for link in links if link.held_out]
    shifts, turn, worth = np.zeros((count, 2)), np.eye(2), False
    if allowed and fitting:
        shifts, turn, worth = _solve(count, fitting)
    before = seam_rms_px(held_out, np.zeros((count, 2)), np.eye(2))
    after = seam_rms_px(held_out, shifts, turn)
    worth = worth and not after > before
    if not worth:
        shifts, turn, after = np.zeros((count, 2)), np.eye(2), before
    gains = _gains(count, links)
    own = [float(np.trace(link.covariance)) for link in held_out]
    figures = SeamFigures(
        links=len(links),
        rejected=rejected,
        before_rms_px=before,
        after_rms_px=after,
        measuring_rms_px=float(np.sqrt(np.mean(own))) if own else float("nan"),
        adjusted=worth,
        largest_shift_px=float(np.abs(shifts).max(initial=0.0)),
        largest_gain_percent=100.0 * float(np.abs(gains - 1.0).max(initial=0.0)),
    )
    return Adjustment(shifts_px=shifts, turn=turn, gains=gains, figures=figures)


def apply_adjustment(views: Sequence[MosaicView], adjustment: Adjustment) -> list[MosaicView]:
    """Return the views with the adjustment applied."""
    return [
        view.with_adjustment(view.look.with_adjustment(shift, adjustment.turn), float(gain))
        for view, shift, gain in zip(views, adjustment.shifts_px, adjustment.gains, strict=True)
    ]


def residuals_px(links: Sequence[ViewCorrespondence], shifts_px: Floats, turn: Floats) -> Floats:
    """Return (n, 2): the offsets of corresponding points after an adjustment."""
    if not links:
        return np.empty((0, 2))
    extra = turn - np.eye(2)
    return np.array(
        [
            link.offset_px
            + shifts_px[link.second]
            - shifts_px[link.first]
            + extra @ (link.relative_px[1] - link.relative_px[0])
            for link in links
        ]
    )


def seam_rms_px(links: Sequence[ViewCorrespondence], shifts_px: Floats, turn: Floats) -> float:
    """Return the rms distance between corresponding points of two views, px; NaN without correspondences."""
    apart = residuals_px(links, shifts_px, turn)
    return float(np.sqrt(np.mean(np.sum(apart**2, axis=1)))) if len(apart) else float("nan")


def _solve(count: int, links: Sequence[ViewCorrespondence]) -> tuple[Floats, Floats, bool]:
    """Return the shifts, the turn, and whether their F ratio is significant."""
    design, apart = _equations(count, links)
    prior = np.concatenate([np.full(2 * count, SHIFT_PRIOR_PX), np.full(TURN_PARAMETERS, TURN_PRIOR)]) ** -2.0
    weights: Floats = np.ones(len(links), dtype=np.float64)
    unknowns: Floats = np.zeros(design.shape[1])
    for _ in range(ROUNDS):
        scale = np.repeat(np.sqrt(weights), 2)
        a, b = scale[:, None] * design, scale * apart
        unknowns = np.asarray(np.linalg.solve(a.T @ a + np.diag(prior), -a.T @ b), dtype=np.float64)
        size = np.linalg.norm((design @ unknowns + apart).reshape(-1, 2), axis=1)
        typical = max(1.0, float(np.median(size)) / 1.18)
        weights = np.asarray(
            np.minimum(1.0, HUBER_SIGMAS * typical / np.maximum(size, 1e-9)), dtype=np.float64
        )
    scale = np.repeat(np.sqrt(weights), 2)
    before = float(np.sum((scale * apart) ** 2))
    after = float(np.sum((scale * (design @ unknowns + apart)) ** 2))
    free = 2 * (count - 1) + TURN_PARAMETERS
    spare = max(1, 2 * len(links) - free)
    gain = (before - after) / free / max(after / spare, 1e-12)
    shifts = unknowns[: 2 * count].reshape(count, 2)
    return shifts, np.eye(2) + unknowns[2 * count :].reshape(2, 2), gain > LEAST_F_RATIO


def _equations(count: int, links: Sequence[ViewCorrespondence]) -> tuple[Floats, Floats]:
    """Return the design (2 n, 2 count + 4) and the offsets (2 n,), both divided by their errors."""
    design = np.zeros((len(links), 2, 2 * count + TURN_PARAMETERS))
    apart = np.zeros((len(links), 2))
    for k, link in enumerate(links):
        for axis in (0, 1):
            design[k, axis, 2 * link.second + axis] += 1.0
            design[k, axis, 2 * link.first + axis] -= 1.0
            design[k, axis, 2 * count + 2 * axis : 2 * count + 2 * axis + 2] = (
                link.relative_px[1] - link.relative_px[0]
            )
        whitening = np.linalg.inv(np.linalg.cholesky(link.covariance))
        design[k] = whitening @ design[k]
        apart[k] = whitening @ link.offset_px
    return design.reshape(-1, 2 * count + TURN_PARAMETERS), apart.ravel()


def _gains(count: int, links: Sequence[ViewCorrespondence]) -> Floats:
    """Return (count,) factors that make overlapping views equally bright, with a mean logarithm of 0."""
    if not links:
        return np.ones(count)
    design = np.zeros((len(links), count))
    rows = np.arange(len(links))
    design[rows, [link.second for link in links]] = 1.0
    design[rows, [link.first for link in links]] = -1.0
    brightness = np.array([link.brightness for link in links])
    weights = np.ones(len(links))
    logs = np.zeros(count)
    for _ in range(ROUNDS):
        normal = (design.T * weights) @ design / GAIN_NOISE**2 + np.eye(count) / GAIN_PRIOR**2
        logs = np.linalg.solve(normal, -(design.T * weights) @ brightness / GAIN_NOISE**2)
        weights = np.minimum(
            1.0, HUBER_SIGMAS * GAIN_NOISE / np.maximum(np.abs(design @ logs + brightness), 1e-9)
        )
    return np.asarray(np.exp(logs), dtype=np.float64)
