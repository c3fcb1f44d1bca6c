"""Measure the position of a point in another picture by weighted Gauss-Newton steps.

The steps correlate the gradients of the first picture with the brightness of the second, whose noises are
independent, so that noise does not bias the position towards whole pixels. Pixels near the point have larger
weights. Prior knowledge (rows match) enters as `PositionPrior`.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.matching.picture import InterpolatedPicture, WindowPlacement
from foveacam_pipeline.matching.spread import equation_variance, position_covariance
from foveacam_pipeline.matching.windows import Image, MatchWindow, WindowWeights, bell

STOP_PX = 1.0 / 256.0
"""An iteration that moves the position by less is the last one (Sec. 4.1)."""
ROUNDS = 10
"""Largest number of iterations."""
LEVEL_ROUNDS = 2
"""The first iterations move the window without changing its slopes."""
LARGEST_ROUND_PX = 2.0
HOPELESS_SCORE = 0.5
LEAST_GAIN = 0.03
"""A fit whose correlation is below the first limit and grew by less than the second in the level iterations
is a mismatch and gets an infinite error; right matches grow by 0.1 (rendered pairs)."""
STEEPEST = 1.9
"""The iteration stops when a slope exceeds this: it diverges."""

Vector = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class PositionPrior:
    """Prior of the position and the slopes, as standard deviations; infinite where nothing is known.

    `y_px`: expected row. `slopes`: number of slopes fitted: 0, 2 (of x: a surface seen by two eyes whose rows
    match) or 4 (any affine distortion).
    """

    y_px: float = 0.0
    y_sigma_px: float = math.inf
    slope_sigma: float = 0.5
    slopes: int = 2

    def weights(self, difference: Image, weighting: WindowWeights) -> Vector:
        """Return (2 + slopes,) prior weights relative to one equation of windows with this difference."""
        known = np.array([math.inf, self.y_sigma_px, *[self.slope_sigma] * self.slopes])
        variance = equation_variance(weighting.mean(difference * difference), weighting.samples)
        return np.asarray(variance / (known * known), dtype=np.float64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PointMatch:
    """Placement of the matched window in the other picture, relative to its middle.

    `covariance`: (2, 2) of the position, px², infinite along directions that the windows do not determine.
    `score`: weighted correlation, -1 to 1.
    """

    placement: WindowPlacement
    covariance: NDArray[np.float64]
    score: float

    @property
    def position_px(self) -> Vector:
        """(2,) the position, px."""
        return np.array([self.placement.x_px, self.placement.y_px])

    @property
    def sigma_px(self) -> tuple[float, float]:
        """Standard errors along x and y, px."""
        x_px, y_px = np.sqrt(np.diag(self.covariance)).tolist()
        return x_px, y_px


def match_point(
    first: InterpolatedPicture,
    second: InterpolatedPicture,
    start: WindowPlacement,
    *,
    window: MatchWindow,
    prior: PositionPrior,
) -> PointMatch | None:
    """Refine `start`, which must be right to a pixel or two; return None where a window has no contrast."""
    weighting = bell(window)
    reference = weighting.normalised(first.cut(weighting.half))
    moved = weighting.normalised(second.cut(weighting.half, start))
    if reference is None or moved is None:
        return None
    placement, moved, alike = _refined(
        _Steps.of(reference, weighting, prior), reference, second, (start, moved)
    )
    if not alike:
        unknown = np.diag([math.inf, math.inf])
        return PointMatch(placement=placement, covariance=unknown, score=weighting.mean(reference * moved))
    prior_weights = prior.weights(reference - moved, weighting)
    covariance = position_covariance(reference, moved, weighting, prior_weights, slopes=prior.slopes)
    return PointMatch(placement=placement, covariance=covariance, score=weighting.mean(reference * moved))


def _refined(
    steps: "_Steps", reference: Image, second: InterpolatedPicture, start: tuple[WindowPlacement, Image]
) -> tuple[WindowPlacement, Image, bool]:
    """Return the last placement, the window there, and whether both windows may show the same object."""
    weighting, (placement, moved) = steps.weighting, start
    first_score = weighting.mean(reference * moved)
    for count in range(ROUNDS):
        if count == LEVEL_ROUNDS:
            score = weighting.mean(reference * moved)
            if score < min(HOPELESS_SCORE, first_score + LEAST_GAIN):
                return placement, moved, False
        following = steps.after(placement, reference - moved, level=count < LEVEL_ROUNDS)
        step_px = max(abs(following.x_px - placement.x_px), abs(following.y_px - placement.y_px))
        if not step_px <= LARGEST_ROUND_PX or max(abs(following.xx), abs(following.xy)) > STEEPEST:
            break
        cut = weighting.normalised(second.cut(weighting.half, following))
        if cut is None:
            break
        placement, moved = following, cut
        if count >= LEVEL_ROUNDS and step_px < STOP_PX:
            break
    return placement, moved, True


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Steps:
    """The normal equations of a step; their left-hand side is the same in every iteration."""

    weighted: Image
    normal: NDArray[np.float64]
    weighting: WindowWeights
    prior: PositionPrior

    @classmethod
    def of(cls, reference: Image, weighting: WindowWeights, prior: PositionPrior) -> "_Steps":
        """Build the equations from the gradients of the first window."""
        columns = weighting.slopes(reference, prior.slopes)
        weighted = columns * weighting.weights.ravel()
        return cls(
            weighted=weighted,
            normal=(weighted @ columns.T).astype(np.float64),
            weighting=weighting,
            prior=prior,
        )

    def after(self, placement: WindowPlacement, difference: Image, *, level: bool) -> WindowPlacement:
        """Return the placement after one step; slopes do not change if `level`. The step is in window px."""
        weights = self.prior.weights(difference, self.weighting)
        scale = 1.0 + placement.xx
        towards = np.array(
            [
                0.0,
                self.prior.y_px - placement.y_px,
                -placement.xx / scale,
                -placement.xy / scale,
                -placement.yx,
                -placement.yy,
            ]
        )[: len(weights)]
        side = self.weighted @ difference.ravel() + weights * towards
        count = 2 if level else len(weights)
        normal = self.normal[:count, :count] + np.diag(weights[:count])
        step = np.zeros(6)
        try:
            step[:count] = np.linalg.solve(normal, side[:count])
        except np.linalg.LinAlgError:
            return placement
        return _moved(placement, step)


def _moved(placement: WindowPlacement, step: Vector) -> WindowPlacement:
    """Return the placement of the window composed with a step in window px."""
    slopes = np.array([[1.0 + placement.xx, placement.xy], [placement.yx, 1.0 + placement.yy]])
    x_px, y_px = (np.array([placement.x_px, placement.y_px]) + slopes @ step[:2]).tolist()
    (xx, xy), (yx, yy) = (slopes @ (np.eye(2) + step[2:].reshape(2, 2)) - np.eye(2)).tolist()
    return WindowPlacement(x_px=x_px, y_px=y_px, xx=xx, xy=xy, yx=yx, yy=yy)
