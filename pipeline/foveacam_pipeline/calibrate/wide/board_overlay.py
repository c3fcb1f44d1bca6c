"""What the operator sees while views are taken: the live view, its corners, and what is covered so far."""

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.calibrate.wide.board_detector import BoardView
from foveacam_pipeline.calibrate.wide.coverage import COLUMNS, ROWS, BoardCoverage

GREEN, AMBER, BLUE = (80, 220, 100), (255, 190, 60), (90, 170, 255)
PICTURE_SCALE = 0.5
_VEIL = 0.22
_BAND = 30
_DARK = (17, 20, 26)
_SHIFT = 3


def draw_overlay(
    image: NDArray[np.uint8], view: BoardView | None, *, cover: BoardCoverage, words: str
) -> NDArray[np.uint8]:
    """Return (h/2, w/2, 3) uint8 RGB: covered parts veiled in green, corners, words for the operator."""
    small = cv2.resize(image, None, fx=PICTURE_SCALE, fy=PICTURE_SCALE, interpolation=cv2.INTER_AREA)
    base = cv2.cvtColor(small, cv2.COLOR_GRAY2RGB) if small.ndim == 2 else small.copy()
    height, width = base.shape[:2]
    veil = cv2.resize((cover.cells > 0).astype(np.uint8), (width, height), interpolation=cv2.INTER_NEAREST)
    lined = base.copy()
    for x in range(1, COLUMNS):
        cv2.line(lined, (x * width // COLUMNS, 0), (x * width // COLUMNS, height - 1), GREEN, 1)
    for y in range(1, ROWS):
        cv2.line(lined, (0, y * height // ROWS), (width - 1, y * height // ROWS), GREEN, 1)
    base = cv2.addWeighted(base, 1.0 - _VEIL, lined, _VEIL, 0.0)
    green = cv2.addWeighted(base, 1.0 - _VEIL, np.full_like(base, GREEN), _VEIL, 0.0)
    picture: NDArray[np.uint8] = np.where(veil[..., None] > 0, green, base).astype(np.uint8)
    if view is not None:
        _draw_corners(picture, view)
    _draw_note(picture, words, AMBER if view is None else GREEN)
    return picture


def _draw_corners(picture: NDArray[np.uint8], view: BoardView) -> None:
    points = np.rint(view.corners_px * PICTURE_SCALE * (1 << _SHIFT)).astype(int)
    rows = view.ids // view.board.columns
    for row in np.unique(rows):
        cv2.polylines(picture, [points[rows == row].astype(np.int32)], False, BLUE, 1, cv2.LINE_AA, _SHIFT)
    for x, y in points.tolist():
        cv2.circle(picture, (x, y), 3 << _SHIFT, AMBER, 1, cv2.LINE_AA, _SHIFT)


def _draw_note(picture: NDArray[np.uint8], words: str, colour: tuple[int, int, int]) -> None:
    height, width = picture.shape[:2]
    cv2.rectangle(picture, (0, height - _BAND), (width - 1, height - 1), _DARK, -1)
    cv2.putText(picture, words, (12, height - 10), cv2.FONT_HERSHEY_SIMPLEX, 0.6, colour, 1, cv2.LINE_AA)
