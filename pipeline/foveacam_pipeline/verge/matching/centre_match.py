"""Compare the centres of the foveae with the wide view: do both show the target, or something else?

A large patch may fit by its rim alone, when something behind or beside the target has more contrast than the
target: then left and right agree on the rim's depth, and what they show in the middle differs from the wide
view. A wide patch may also fit a fovea that looks at a neighbour that is nearly alike (letters, windows),
when the target itself is hidden from that eye. What the fovea shows then fits the neighbour better.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.matching.correlation import peak, score_map
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.verge.matching.survey import ReducedEye, ReducedLook
from foveacam_pipeline.verge.matching.wide_patch import ENLARGED, WidePatch, cut_view, leaning

HALF_PX = 4
"""Half side of the middle that is compared, survey px: two wide px."""
SLACK_PX = 3
"""Largest displacement of the middles, survey px."""
DIFFERS_RMS = 0.55
"""RMS difference of equalised pictures above which an eye shows something else: true matches stay below 0.45
in the better eye, false ones exceed 0.6."""
REACH_PX = 140
"""Search range for a look-alike along the row, survey px: the shift between infinity and 3 m."""
ROWS_PX = 8
"""Search range above and below the row, survey px."""
HERE_PX = 12
"""Places within this distance of the target are its own, survey px: the eyes see a relief from the side."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CentreMatch:
    """Correlation of one eye's centre with the wide view: at the target (`here`), and at its best (`best`).

    `aside_wide_px`: how far along the row the best place is from the target, wide px.
    """

    here: float
    best: float
    aside_wide_px: float


def match_centres(
    look: ReducedLook,
    template: WidePatch,
    gray: NDArray[np.uint8],
    wide: Intrinsics,
    target: NDArray[np.float64],
    *,
    slope: tuple[float, float],
) -> tuple[CentreMatch, CentreMatch]:
    """Find the left and the right eye's centre in the wide image.

    `gray`: (h, w) wide image of the look. `target`: (2,) tangents from the rig's origin. `slope`: of the
    surface, as `FineMatch.slope`; half of it is removed from each eye's picture.
    """
    half_y, half_x = ((side - 1) // 2 for side in template.patch.shape)
    strip = cut_view(gray, wide, target, f_px=look.f_px, half=(half_x + REACH_PX, half_y + ROWS_PX))
    half = (half_x, half_y)
    lean = (slope[0] / 2.0, slope[1] / 2.0)
    return (
        _match_centre(look.left, strip, half, (-lean[0], -lean[1])),
        _match_centre(look.right, strip, half, lean),
    )


def _match_centre(
    eye: ReducedEye, strip: NDArray[np.float32], half: tuple[int, int], lean: tuple[float, float]
) -> CentreMatch:
    height, width = eye.image.shape
    size = (2 * half[0] + 1, 2 * half[1] + 1)
    centre = cv2.getRectSubPix(eye.image, size, ((width - 1) / 2, (height - 1) / 2))
    centre = leaning(np.asarray(centre, dtype=np.float32), *lean)
    scores = score_map(strip, centre)
    x_px, _, best = peak(scores)
    here = scores[:, REACH_PX - HERE_PX : REACH_PX + HERE_PX + 1]
    return CentreMatch(here=float(here.max()), best=best, aside_wide_px=(x_px - REACH_PX) / ENLARGED)


def shows_another(
    look: ReducedLook,
    gray: NDArray[np.uint8],
    wide: Intrinsics,
    target: NDArray[np.float64],
    *,
    left: NDArray[np.float64],
    right: NDArray[np.float64],
) -> bool:
    """Return whether both eyes show something else than the wide view at the target.

    `gray`: (h, w) wide image of the look. `target`: (2,) tangents from the rig's origin. `left`, `right`:
    (2,) tangents from each eye's gaze to the match.
    """
    half = HALF_PX + SLACK_PX
    view = cut_view(gray, wide, target, f_px=look.f_px, half=(half, half))
    pairs = ((look.left, left), (look.right, right))
    return all(_difference_rms(eye, offset * look.f_px, view) > DIFFERS_RMS for eye, offset in pairs)


def _difference_rms(eye: ReducedEye, offset_px: NDArray[np.float64], view: NDArray[np.float32]) -> float:
    """Return the RMS difference of an eye's picture about a place from the view, where it fits best."""
    height, width = eye.image.shape
    place = ((width - 1) / 2 + float(offset_px[0]), (height - 1) / 2 + float(offset_px[1]))
    side = 2 * HALF_PX + 1
    shown = np.asarray(cv2.getRectSubPix(eye.image, (side, side), place), dtype=np.float32)
    squares = cv2.matchTemplate(view, shown, cv2.TM_SQDIFF) / shown.size
    return float(np.sqrt(max(0.0, squares.min())))
