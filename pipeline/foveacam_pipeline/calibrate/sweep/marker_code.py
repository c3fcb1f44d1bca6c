"""The code of a printed marker of the dictionary 4X4_50, as cells."""

import cv2
import numpy as np
from numpy.typing import NDArray

CELLS = 6
"""Cells across a marker of the dictionary 4X4_50: four of code, one of border on both sides."""


def black_cells(marker_id: int) -> NDArray[np.float64]:
    """Return the (6, 6) float64 map of black cells, 1 where black, rows from the top."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    printed = cv2.aruco.generateImageMarker(dictionary, marker_id, CELLS)
    return np.asarray(printed == 0, dtype=np.float64)
