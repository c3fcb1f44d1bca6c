"""A plan on the wide view: what both eyes see, what one, the outlines of the views, the way."""

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.capture.plan.plan_coverage import SCALE, PlanCoverage

BOTH, ONE, FIELD, WAY = (80, 220, 100), (255, 190, 60), (90, 170, 255), (240, 240, 240)
EYE_COLOURS = ((90, 220, 230), (190, 230, 80))
_DARK = (17, 20, 26)
_VEIL = 0.28
_SHIFT = 4


def draw_coverage(cover: PlanCoverage, wide_image: NDArray[np.uint8] | None = None) -> NDArray[np.uint8]:
    """Return (h/2, w/2, 3) uint8 RGB: green where both eyes see, amber where one does, blue around the field.

    `wide_image`: (h, w) or (h, w, 3) uint8, drawn beneath; None: a dark ground. Left views are outlined cyan,
    right ones in lime; the way begins at the dot.
    """
    picture = _ground(cover, wide_image)
    seen = (cover.counts > 0).sum(axis=0)
    veiled = picture.copy()
    veiled[seen == 2] = BOTH
    veiled[seen == 1] = ONE
    picture = cv2.addWeighted(picture, 1.0 - _VEIL, veiled, _VEIL, 0.0).astype(np.uint8)
    for eye, colour in enumerate(EYE_COLOURS):
        cv2.polylines(
            picture, list(_fixed(cover.footprints_px[:, eye])), True, colour, 1, cv2.LINE_AA, _SHIFT
        )
    outline, _ = cv2.findContours(cover.field.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    cv2.drawContours(picture, outline, -1, FIELD, 1, cv2.LINE_AA)
    way = _fixed(cover.footprints_px.mean(axis=(1, 2)))
    cv2.polylines(picture, [way], False, WAY, 1, cv2.LINE_AA, _SHIFT)
    x, y = way[0].tolist()
    cv2.circle(picture, (x, y), 4 << _SHIFT, WAY, -1, cv2.LINE_AA, _SHIFT)
    return picture


def _ground(cover: PlanCoverage, wide_image: NDArray[np.uint8] | None) -> NDArray[np.uint8]:
    height, width = cover.field.shape
    if wide_image is None:
        return np.full((height, width, 3), _DARK, dtype=np.uint8)
    small = cv2.resize(wide_image, (width, height), interpolation=cv2.INTER_AREA)
    coloured = cv2.cvtColor(small, cv2.COLOR_GRAY2RGB) if small.ndim == 2 else small
    return np.asarray(coloured, dtype=np.uint8)


def _fixed(places_px: NDArray[np.float64]) -> NDArray[np.int32]:
    """Return wide px as OpenCV's fixed point on the picture at half size."""
    cells = (places_px + 0.5) * SCALE - 0.5
    return np.rint(cells * (1 << _SHIFT)).astype(np.int32)
