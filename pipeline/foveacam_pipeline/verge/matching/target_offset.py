"""Detection of a knocked mount: both foveae show a target, but not where the calibration predicts it.

The search is limited to places that the calibration allows, so that no look-alike is taken for the target.
When it finds nothing, both foveae are searched entirely: a patch that fits one place in each, the same in
both, and nothing else in the wide view, gives the offset of the eyes. It is no place to verge on: distances
would be wrong as well.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.matching.correlation import UNSEEN, best_outside, correlation, peak, score_map
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.verge.matching.register import BAND_PX, GUARD_PX, SLACK_PX
from foveacam_pipeline.verge.matching.survey import ReducedEye, ReducedLook
from foveacam_pipeline.verge.matching.wide_patch import WidePatch, cut_view

SURE_SCORE = 0.75
"""Least correlation of each fovea with the patch."""
ALIKE_SCORE = 0.6
"""Least correlation of both with each other: oblique surfaces look different to them."""
LEAD = 0.15
"""Least lead of the best place over any other in the fovea."""
ALONE_SCORE = 0.6
"""Largest correlation with anything else in the wide view: a look-alike beside a hidden target is no
knock."""
REACH_PX = (160, 120)
"""Range about the target in which look-alikes are searched for, survey px: what a fovea shows."""
HERE_PX = 12
"""Places within this distance of the target are its own, survey px."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetOffset:
    """Offset of a target from its calibrated place, as both eyes show it, fovea px.

    `across_px`, `down_px`: to the right and down, the mean of both eyes. `rows_px`: how much lower the right
    eye shows it than the left. `sigma_px`: standard error of each.
    """

    across_px: float
    down_px: float
    rows_px: float
    sigma_px: float


def find_target_offset(
    look: ReducedLook, template: WidePatch, target: NDArray[np.float64], *, f_px: float, rows_apart_px: float
) -> TargetOffset | None:
    """Return a target's offset; None when it is not certain, or so small that a search would find the target.

    `target`: (2,) tangents from the rig's origin. `f_px`: the foveae's. `rows_apart_px`: the row difference
    that the search accepts, survey px.
    """
    places = [_only_place(eye, template) for eye in (look.left, look.right)]
    left, right = places
    if left is None or right is None or _alike(look, template, left, right) < ALIKE_SCORE:
        return None
    off_left, off_right = left - target * look.f_px, right - target * look.f_px
    across, down = ((off_left + off_right) / 2.0).tolist()
    rows = float(off_right[1] - off_left[1])
    aside = max(abs(float(off_left[1])), abs(float(off_right[1])))
    if abs(rows) <= rows_apart_px and abs(across) <= SLACK_PX and aside <= BAND_PX:
        return None
    zoom = f_px / look.f_px
    return TargetOffset(across_px=zoom * across, down_px=zoom * down, rows_px=zoom * rows, sigma_px=zoom)


def stands_alone(
    gray: NDArray[np.uint8], wide: Intrinsics, template: WidePatch, target: NDArray[np.float64]
) -> bool:
    """Return whether nothing near a target looks like it. `gray`: (h, w) the wide image of the look."""
    height, width = template.patch.shape
    half = ((width - 1) // 2 + REACH_PX[0], (height - 1) // 2 + REACH_PX[1])
    view = cut_view(gray, wide, target, f_px=template.f_px, half=half)
    scores = score_map(view, template.patch)
    return best_outside(scores, REACH_PX, guard_px=(HERE_PX, HERE_PX)) < ALONE_SCORE


def _only_place(eye: ReducedEye, template: WidePatch) -> NDArray[np.float64] | None:
    """Return the (2,) plane px where the patch fits one fovea; None if nowhere or in several places."""
    height, width = template.patch.shape
    if eye.image.shape[0] < height or eye.image.shape[1] < width:
        return None
    half_y, half_x = (height - 1) // 2, (width - 1) // 2
    scores = score_map(eye.image, template.patch)
    scores[eye.hidden(template.patch.shape)] = UNSEEN
    x, y, best = peak(scores)
    second = best_outside(scores, (round(x), round(y)), guard_px=(GUARD_PX, GUARD_PX))
    if best < SURE_SCORE or second > best - LEAD:
        return None
    return np.array([eye.u0_px + half_x + x, eye.v0_px + half_y + y])


def _alike(
    look: ReducedLook, template: WidePatch, left: NDArray[np.float64], right: NDArray[np.float64]
) -> float:
    """Return the correlation of both foveae with each other about the two places."""
    windows = [_window(eye, template, place) for eye, place in ((look.left, left), (look.right, right))]
    return correlation(windows[0], windows[1])


def _window(eye: ReducedEye, template: WidePatch, place: NDArray[np.float64]) -> NDArray[np.float32]:
    height, width = template.patch.shape
    left = round(float(place[0]) - eye.u0_px) - (width - 1) // 2
    top = round(float(place[1]) - eye.v0_px) - (height - 1) // 2
    return np.ascontiguousarray(eye.image[top : top + height, left : left + width])
