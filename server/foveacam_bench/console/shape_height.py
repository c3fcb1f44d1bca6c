"""The height of what differs between two pictures of the 3D pane: one with the newest shape, one without."""

import cv2
import numpy as np
from numpy.typing import NDArray

LEAST_DIFFERENCE = 12
"""In grey levels of any channel; the pictures are drawn without noise."""
LINE_PX = 5
"""What is thinner is a line that the shape covered, or that it let through."""
CLOSED_PX = 9
"""Gaps up to this size belong to the shape: marks in front of it, and where it looks like its background."""


def shape_height_px(shown: NDArray[np.uint8], hidden: NDArray[np.uint8]) -> int:
    """Return the rows that the largest different region takes, 0 where the pictures are alike.

    `shown`, `hidden`: (h, w, 3) uint8, of the same size.
    """
    apart = np.abs(shown.astype(np.int16) - hidden.astype(np.int16)).max(axis=2)
    mask = np.asarray(apart >= LEAST_DIFFERENCE, dtype=np.uint8)
    without_lines = cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((LINE_PX, LINE_PX), np.uint8))
    closed = cv2.morphologyEx(without_lines, cv2.MORPH_CLOSE, np.ones((CLOSED_PX, CLOSED_PX), np.uint8))
    count, _, stats, _ = cv2.connectedComponentsWithStats(closed)
    if count < 2:
        return 0
    largest = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    return int(stats[largest, cv2.CC_STAT_HEIGHT])
