"""Detection of a calibration board in an image, with corners to a few hundredths of a pixel.

A coarse search finds the corners; each is then refined in a window that contains no other corner.
"""

from dataclasses import dataclass
from functools import cache
from typing import Literal, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.wide.board_map import BoardMap, fit_board_map
from foveacam_pipeline.calibrate.wide.board_pattern import extends_beyond, has_markers, starts_at_black
from foveacam_pipeline.calibrate.wide.board_recognition import alternatives, seen_markers
from foveacam_pipeline.calibrate.wide.boards import MIN_CORNERS, Board, Charuco, Checkerboard
from foveacam_pipeline.calibrate.wide.corner_model import fit_crossings

Effort: TypeAlias = Literal["live", "exact", "thorough"]
COARSE_WIDTH = 480
"""Checkerboards are searched for in images reduced to about this width, px, because the search is slowest
where a part of the board is cut off and it fails."""
_LIVE = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_FAST_CHECK
_SLOW = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
_WINDOW_PX = (2, 11)
_RADIUS_PX = (2.5, 10.0)
_EDGE_REACH = 0.45
"""Distance from a corner, in squares, within which its edges are free of the next corner's."""
_BLEED_PX = 1.5
"""Margin to other edges for the blur of a lens."""
_MAX_MISFIT = 0.25
"""Maximum rms difference of a corner from two crossing edges, over the contrast."""
_MAX_OFFSET = 0.35
"""Maximum distance of a corner from a smooth map of the board, in squares of that place: a confusion of
corners moves it by more."""
_MIN_MARKERS = 4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BoardView:
    """A board detected in one image of `width` x `height`.

    `corners_px`: (n, 2) float64. `ids`: (n,) int64, their numbers on the board, row by row, ascending.
    """

    board: Board
    corners_px: NDArray[np.float64]
    ids: NDArray[np.int64]
    width: int
    height: int

    @property
    def places_m(self) -> NDArray[np.float64]:
        """(n, 2) float64 positions of the corners on the board, m."""
        places: NDArray[np.float64] = self.board.places_m()[self.ids]
        return places

    @property
    def centre_px(self) -> tuple[float, float]:
        """Mean of the corners, px."""
        x_px, y_px = self.corners_px.mean(axis=0).tolist()
        return x_px, y_px


def detect_board(gray: NDArray[np.uint8], board: Board, *, effort: Effort = "exact") -> BoardView | None:
    """Return the view of `board` in a grey image (h, w) uint8, or None where it is not found.

    `effort`: "live" is quick, with corners to 0.04 px; "exact" fits their edges, to 0.01 px; "thorough" also
    searches longer, for files.
    """
    if gray.ndim != 2 or gray.dtype != np.uint8:
        raise InvalidInput(
            f"board detection: a grey image (h, w) uint8 is needed, {gray.shape} {gray.dtype} was given; "
            "convert it first"
        )
    if isinstance(board, Charuco):
        found = _coarse_charuco(gray, board)
    else:
        found = _coarse_checkerboard(gray, board, thorough=effort == "thorough")
    if found is None:
        return None
    coarse_px, ids = found
    on_image = _image_from_board(coarse_px, ids, board)
    if on_image is None:
        return None
    if isinstance(board, Checkerboard) and (
        extends_beyond(gray, board, on_image) or has_markers(gray, board, on_image)
    ):
        return None
    edges_px = _edges(board, ids, on_image)
    clear_px = _clear_px(board, edges_px)
    corners_px, valid = _refine_quickly(gray, coarse_px, clear_px)
    if effort != "live":
        exact = fit_crossings(gray, corners_px, edges_px=edges_px, radius_px=clear_px)
        moved = np.linalg.norm(exact.places_px - corners_px, axis=1)
        valid = valid & (exact.misfit < _MAX_MISFIT) & (moved < clear_px)
        corners_px = exact.places_px
    if not _fixes_a_pose(ids[valid], board):
        return None
    height, width = gray.shape
    return BoardView(
        board=board,
        corners_px=corners_px[valid],
        ids=ids[valid],
        width=width,
        height=height,
    )


def explain_absence(gray: NDArray[np.uint8], board: Board) -> str:
    """Return a sentence on what the image shows instead of `board`; slow, for error messages."""
    if isinstance(board, Charuco):
        words = _markers_seen(gray, board)
        if words is not None:
            return words
    elif _has_scattered_corners(gray, board):
        return "its corners were found, but not on one smooth grid: show it flat and whole"
    seen = _lattice_seen(gray)
    if seen is None:
        nothing = "nothing like a board was found: show it whole, flat, evenly lit, with a white margin"
        return nothing if isinstance(board, Charuco) else _markers_instead(gray) or nothing
    if isinstance(board, Charuco):
        return f"a checkerboard of {seen[0]} x {seen[1]} inner corners without its markers was found"
    if set(seen) == {board.columns, board.rows}:
        return "something like it was found, but not every corner: show the whole board with a white margin"
    return f"a board of {seen[0]} x {seen[1]} inner corners was found: check columns and rows"


def _markers_seen(gray: NDArray[np.uint8], board: Charuco) -> str | None:
    """Return a sentence on the markers in an image, and the board that they are of; None without markers."""
    seen = seen_markers(gray)
    if seen is None:
        return None
    markers = f"{len(seen.ids)} markers of the dictionary {seen.dictionary} were found"
    for other in alternatives(board, seen):
        if _coarse_charuco(gray, other) is not None:
            return f"{markers}, placed as on a {other} ({other.drawn}): describe that board"
    return f"{markers}, but not placed as on a {board}: check columns and rows"


def _markers_instead(gray: NDArray[np.uint8]) -> str | None:
    """Return a sentence on the markers in an image instead of a plain checkerboard; None without markers."""
    seen = seen_markers(gray)
    if seen is None:
        return None
    return (
        f"{len(seen.ids)} markers of the dictionary {seen.dictionary} were found: describe a ChArUco board, "
        "with the side and the dictionary of its markers"
    )


def _has_scattered_corners(gray: NDArray[np.uint8], board: Checkerboard) -> bool:
    found = _coarse_checkerboard(gray, board, thorough=True)
    return found is not None and _image_from_board(*found, board) is None


def _coarse_checkerboard(
    gray: NDArray[np.uint8], board: Checkerboard, *, thorough: bool
) -> tuple[NDArray[np.float64], NDArray[np.int64]] | None:
    size = (board.columns, board.rows)
    scale = max(1, gray.shape[1] // COARSE_WIDTH)
    small = cv2.resize(gray, None, fx=1.0 / scale, fy=1.0 / scale, interpolation=cv2.INTER_AREA)
    found, corners = cv2.findChessboardCorners(small, size, flags=_LIVE)
    if not found and thorough:
        found, corners = cv2.findChessboardCorners(gray, size, flags=_SLOW)
        scale = 1
    if not found and thorough:
        found, corners = cv2.findChessboardCornersSB(gray, size, flags=cv2.CALIB_CB_EXHAUSTIVE)
    if not found:
        return None
    rows = np.asarray(corners, dtype=np.float64).reshape(-1, 2) * scale + (scale - 1.0) / 2.0
    if not starts_at_black(gray, rows, board):
        rows = rows[::-1].copy()
    return rows, np.arange(len(rows))


def _coarse_charuco(
    gray: NDArray[np.uint8], board: Charuco
) -> tuple[NDArray[np.float64], NDArray[np.int64]] | None:
    corners, ids, _, _ = _charuco_detector(board).detectBoard(gray)
    if ids is None or len(ids) < _MIN_MARKERS:
        return None
    numbers = np.asarray(ids, dtype=np.int64).ravel()
    order = np.argsort(numbers)
    rows = np.asarray(corners, dtype=np.float64).reshape(-1, 2)
    if not _fixes_a_pose(numbers, board):
        return None
    return rows[order], numbers[order]


@cache
def _charuco_detector(board: Charuco) -> cv2.aruco.CharucoDetector:
    return cv2.aruco.CharucoDetector(board.printed())


def _fixes_a_pose(ids: NDArray[np.int64], board: Board) -> bool:
    """Return whether the corners cover enough rows and columns to determine the pose of the board."""
    rows, columns = np.divmod(ids, board.columns)
    return min(len(np.unique(rows)), len(np.unique(columns))) >= MIN_CORNERS


def _image_from_board(
    corners_px: NDArray[np.float64], ids: NDArray[np.int64], board: Board
) -> BoardMap | None:
    """Return the map from the board, in squares, to px; None when no smooth one fits the corners."""
    places = board.places_m()[ids] / board.square_m
    found = fit_board_map(places, corners_px)
    if found is None:
        return None
    off_px = np.linalg.norm(found.pixels(places) - corners_px, axis=1)
    return found if (off_px < _MAX_OFFSET * found.pitches_px(places)).all() else None


def _edges(board: Board, ids: NDArray[np.int64], on_image: BoardMap) -> NDArray[np.float64]:
    """Return the (n, 2, 2) vectors, px, of one square along the rows and the columns at each corner."""
    places = board.places_m()[ids] / board.square_m
    steps = [on_image.pixels(places + half) - on_image.pixels(places - half) for half in 0.5 * np.eye(2)]
    return np.stack(steps, axis=1)


def _clear_px(board: Board, edges_px: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (n,) distances from each corner within which there are only its own edges, px."""
    right, down = edges_px[:, 0], edges_px[:, 1]
    area = np.abs(right[:, 0] * down[:, 1] - right[:, 1] * down[:, 0])
    height = area / np.linalg.norm(edges_px, axis=2).max(axis=1)
    share = _EDGE_REACH
    if isinstance(board, Charuco):  # a marker's corner is nearest, along the diagonal
        share = min(share, np.sqrt(0.5) * (1.0 - board.marker_m / board.square_m))
    return np.asarray(np.clip(share * height - _BLEED_PX, *_RADIUS_PX))


def _refine_quickly(
    gray: NDArray[np.uint8], coarse_px: NDArray[np.float64], clear_px: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return corners (n, 2) to about 0.04 px, and the mask of the valid ones."""
    half_px = int(np.clip(np.floor(clear_px.min() / np.sqrt(2.0)), *_WINDOW_PX))
    stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-3)
    start = coarse_px.astype(np.float32)[:, None, :]
    fine = cv2.cornerSubPix(gray, start.copy(), (half_px, half_px), (-1, -1), stop)
    corners = np.asarray(fine, dtype=np.float64)[:, 0, :]
    room = np.array(gray.shape[::-1], dtype=np.float64) - 1.0
    inside = ((corners >= half_px) & (corners <= room - half_px)).all(axis=1)
    return corners, np.asarray(inside & (np.linalg.norm(corners - coarse_px, axis=1) <= clear_px))


def _lattice_seen(gray: NDArray[np.uint8]) -> tuple[int, int] | None:
    """Return columns and rows of inner corners of a checkerboard in the image, None when there is none."""
    for picture in (cv2.resize(gray, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA), gray):
        found, _, meta = cv2.findChessboardCornersSBWithMeta(picture, (3, 3), cv2.CALIB_CB_LARGER)
        if not found or meta is None:
            continue
        # the search may take the board's rim for one more row, or miss one
        nearby = [(meta.shape[1] + i, meta.shape[0] + j) for i in (0, -1, 1) for j in (0, -1, 1)]
        for columns, rows in nearby:
            if min(columns, rows) < MIN_CORNERS:
                continue
            if detect_board(gray, Checkerboard(columns=columns, rows=rows), effort="live"):
                return max(columns, rows), min(columns, rows)
    return None
