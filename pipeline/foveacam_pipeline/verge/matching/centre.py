"""Check that the foveae show at their match what the wide view shows at the target itself.

A large patch may fit by its rim alone, when something behind or beside the target has more contrast than the
target: then left and right agree on the rim's depth. What they show in the middle differs from the wide view.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.verge.matching.survey import ReducedEye, ReducedLook
from foveacam_pipeline.verge.matching.wide_patch import cut_view

HALF_PX = 4
"""Half side of the middle that is compared, survey px: two wide px."""
SLACK_PX = 3
"""How far the middles may be displaced, survey px."""
DIFFERS_RMS = 0.55
"""Root mean square difference of evened out pictures from which on an eye shows something else: right matches
stay below 0.45 in the better eye, wrong ones exceed 0.6."""


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
    """Return by how much an eye's picture about a place differs from the view where it fits best."""
    height, width = eye.image.shape
    place = ((width - 1) / 2 + float(offset_px[0]), (height - 1) / 2 + float(offset_px[1]))
    side = 2 * HALF_PX + 1
    shown = np.asarray(cv2.getRectSubPix(eye.image, (side, side), place), dtype=np.float32)
    squares = cv2.matchTemplate(view, shown, cv2.TM_SQDIFF) / shown.size
    return float(np.sqrt(max(0.0, squares.min())))
