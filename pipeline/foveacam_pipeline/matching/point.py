"""The place of a point in another picture, by weighted Gauss-Newton steps on the slopes of the first picture.

The steps correlate slopes of one picture with the other's brightness, whose noises are independent: noise
does not pull the place towards whole pixels. Pixels weigh by their nearness to the point, so that they answer
for the point and not for its surroundings. What is known beforehand (rows match) enters as `PlacePrior`.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.matching.picture import InterpolatedPicture, WindowPlacement
from foveacam_pipeline.matching.spread import equation_variance, place_covariance
from foveacam_pipeline.matching.windows import Image, MatchWindow, WindowWeights, bell

STOP_PX = 1.0 / 256.0
"""A round that moves the place by less is the last one (Sec. 4.1)."""
ROUNDS = 10
LEVEL_ROUNDS = 2
"""The first rounds move the window and keep its slopes."""
LARGEST_ROUND_PX = 2.0
HOPELESS_SCORE = 0.5
LEAST_GAIN = 0.03
"""A fit whose correlation stays below the one and grew by less than the other in the level rounds is not of
the same thing; those of the same thing grow by 0.1 (rendered pairs). Its error is infinite."""
STEEPEST = 1.9
"""A fit whose slopes grow beyond has lost its way."""

Vector = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacePrior:
    """What is expected of the place, as standard deviations; infinite where nothing is known.

    `y_px`: the row expected. `slopes`: how many are fitted: 0, 2 (of x: a surface before two eyes whose rows
    match) or 4 (any affine change).
    """

    y_px: float = 0.0
    y_sigma_px: float = math.inf
    slope_sigma: float = 0.5
    slopes: int = 2

    def weights(self, difference: Image, lens: WindowWeights) -> Vector:
        """Return (2 + slopes,) what is known weighs against the equations of two windows that differ so."""
        known = np.array([math.inf, self.y_sigma_px, *[self.slope_sigma] * self.slopes])
        variance = equation_variance(lens.mean(difference * difference), lens.samples)
        return np.asarray(variance / (known * known), dtype=np.float64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PointMatch:
    """Where the point is in the other picture, from its middle, and how well the windows agree there.

    `covariance`: (2, 2) of the place, px², infinite along what the windows do not tell. `score`: weighted
    correlation, -1 to 1.
    """

    place: WindowPlacement
    covariance: NDArray[np.float64]
    score: float

    @property
    def place_px(self) -> Vector:
        """(2,) the place, px."""
        return np.array([self.place.x_px, self.place.y_px])

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
    prior: PlacePrior,
) -> PointMatch | None:
    """Refine `start`, which must be right to a pixel or two; None where a window shows nothing."""
    lens = bell(window)
    reference = lens.normalised(first.cut(lens.half))
    moved = lens.normalised(second.cut(lens.half, start))
    if reference is None or moved is None:
        return None
    place, moved, alike = _refined(_Steps.of(reference, lens, prior), reference, second, (start, moved))
    if not alike:
        nothing = np.diag([math.inf, math.inf])
        return PointMatch(place=place, covariance=nothing, score=lens.mean(reference * moved))
    known = prior.weights(reference - moved, lens)
    covariance = place_covariance(reference, moved, lens, known, slopes=prior.slopes)
    return PointMatch(place=place, covariance=covariance, score=lens.mean(reference * moved))


def _refined(
    steps: "_Steps", reference: Image, second: InterpolatedPicture, start: tuple[WindowPlacement, Image]
) -> tuple[WindowPlacement, Image, bool]:
    """Return the place after the last round, the window there, and whether the two may be of one thing."""
    lens, (place, moved) = steps.lens, start
    first_score = lens.mean(reference * moved)
    for count in range(ROUNDS):
        if count == LEVEL_ROUNDS:
            score = lens.mean(reference * moved)
            if score < min(HOPELESS_SCORE, first_score + LEAST_GAIN):
                return place, moved, False
        following = steps.after(place, reference - moved, level=count < LEVEL_ROUNDS)
        step_px = max(abs(following.x_px - place.x_px), abs(following.y_px - place.y_px))
        if not step_px <= LARGEST_ROUND_PX or max(abs(following.xx), abs(following.xy)) > STEEPEST:
            break
        cut = lens.normalised(second.cut(lens.half, following))
        if cut is None:
            break
        place, moved = following, cut
        if count >= LEVEL_ROUNDS and step_px < STOP_PX:
            break
    return place, moved, True


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Steps:
    """The equations of a step, whose left-hand side stays the same from round to round."""

    weighted: Image
    normal: NDArray[np.float64]
    lens: WindowWeights
    prior: PlacePrior

    @classmethod
    def of(cls, reference: Image, lens: WindowWeights, prior: PlacePrior) -> "_Steps":
        """Take the slopes of the first window."""
        columns = lens.slopes(reference, prior.slopes)
        weighted = columns * lens.weights.ravel()
        return cls(
            weighted=weighted, normal=(weighted @ columns.T).astype(np.float64), lens=lens, prior=prior
        )

    def after(self, place: WindowPlacement, difference: Image, *, level: bool) -> WindowPlacement:
        """Return where one step leads; the slopes stay when `level`. The step is in the window's own px."""
        weights = self.prior.weights(difference, self.lens)
        scale = 1.0 + place.xx
        towards = np.array(
            [0.0, self.prior.y_px - place.y_px, -place.xx / scale, -place.xy / scale, -place.yx, -place.yy]
        )[: len(weights)]
        side = self.weighted @ difference.ravel() + weights * towards
        count = 2 if level else len(weights)
        normal = self.normal[:count, :count] + np.diag(weights[:count])
        step = np.zeros(6)
        try:
            step[:count] = np.linalg.solve(normal, side[:count])
        except np.linalg.LinAlgError:
            return place
        return _moved(place, step)


def _moved(place: WindowPlacement, step: Vector) -> WindowPlacement:
    """Return the placement of the window after its own places were moved by a step."""
    slopes = np.array([[1.0 + place.xx, place.xy], [place.yx, 1.0 + place.yy]])
    x_px, y_px = (np.array([place.x_px, place.y_px]) + slopes @ step[:2]).tolist()
    (xx, xy), (yx, yy) = (slopes @ (np.eye(2) + step[2:].reshape(2, 2)) - np.eye(2)).tolist()
    return WindowPlacement(x_px=x_px, y_px=y_px, xx=xx, xy=xy, yx=yx, yy=yy)
