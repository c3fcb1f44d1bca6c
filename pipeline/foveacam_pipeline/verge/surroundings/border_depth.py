"""The depth of the border of a blank region, from the step of brightness at its edge.

Only the region and a narrow rim beyond its edge are compared, so that what lies behind the edge does not
count. The wide view is correlated with each fovea along the epipolar line; both must agree on a depth.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.matching.correlation import UNSEEN, vertex
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.verge.matching.row_spectra import LookRows, PictureRows, WeightedPatch
from foveacam_pipeline.verge.matching.wide_patch import bell, wide_window

HALF_PX = 22
"""Half side of the part of the wide view that is compared, survey px: 11 wide px."""
RIM_PX = 12
"""Width of the rim beyond the region's flat pixels that is compared too, survey px: its edge and little
more."""
NEAR_PX, FAR_PX = 10, 24
"""Distances from the flat pixels between which what lies beyond an edge is compared, survey px."""
LEAST_CONTRAST = 3.0
"""Least contrast of what lies beyond, as a multiple of the image's noise."""
LEAST_WEIGHT = 20.0
"""Least sum of weights of what lies beyond, px."""
SAME_STEPS = 4
"""Steps about the edge's depth within which what lies beyond is compared."""
ROWS_PX = 3
STEP_PX = 0.5
"""Step of the depths tried, survey px of either eye."""
LEAST_SCORE = 0.85
"""Least correlation of each fovea with the wide view."""
LEAD = 0.04
"""Least lead in correlation of the best depth over any other."""
ONE_EYED_PENALTY = 0.08
"""Penalty on the correlation of a place that fits one eye alone."""
GUARD_PX = 5.0
"""Depths closer to each other than this count as one, survey px."""
SURE_SCORE, SURE_LEAD = 0.9, 0.12
"""Least correlation of one fovea by itself, and the lead that rules other depths out."""
MOST_SPREAD, MOST_SPREAD_PX = 0.06, 7.0
"""Largest spread of the remaining depths at which one fovea suffices, relative to 1/Z and in survey px: a
share alone lets what is near pass that looks alike at many depths."""
LEAST_WEIGHTED = 0.1
"""Least share of a patch's pixels that must count for one fovea to suffice."""
COUNTING_WEIGHT = 0.3
"""Least weight at which a pixel of a patch counts."""
SIGMA_PX = 0.45
"""Standard error of the shift of an edge in either fovea, survey px (measured on rendered clicks)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BorderDepth:
    """1/Z of one place on a border, its correlation in the foveae, and (tx, ty) of the place.

    `by_both`: whether both foveae fit. `beyond`: the better fovea's correlation at that depth of what lies
    beyond the edge; None where it has no texture, or is not seen.
    """

    tangents: tuple[float, float]
    inverse_z_per_m: float
    sigma_per_m: float
    score: float
    by_both: bool
    beyond: float | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BorderPatch:
    """A piece of the wide view about a place on a border, and the weights of its pixels, survey px.

    `weights`: of the region and its edge. `beyond`: of what lies beyond the edge; None without texture.
    `textured`: whether what `weights` count has texture; False where the image's noise is not known.
    """

    tangents: NDArray[np.float64]
    image: NDArray[np.float32]
    weights: NDArray[np.float32]
    beyond: NDArray[np.float32] | None
    textured: bool


def border_patch(
    gray: NDArray[np.uint8],
    region: NDArray[np.uint8],
    wide: Intrinsics,
    tangents: NDArray[np.float64],
    *,
    f_px: float,
    rim_px: int = RIM_PX,
    noise: float | None = None,
) -> BorderPatch:
    """Cut a patch about a place.

    `gray`: (h, w) wide image. `region`: (h, w) 255 in the region, else 0. `rim_px`: width of the rim beyond
    it that is compared too, survey px. `noise`: of the image, grey levels; without it what lies beyond is not
    compared.
    """
    half = (HALF_PX, HALF_PX)
    image = wide_window(gray, wide, tangents, f_px=f_px, half=half)
    own = (wide_window(region, wide, tangents, f_px=f_px, half=half) > 127.0).astype(np.float32)
    bells = bell(image.shape)
    beyond = (_grown(own, FAR_PX) - _grown(own, NEAR_PX)) * bells
    weights = _grown(own, rim_px) * bells
    least = np.inf if noise is None else LEAST_CONTRAST * noise
    return BorderPatch(
        tangents=tangents,
        image=image,
        weights=weights,
        beyond=beyond if _contrast(image, beyond) >= least else None,
        textured=_contrast(image, weights) >= least,
    )


class BorderPlace:
    """One place on a border: the correlation of each fovea at each depth, over all looks."""

    def __init__(
        self, patch: BorderPatch, *, inverse_z_per_m: NDArray[np.float64], baseline_m: float, f_px: float
    ) -> None:
        """`inverse_z_per_m`: (n,) evenly spaced depths to try."""
        self.patch = patch
        self._grid = inverse_z_per_m
        self._half_baseline_m = 0.5 * baseline_m
        self._f_px = f_px
        count = len(inverse_z_per_m)
        self._edge = np.full((2, count), UNSEEN)
        self._beyond = np.full((2, count), UNSEEN)
        self._weighted = WeightedPatch(patch.image, patch.weights)
        self._weighted_beyond = None if patch.beyond is None else WeightedPatch(patch.image, patch.beyond)
        self._not_compared: list[tuple[int, PictureRows]] = []
        """Eyes, with their pictures, in which what lies beyond the edge is yet to be compared."""

    def add(self, look: LookRows) -> bool:
        """Add a further look; return whether it shows the place at any depth."""
        shown = False
        for k, eye in enumerate((look.left, look.right)):
            edge = self._profile(eye, k, self._weighted)
            if edge is not None:
                shown = True
                self._edge[k] = np.maximum(self._edge[k], edge)
                self._not_compared.append((k, eye))
        return shown

    def sure_of_each(self) -> dict[Role, tuple[float, float]]:
        """Return 1/Z and its error from each fovea by itself, unless it is ambiguous or fits badly."""
        counting = float((self.patch.weights >= COUNTING_WEIGHT).mean())
        if counting < LEAST_WEIGHTED or not self.patch.textured:
            return {}
        found = {}
        for role, scores in zip((Role.LEFT, Role.RIGHT), self._edge, strict=True):
            best = int(np.argmax(scores))
            alike = self._grid[scores > scores[best] - SURE_LEAD]
            spread = float(alike.max() - alike.min())
            spread_px = spread * self._f_px * self._half_baseline_m
            distinct = spread <= MOST_SPREAD * self._grid[best] and spread_px <= MOST_SPREAD_PX
            if scores[best] >= SURE_SCORE and distinct:
                near = self._about(best)
                sigma = max(self.sigma_per_m, spread / math.sqrt(12.0))
                found[role] = _top(self._grid[near], scores[near]), sigma
        return found

    @property
    def sigma_per_m(self) -> float:
        """Standard error of 1/Z of an edge in one fovea."""
        return SIGMA_PX / (self._f_px * self._half_baseline_m)

    def _about(self, best: int) -> slice:
        """Return the range of depths that are not resolved from a given one."""
        step_px = self._f_px * self._half_baseline_m * float(self._grid[1] - self._grid[0])
        guard = max(1, round(GUARD_PX / step_px))
        return slice(max(0, best - guard), best + guard + 1)

    def depth(self) -> BorderDepth | None:
        """Return the depth of the place by the foveae; None where it does not fit or is ambiguous."""
        weaker = _weaker(*self._edge)
        best = int(np.argmax(weaker))
        if weaker[best] < LEAST_SCORE or best in (0, len(weaker) - 1):
            return None
        near = self._about(best)
        elsewhere = np.concatenate([weaker[: near.start], weaker[near.stop :]])
        if len(elsewhere) and float(elsewhere.max()) > weaker[best] - LEAD:
            return None
        fits = [k for k in (0, 1) if self._edge[k, best] >= LEAST_SCORE]
        beyond = float(self._compared()[:, max(0, best - SAME_STEPS) : best + SAME_STEPS + 1].max())
        return BorderDepth(
            tangents=(float(self.patch.tangents[0]), float(self.patch.tangents[1])),
            inverse_z_per_m=_top(self._grid[near], np.mean(self._edge[fits], axis=0)[near]),
            sigma_per_m=self.sigma_per_m,
            score=float(weaker[best]),
            by_both=len(fits) == 2,
            beyond=None if beyond <= UNSEEN else beyond,
        )

    def _compared(self) -> NDArray[np.float64]:
        """Return (2, n) the correlation of what lies beyond the edge with either fovea at each depth."""
        patch = self._weighted_beyond
        for k, eye in self._not_compared:
            beyond = None if patch is None else self._profile(eye, k, patch)
            if beyond is not None:
                self._beyond[k] = np.maximum(self._beyond[k], beyond)
        self._not_compared.clear()
        return self._beyond

    def _profile(self, eye: PictureRows, k: int, patch: WeightedPatch) -> NDArray[np.float64] | None:
        """Return (n,) the correlation of a weighted patch with the left (0) or right fovea at each depth.

        None where the fovea shows the place at no depth.
        """
        tx, ty = self.patch.tangents
        first = round(float(ty) * self._f_px - eye.v0_px) - HALF_PX - ROWS_PX
        rows = slice(first, first + 2 * (HALF_PX + ROWS_PX) + 1)
        side = (1.0, -1.0)[k] * self._half_baseline_m
        columns = self._f_px * (tx + side * self._grid) - eye.u0_px - HALF_PX
        last = eye.width - 2 * HALF_PX - 1
        if rows.start < 0 or rows.stop > eye.height or columns.max() < 0.0 or columns.min() > last:
            return None
        hidden = eye.hidden(rows, 2 * HALF_PX + 1)
        if hidden.all():
            return None
        found = patch.scores(eye, range(first, first + 2 * ROWS_PX + 1))
        found[hidden] = UNSEEN
        return np.asarray(np.interp(columns, np.arange(len(found)), found, left=UNSEEN, right=UNSEEN))


def _grown(own: NDArray[np.float32], px: int) -> NDArray[np.float32]:
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * px + 1, 2 * px + 1))
    return np.asarray(cv2.dilate(own, kernel), dtype=np.float32)


def _contrast(image: NDArray[np.float32], weights: NDArray[np.float32]) -> float:
    """Return the weighted standard deviation of a patch, grey levels; 0 without any weight."""
    total = float(weights.sum())
    if total <= LEAST_WEIGHT:
        return 0.0
    mean = float((weights * image).sum()) / total
    return float(np.sqrt((weights * (image - mean) ** 2).sum() / total))


def _weaker(left: NDArray[np.float64], right: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the weaker correlation, or the stronger less a penalty: an edge may be hidden from one eye."""
    return np.maximum(np.minimum(left, right), np.maximum(left, right) - ONE_EYED_PENALTY)


def _top(x: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    """Return the abscissa of the maximum, interpolated by a parabola."""
    k = int(np.argmax(y))
    if not 0 < k < len(y) - 1:
        return float(x[k])
    return float(x[k] + vertex(*y[k - 1 : k + 2].tolist()) * (x[1] - x[0]))
