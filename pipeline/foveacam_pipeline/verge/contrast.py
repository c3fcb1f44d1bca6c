"""Evens out brightness and contrast: a stark edge behind a thing weighs no more than its texture."""

import cv2
import numpy as np
from numpy.typing import NDArray


def even(
    image: NDArray[np.float32], *, shading_px: float, contrast_px: float, least: float
) -> NDArray[np.float32]:
    """Return the image less its slow part, over its local contrast, (h, w) float32.

    `shading_px`, `contrast_px`: standard deviations of the two surroundings. `least`: contrast below this is
    not brought up, for it may be noise; grey levels.
    """
    slow = cv2.GaussianBlur(image, (0, 0), shading_px, borderType=cv2.BORDER_REFLECT_101)
    detail = cv2.subtract(image, slow)
    energy = cv2.GaussianBlur(
        cv2.multiply(detail, detail), (0, 0), contrast_px, borderType=cv2.BORDER_REFLECT_101
    )
    return np.asarray(detail / np.sqrt(energy + np.float32(least**2)), dtype=np.float32)
