"""What the operator sees while views are taken: the live view, its corners, and what is covered so far."""

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.calibrate.board_detector import BoardView
from foveacam_pipeline.calibrate.coverage import COLUMNS, ROWS, Coverage

GREEN, AMBER, BLUE = (80, 220, 100), (255, 190, 60), (90, 170, 255)
HALF = 0.5
_VEIL = 0.16
_SHIFT = 3


def draw_overlay(
    image: NDArray[np.uint8], view: BoardView | None, *, cover: Coverage, words: str
) -> NDArray[np.uint8]:
    """Return (h/2, w/2, 3) uint8 RGB: covered parts veiled in green, corners, words for the operator."""
    small = cv2.resize(image, None, fx=HALF, fy=HALF, interpolation=cv2.INTER_AREA)
    base = cv2.cvtColor(small, cv2.COLOR_GRAY2RGB) if small.ndim == 2 else small.copy()
    height, width = base.shape[:2]
    veil = cv2.resize((cover.cells > 0).astype(np.uint8), (width, height), interpolation=cv2.INTER_NEAREST)
    green = cv2.addWeighted(base, 1.0 - _VEIL, np.full_like(base, GREEN), _VEIL, 0.0)
    picture: NDArray[np.uint8] = np.where(veil[..., None] > 0, green, base).astype(np.uint8)
    for column in range(1, COLUMNS):
        x = column * width // COLUMNS
        cv2.line(picture, (x, 0), (x, height - 1), GREEN, 1)
    for row in range(1, ROWS):
        y = row * height // ROWS
        cv2.line(picture, (0, y), (width - 1, y), GREEN, 1)
    if view is not None:
        _draw_corners(picture, view)
    _draw_words(picture, words, AMBER if view is None else GREEN)
    return picture


def _draw_corners(picture: NDArray[np.uint8], view: BoardView) -> None:
    points = np.rint(view.corners_px * HALF * (1 << _SHIFT)).astype(int)
    rows = view.ids // view.board.columns
    for row in np.unique(rows):
        cv2.polylines(picture, [points[rows == row].astype(np.int32)], False, BLUE, 1, cv2.LINE_AA, _SHIFT)
    for x, y in points.tolist():
        cv2.circle(picture, (x, y), 3 << _SHIFT, AMBER, 1, cv2.LINE_AA, _SHIFT)


def _draw_words(picture: NDArray[np.uint8], words: str, colour: tuple[int, int, int]) -> None:
    at = (12, picture.shape[0] - 14)
    for ink, thickness in (((0, 0, 0), 4), (colour, 1)):
        cv2.putText(picture, words, at, cv2.FONT_HERSHEY_SIMPLEX, 0.6, ink, thickness, cv2.LINE_AA)
