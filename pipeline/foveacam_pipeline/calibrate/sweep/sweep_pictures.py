"""What the operator sees of a sweep: the views, half as large, with what was found drawn into them."""

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.calibrate.sweep.marker_view import MarkerView

GREEN, AMBER, BLUE = (80, 220, 100), (255, 190, 60), (90, 170, 255)
SUBPIXEL_BITS = 3
PICTURE_SCALE = 0.5


def draw_markers(
    image: NDArray[np.uint8], views: list[MarkerView], *, accepted: bool, aim_px: NDArray[np.float64] | None
) -> NDArray[np.uint8]:
    """Return a picture, (h/2, w/2, 3) uint8 RGB, with the markers' outlines and corners and where it aims."""
    small = cv2.resize(image, None, fx=PICTURE_SCALE, fy=PICTURE_SCALE, interpolation=cv2.INTER_AREA)
    picture = cv2.cvtColor(small, cv2.COLOR_GRAY2RGB) if small.ndim == 2 else small.copy()
    colour = GREEN if accepted else AMBER
    for view in views:
        outline = np.rint(view.corners_px[:4] * PICTURE_SCALE * (1 << SUBPIXEL_BITS)).astype(np.int32)
        cv2.polylines(picture, [outline], True, colour, 1, cv2.LINE_AA, SUBPIXEL_BITS)
        for x, y in np.rint(view.corners_px * PICTURE_SCALE).astype(int).tolist():
            cv2.circle(picture, (x, y), 2, BLUE, -1, cv2.LINE_AA)
    if aim_px is not None:
        x, y = np.rint(aim_px * PICTURE_SCALE).astype(int).tolist()
        cv2.drawMarker(picture, (x, y), AMBER, cv2.MARKER_CROSS, 24, 1, cv2.LINE_AA)
    return np.asarray(picture, dtype=np.uint8)
