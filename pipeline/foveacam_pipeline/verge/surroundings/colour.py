"""Likeness of the colours of measured points and of a target: another colour is often another thing.

Only hue and saturation count: brightness changes with the light and within one material's texture.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.stereo.rectify import to_uint8

CELL_PX = 4
"""Side of the squares whose mean colour counts, wide px of the sensor: against the noise of single pixels."""
APART = (1.5, 4.5, 8.0, 12.0, 20.0, 30.0)
"""Differences of CIE a*, b* at which the odds are given."""
TEXTURED_ODDS = (6.0, 3.0, 2.0, 1.0, 0.6, 0.2)
BLANK_ODDS = (1.4, 1.3, 0.8, 0.3, 0.1, 0.05)
"""Odds of a point to be of the target's surface at these differences, over those without knowing its colour;
about a target with texture, and in a blank region (of 18 700 points about 246 clicks)."""


class TargetColour:
    """The colours of a wide frame relative to that of a target."""

    def __init__(self, frame: Frame, wide: Intrinsics, target: NDArray[np.float64]) -> None:
        """`target`: (2,) tangents."""
        image = to_uint8(frame)
        self._chroma = _chroma(image, CELL_PX // frame.binning) if image.ndim == 3 else None
        self._wide = wide
        self._own = self._at(target[None])

    def odds(self, tangents: NDArray[np.float64], *, blank: bool) -> NDArray[np.float64]:
        """Return (n,) the odds of points in (n, 2) directions; 1 where the camera shows no colours."""
        if self._chroma is None or len(tangents) == 0:
            return np.ones(len(tangents))
        apart = np.hypot(*(self._at(tangents) - self._own).T)
        return np.asarray(np.interp(apart, APART, BLANK_ODDS if blank else TEXTURED_ODDS))

    def weighed(
        self, chances: NDArray[np.float64], tangents: NDArray[np.float64], *, blank: bool
    ) -> NDArray[np.float64]:
        """Return the chances, (n,), of points to be of the target's surface, given their colours."""
        odds = self.odds(tangents, blank=blank)
        return np.asarray(chances * odds / (chances * odds + 1.0 - chances))

    def _at(self, tangents: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (n, 2) the a* and b* in some directions."""
        if self._chroma is None:
            return np.zeros((len(tangents), 2))
        cells = ((self._wide.pixels(np.arctan(tangents)) + 0.5) / CELL_PX - 0.5).astype(np.float32)
        x, y = cells[None, :, 0], cells[None, :, 1]
        shown = cv2.remap(self._chroma, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return np.asarray(shown[0], dtype=np.float64)


def _chroma(image: NDArray[np.uint8], cell_px: int) -> NDArray[np.float32]:
    """Return a* and b* of the squares of an RGB image, (h / cell, w / cell, 2) float32."""
    height, width = image.shape[:2]
    size = (width // cell_px, height // cell_px)
    cells = cv2.resize(image, size, interpolation=cv2.INTER_AREA).astype(np.float32) / 255.0
    return np.ascontiguousarray(cv2.cvtColor(cells, cv2.COLOR_RGB2LAB)[:, :, 1:])
