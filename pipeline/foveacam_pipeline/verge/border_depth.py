"""The depth of the border of a blank region, from the step of brightness at its edge.

Only the region and a narrow rim beyond its edge are compared, so that what lies behind the edge does not
count. The wide view is correlated with each fovea along the epipolar line; both must agree on a depth.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.verge.register import UNSEEN
from foveacam_pipeline.verge.survey import ReducedLook
from foveacam_pipeline.verge.template import bell, wide_window

HALF_PX = 22
"""Half side of the part of the wide view that is compared, survey px: 11 wide px."""
RIM_PX = 14
"""So much beyond the flat pixels of the region is compared too, survey px: its edge and little more."""
ROWS_PX = 3
STEP_PX = 0.5
"""Step of the depths tried, survey px of either eye."""
LEAST_SCORE = 0.85
"""Least correlation of each fovea with the wide view."""
LEAD = 0.04
"""By how much the best depth must fit better than any other."""
ONE_EYED_PENALTY = 0.08
"""A place that fits one eye alone counts as one that fits both so much worse."""
GUARD_PX = 5.0
"""Depths nearer to each other than this are one, survey px."""
SIGMA_PX = 0.45
"""Error of the shift of an edge in either fovea, survey px (measured on rendered clicks)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BorderDepth:
    """1/Z of one place on a border, how well the foveae fit there, and (tx, ty) of the place.

    `by_both`: whether both foveae fit. One alone may have seen a look-alike while the place itself was
    outside its field.
    """

    tangents: tuple[float, float]
    inverse_z_per_m: float
    sigma_per_m: float
    score: float
    by_both: bool

    def is_better_than(self, other: "BorderDepth | None") -> bool:
        """Return whether this measurement of a place counts rather than another one."""
        return other is None or (self.by_both, self.score) > (other.by_both, other.score)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BorderPatch:
    """A piece of the wide view about a place on a border, and the weights of its pixels, survey px."""

    tangents: NDArray[np.float64]
    image: NDArray[np.float32]
    weights: NDArray[np.float32]


def border_patch(
    gray: NDArray[np.uint8],
    region: NDArray[np.uint8],
    wide: Intrinsics,
    tangents: NDArray[np.float64],
    *,
    f_px: float,
    rim_px: int,
) -> BorderPatch:
    """Cut a patch about a place.

    `gray`: (h, w) wide image. `region`: (h, w) 255 in the region, else 0. `rim_px`: so much beyond it is
    compared too, survey px.
    """
    half = (HALF_PX, HALF_PX)
    image = wide_window(gray, wide, tangents, f_px=f_px, half=half)
    own = wide_window(region, wide, tangents, f_px=f_px, half=half) > 127.0
    size = 2 * rim_px + 1
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    compared = cv2.dilate(own.astype(np.float32), kernel)
    return BorderPatch(tangents=tangents, image=image, weights=compared * bell(image.shape))


def border_depth(
    look: ReducedLook, patch: BorderPatch, *, inverse_z_per_m: NDArray[np.float64], baseline_m: float
) -> BorderDepth | None:
    """Return the depth of a place as both foveae of one look show it; None where they do not.

    `look`: brightness as it is. `inverse_z_per_m`: (n,) evenly spaced depths to try.
    """
    profiles = []
    for eye, side in ((look.left, 1.0), (look.right, -1.0)):
        found = _scores(eye.image, eye.seen, patch, float(patch.tangents[1]) * look.f_px - eye.v0_px)
        if found is None:
            return None
        shift = side * 0.5 * baseline_m * inverse_z_per_m
        columns = look.f_px * (patch.tangents[0] + shift) - eye.u0_px - HALF_PX
        profiles.append(np.interp(columns, np.arange(len(found)), found, left=UNSEEN, right=UNSEEN))
    weaker = _weaker(*profiles)
    best = int(np.argmax(weaker))
    if weaker[best] < LEAST_SCORE or best in (0, len(weaker) - 1):
        return None
    step_px = look.f_px * 0.5 * baseline_m * float(inverse_z_per_m[1] - inverse_z_per_m[0])
    guard = max(1, round(GUARD_PX / step_px))
    elsewhere = np.concatenate([weaker[: max(0, best - guard)], weaker[best + guard + 1 :]])
    if len(elsewhere) and float(elsewhere.max()) > weaker[best] - LEAD:
        return None
    seen = [profile for profile in profiles if profile[best] >= LEAST_SCORE]
    near = slice(max(0, best - guard), best + guard + 1)
    inverse_z = _top(inverse_z_per_m[near], np.mean(seen, axis=0)[near])
    return BorderDepth(
        tangents=(float(patch.tangents[0]), float(patch.tangents[1])),
        inverse_z_per_m=inverse_z,
        sigma_per_m=SIGMA_PX / (look.f_px * 0.5 * baseline_m),
        score=float(weaker[best]),
        by_both=len(seen) == len(profiles),
    )


def _weaker(left: NDArray[np.float64], right: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the weaker correlation, or the stronger less a penalty: an edge may be hidden from one eye."""
    return np.maximum(np.minimum(left, right), np.maximum(left, right) - ONE_EYED_PENALTY)


def _scores(
    image: NDArray[np.float32], seen: NDArray[np.float32], patch: BorderPatch, row_px: float
) -> NDArray[np.float64] | None:
    """Return the best correlation of each column of one fovea; None when the rows are not in it."""
    first = round(row_px) - HALF_PX - ROWS_PX
    last = first + 2 * (HALF_PX + ROWS_PX) + 1
    if first < 0 or last > image.shape[0]:
        return None
    strip = image[first:last]
    found = cv2.matchTemplate(strip, patch.image, cv2.TM_CCOEFF_NORMED, mask=patch.weights)
    scores = np.nan_to_num(np.asarray(found, dtype=np.float64), nan=UNSEEN, posinf=UNSEEN, neginf=UNSEEN)
    side = 2 * HALF_PX + 1
    cover = cv2.blur(seen[first:last], (side, 1), borderType=cv2.BORDER_REPLICATE).min(axis=0)
    scores[:, cover[HALF_PX : HALF_PX + scores.shape[1]] < 0.97] = UNSEEN
    return np.asarray(scores.max(axis=0), dtype=np.float64)


def _top(x: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    """Return the place of the maximum, to a fraction of a step by a parabola."""
    k = int(np.argmax(y))
    if not 0 < k < len(y) - 1:
        return float(x[k])
    bend = y[k - 1] - 2.0 * y[k] + y[k + 1]
    shift = 0.5 * (y[k - 1] - y[k + 1]) / bend if bend < 0.0 else 0.0
    return float(x[k] + shift * (x[1] - x[0]))
