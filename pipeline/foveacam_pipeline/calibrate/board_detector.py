"""Find a calibration board in an image, corners to a few hundredths of a pixel.

A coarse search says where the corners are; a window that sees nothing but its own corner says where exactly.
What the views are good for is decided elsewhere.
"""

from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.boards import LEAST_CORNERS, Board, Charuco, Checkerboard

HALVED_FROM = 1200
"""Images this wide, px, and wider are searched for checkerboards at half size."""
_LIVE = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_FAST_CHECK
_SLOW = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
_WINDOW_PX = (2, 11)
_CLEAR_OF_SQUARES = 0.4
"""Half window over the height of a square: beyond 0.5 it would reach the next corner's edges."""
_CLEAR_OF_MARKERS = 0.8
_FLAT = 0.35
"""Largest distance of a corner from where a pinhole would see it, in squares: a lens shifts it by less,
taking one corner for another by more."""
_PRINTED = 0.4
"""Difference of brightness within a square, over the board's, from which something is printed in it."""
_ENOUGH_LINES = 3
_FOUR = 4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BoardView:
    """A board seen in one image of `width` x `height`.

    `corners_px`: (n, 2) float64. `ids`: (n,) int64, their numbers on the board, row by row, ascending.
    """

    board: Board
    corners_px: NDArray[np.float64]
    ids: NDArray[np.int64]
    width: int
    height: int

    @property
    def places_m(self) -> NDArray[np.float64]:
        """(n, 2) float64 places of the corners on the board, m."""
        places: NDArray[np.float64] = self.board.places_m()[self.ids]
        return places

    @property
    def complete(self) -> bool:
        """Whether every corner of the board was found."""
        return len(self.ids) == self.board.corners

    @property
    def centre_px(self) -> tuple[float, float]:
        """Mean of the corners, px."""
        x_px, y_px = self.corners_px.mean(axis=0).tolist()
        return x_px, y_px


def detect_board(gray: NDArray[np.uint8], board: Board, *, thorough: bool = False) -> BoardView | None:
    """Return where `board` is in a grey image (h, w) uint8, or None where it is not to be found.

    `thorough` searches for longer: meant for files, too slow for live images.
    """
    if gray.ndim != 2 or gray.dtype != np.uint8:
        raise InvalidInput(
            f"board detection: a grey image (h, w) uint8 is needed, {gray.shape} {gray.dtype} was given; "
            "convert it first"
        )
    if isinstance(board, Charuco):
        found = _coarse_charuco(gray, board)
    else:
        found = _coarse_checkerboard(gray, board, thorough=thorough)
    if found is None:
        return None
    coarse_px, ids = found
    plane = _image_from_board(coarse_px, ids, board)
    if plane is None:
        return None
    if isinstance(board, Checkerboard) and (goes_on(gray, board, plane) or has_markers(gray, board, plane)):
        return None
    corners_px, kept = _refine(gray, coarse_px, half_px=_window(board, ids, plane))
    if not _fixes_a_pose(ids[kept], board):
        return None
    height, width = gray.shape
    return BoardView(board=board, corners_px=corners_px[kept], ids=ids[kept], width=width, height=height)


def explain_absence(gray: NDArray[np.uint8], board: Board) -> str:
    """Return what there is in the image in place of `board`, in words; slow, for when all has failed."""
    if isinstance(board, Charuco):
        markers = _charuco_detector(board).detectBoard(gray)[3]
        if markers is not None and len(markers) >= _FOUR:
            return (
                f"{len(markers)} of its markers were found, but not placed as on a {board}: "
                "check columns, rows and dictionary"
            )
    seen = _lattice_seen(gray)
    if seen is None:
        return "nothing like a board was found: show it whole, flat, evenly lit, with a white margin"
    if isinstance(board, Charuco):
        return f"a checkerboard of {seen[0]} x {seen[1]} inner corners without its markers was found"
    if set(seen) == {board.columns, board.rows}:
        return "something like it was found, but not every corner: show the whole board with a white margin"
    return f"a board of {seen[0]} x {seen[1]} inner corners was found: check columns and rows"


def goes_on(gray: NDArray[np.uint8], board: Checkerboard, image_from_board: NDArray[np.float64]) -> bool:
    """Tell whether the pattern goes on beyond the board's rim: then it is a part of a larger board."""
    x, y = np.arange(board.columns), np.arange(board.rows)
    rims = (
        np.column_stack([np.full_like(y, -1), y]),
        np.column_stack([np.full_like(y, board.columns), y]),
        np.column_stack([x, np.full_like(x, -1)]),
        np.column_stack([x, np.full_like(x, board.rows)]),
    )
    inside = _crossing(gray, np.argwhere(np.ones((board.columns, board.rows))), image_from_board)
    strength = float(np.nanmedian(inside))
    for rim in rims:
        there = _crossing(gray, rim, image_from_board) * np.sign(strength)
        known = there[np.isfinite(there)]
        if len(known) >= _ENOUGH_LINES and np.median(known) > 0.5 * abs(strength):
            return True
    return False


def has_markers(gray: NDArray[np.uint8], board: Checkerboard, image_from_board: NDArray[np.float64]) -> bool:
    """Tell whether there is something printed in the bright squares: then it is a ChArUco board."""
    squares = np.argwhere(np.ones((board.columns - 1, board.rows - 1))) + 0.5
    around = np.stack(np.meshgrid([-0.2, 0.0, 0.2], [-0.2, 0.0, 0.2]), axis=-1).reshape(-1, 2)
    points = (squares[:, None, :] + around).reshape(-1, 2)
    values = _at(gray, _mapped(points, image_from_board)).reshape(-1, len(around))
    first = np.floor(squares).sum(axis=1) % 2 == 0
    spread = np.nanmax(values, axis=1) - np.nanmin(values, axis=1)
    contrast = float(np.nanmax(values) - np.nanmin(values))
    return bool(max(np.nanmedian(spread[first]), np.nanmedian(spread[~first])) > _PRINTED * contrast)


def _coarse_checkerboard(
    gray: NDArray[np.uint8], board: Checkerboard, *, thorough: bool
) -> tuple[NDArray[np.float64], NDArray[np.int64]] | None:
    size = (board.columns, board.rows)
    large = gray.shape[1] >= HALVED_FROM
    small = cv2.resize(gray, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA) if large else gray
    found, corners = cv2.findChessboardCorners(small, size, flags=_LIVE)
    scale = 2.0 if large else 1.0
    if not found and thorough:
        found, corners = cv2.findChessboardCorners(gray, size, flags=_SLOW)
        scale = 1.0
    if not found and thorough:
        found, corners = cv2.findChessboardCornersSB(gray, size, flags=cv2.CALIB_CB_EXHAUSTIVE)
    if not found:
        return None
    rows = np.asarray(corners, dtype=np.float64).reshape(-1, 2) * scale + (scale - 1.0) / 2.0
    if not _starts_at_black(gray, rows, board):
        rows = rows[::-1].copy()
    return rows, np.arange(len(rows))


def _coarse_charuco(
    gray: NDArray[np.uint8], board: Charuco
) -> tuple[NDArray[np.float64], NDArray[np.int64]] | None:
    corners, ids, _, _ = _charuco_detector(board).detectBoard(gray)
    if ids is None or len(ids) < _FOUR:
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
    """Tell whether the corners spread over enough rows and columns to say how the board stands."""
    rows, columns = np.divmod(ids, board.columns)
    return min(len(np.unique(rows)), len(np.unique(columns))) >= _ENOUGH_LINES


def _image_from_board(
    corners_px: NDArray[np.float64], ids: NDArray[np.int64], board: Board
) -> NDArray[np.float64] | None:
    """Return the homography from the board, in squares, to px; None when no flat board has such corners."""
    places = board.places_m()[ids] / board.square_m
    plane = np.asarray(cv2.findHomography(places, corners_px)[0], dtype=np.float64)
    if plane.shape != (3, 3):  # OpenCV found none
        return None
    expected = _mapped(places, plane)
    pitch_px = float(np.sqrt(abs(np.linalg.det(plane[:2, :2])))) / max(abs(float(plane[2, 2])), 1e-12)
    off = np.linalg.norm(expected - corners_px, axis=1)
    return plane if off.max() < _FLAT * pitch_px else None


def _starts_at_black(gray: NDArray[np.uint8], corners_px: NDArray[np.float64], board: Checkerboard) -> bool:
    """Tell whether the square before the first corner is darker than the one beside it."""
    lattice = corners_px.reshape(board.rows, board.columns, 2)
    right, down = lattice[0, 1] - lattice[0, 0], lattice[1, 0] - lattice[0, 0]
    points = lattice[0, 0] + 0.5 * np.array([right + down, right - down])
    inside, beside = _at(gray, points)
    return bool(inside < beside)  # the square after the first corner has the colour of the one before


def _crossing(
    gray: NDArray[np.uint8], places: NDArray[np.int64], plane: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return how much four squares meet at places (n, 2), in squares; NaN outside the image, 0 where none do.

    The sign is the same all over one board.
    """
    around = np.array([[0.3, 0.3], [-0.3, -0.3], [0.3, -0.3], [-0.3, 0.3]])
    points = (places[:, None, :] + around).reshape(-1, 2)
    a, b, c, d = _at(gray, _mapped(points, plane)).reshape(-1, 4).T
    cross = (a + b - c - d) / 2.0
    unlike = np.maximum(np.abs(a - b), np.abs(c - d))
    sign = np.where(places.sum(axis=1) % 2 == 0, 1.0, -1.0) * np.sign(cross)
    return np.asarray(sign * np.maximum(np.abs(cross) - unlike, 0.0))


def _mapped(points: NDArray[np.float64], plane: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n, 2) points through a homography."""
    return np.asarray(cv2.perspectiveTransform(points[:, None, :], plane), dtype=np.float64)[:, 0, :]


def _at(gray: NDArray[np.uint8], points_px: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n,) grey values at the nearest pixels; NaN outside the image."""
    x, y = np.rint(points_px).astype(np.int64).T
    inside = (x >= 0) & (y >= 0) & (x < gray.shape[1]) & (y < gray.shape[0])
    values = np.full(len(x), np.nan)
    values[inside] = gray[y[inside], x[inside]]
    return values


def _window(board: Board, ids: NDArray[np.int64], plane: NDArray[np.float64]) -> int:
    """Return the half width, px, of a window that sees the edges of its own corner alone, everywhere."""
    places = board.places_m()[ids] / board.square_m
    here = _mapped(places, plane)
    right, down = (_mapped(places + step, plane) - here for step in np.eye(2))
    area = np.abs(right[:, 0] * down[:, 1] - right[:, 1] * down[:, 0])
    height_px = float((area / np.maximum(np.linalg.norm(right, axis=1), np.linalg.norm(down, axis=1))).min())
    share = _CLEAR_OF_SQUARES
    if isinstance(board, Charuco):
        share = min(share, _CLEAR_OF_MARKERS * 0.5 * (1.0 - board.marker_m / board.square_m))
    return int(np.clip(round(share * height_px), *_WINDOW_PX))


def _refine(
    gray: NDArray[np.uint8], coarse_px: NDArray[np.float64], *, half_px: int
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return refined corners (n, 2) and which are to be trusted: whole window in the image, not wandered."""
    stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-3)
    start = coarse_px.astype(np.float32)[:, None, :]
    fine = cv2.cornerSubPix(gray, start.copy(), (half_px, half_px), (-1, -1), stop)
    corners = np.asarray(fine, dtype=np.float64)[:, 0, :]
    moved = np.linalg.norm(corners - coarse_px, axis=1)
    room = np.array(gray.shape[::-1], dtype=np.float64) - 1.0
    inside = ((corners >= half_px) & (corners <= room - half_px)).all(axis=1)
    return corners, np.asarray(inside & (moved <= max(half_px, 2.0)))


def _lattice_seen(gray: NDArray[np.uint8]) -> tuple[int, int] | None:
    """Return columns and rows of inner corners of the checkerboard that is in the image, if one is."""
    for picture in (cv2.resize(gray, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA), gray):
        found, _, meta = cv2.findChessboardCornersSBWithMeta(picture, (3, 3), cv2.CALIB_CB_LARGER)
        if not found or meta is None:
            continue
        # the search may take the board's rim for one more row, or miss one
        nearby = [(meta.shape[1] + i, meta.shape[0] + j) for i in (0, -1, 1) for j in (0, -1, 1)]
        for columns, rows in nearby:
            if min(columns, rows) >= LEAST_CORNERS and detect_board(
                gray, Checkerboard(columns=columns, rows=rows)
            ):
                return max(columns, rows), min(columns, rows)
    return None
