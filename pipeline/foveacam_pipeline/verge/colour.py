"""Which places of the wide view have the colour of a target: those are seldom of another surface.

Where a point beside an edge is seen by one eye alone, matching cannot tell whose it is; its colour often can.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame
from foveacam_pipeline.stereo.rectify import to_uint8

BLUR_PX = 1.5
"""Averages noise and grain over a place, wide px."""
LIKE, BETWEEN, UNLIKE = 4.0, 8.5, 13.0
"""Differences of colour (CIE 1976 L*a*b*, lightness halved, since shading changes it) of places that are
probably of one surface, undecided, and probably of two."""
LIKE_LOG_RATIO, UNLIKE_LOG_RATIO = 1.2, -2.0
"""Log likelihood ratios there. 4 100 pairs of places 3 to 40 px apart in both rendered scenes have 2.5 to 4
and -2 to -3; photographs are less tidy."""
LEAST_CHANCE, MOST_CHANCE = 0.02, 0.88
"""By colour alone no place is sure to be of the target's surface, or never: its depth may be wrong."""


class TargetColour:
    """The colour of a target in a wide frame (of a mono one the brightness), to compare places with."""

    def __init__(self, frame: Frame, at_px: NDArray[np.float64]) -> None:
        """`at_px`: (2,) the target's wide pixel."""
        image = to_uint8(frame)
        rgb = cv2.cvtColor(image, cv2.COLOR_GRAY2RGB) if image.ndim == 2 else image
        blurred = cv2.GaussianBlur(rgb.astype(np.float32) / 255.0, (0, 0), BLUR_PX)
        self._lab = cv2.cvtColor(blurred, cv2.COLOR_RGB2LAB)
        self._own = self._at(at_px[None])[0]

    def like(self, pixels: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return (n,) whether places at wide pixels, (n, 2), rather have the target's colour than not."""
        return self._differences(pixels) <= BETWEEN

    def weighed(self, chances: NDArray[np.float64], pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (n,) the chances of places at wide pixels, (n, 2), to be of the target's surface."""
        ratio = np.exp(
            np.interp(self._differences(pixels), [LIKE, UNLIKE], [LIKE_LOG_RATIO, UNLIKE_LOG_RATIO])
        )
        odds = chances / (1.0 - chances) * ratio
        most = np.maximum(chances, MOST_CHANCE)
        return np.asarray(np.clip(odds / (1.0 + odds), LEAST_CHANCE, most), dtype=np.float64)

    def _differences(self, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        apart = self._at(pixels) - self._own
        return np.asarray(np.linalg.norm(apart * (0.5, 1.0, 1.0), axis=1), dtype=np.float64)

    def _at(self, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        most = np.array(self._lab.shape[1::-1]) - 1
        columns, rows = np.clip(np.rint(pixels), 0, most).astype(np.intp).T
        return np.asarray(self._lab[rows, columns], dtype=np.float64)
