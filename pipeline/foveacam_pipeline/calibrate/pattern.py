"""Calibration patterns as black rectangles in metres, and as SVG in millimetres for printers and screens.

The layouts are those of the detectors: `Board` of stage 1, `MarkerLayout` of stage 2.
"""

from dataclasses import dataclass
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.calibrate.sweep.marker_code import CELLS, black_cells
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout
from foveacam_pipeline.calibrate.wide.boards import Board, Charuco

Rows: TypeAlias = NDArray[np.float64]
BOARD_EDGE_SQUARES = 0.5
"""Width of the white edge around a board, squares."""
MARKER_EDGE_CELLS = 1.0
"""Width of the white edge around a marker, cells of its code."""
MARKERS = 50
"""Number of markers in the dictionary 4X4_50."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pattern:
    """Black rectangles on white.

    `width_m`, `height_m`: with the white edge. `black_m`: (n, 4) float64, left, top, right and bottom of each
    rectangle, metres from the upper left corner of the edge. `seams_x_m`, `seams_y_m`: (k,) float64, where a
    print of several sheets is best cut, as far from corners as can be.
    """

    width_m: float
    height_m: float
    black_m: Rows
    seams_x_m: NDArray[np.float64]
    seams_y_m: NDArray[np.float64]


def board_pattern(board: Board) -> Pattern:
    """Return the pattern of a checkerboard or a ChArUco board."""
    columns, rows, square_m = board.columns + 1, board.rows + 1, board.square_m
    odd = np.indices((rows, columns)).sum(axis=0) % 2
    black = _rectangles(odd == 0, cell_m=square_m)
    if isinstance(board, Charuco):
        black = np.vstack([black, _board_markers(board)])
    seams = square_m * np.arange(0.5, columns), square_m * np.arange(0.5, rows)
    edge_m = BOARD_EDGE_SQUARES * square_m
    return _with_edge(black, columns * square_m, rows * square_m, edge_m=edge_m, seams_m=seams)


def marker_pattern(marker_id: int, *, side_m: float) -> Pattern:
    """Return the pattern of one marker of the dictionary 4X4_50."""
    if not 0 <= marker_id < MARKERS:
        raise InvalidInput(
            f"marker {marker_id}: dictionary 4X4_50 has the markers 0 to {MARKERS - 1}; choose one of them"
        )
    return _with_edge(_marker(marker_id, side_m), side_m, side_m, edge_m=MARKER_EDGE_CELLS * side_m / CELLS)


def target_pattern(layout: MarkerLayout) -> Pattern:
    """Return the pattern of the three markers that the mirrors are calibrated with."""
    width_m = 2.0 * layout.spacing_m + layout.side_m
    black = []
    for role in Role:
        x_m, y_m = layout.middle_m(role) + np.array([0.5 * (width_m - layout.side_m), 0.0])
        black.append(_marker(layout.id_of(role), layout.side_m) + np.array([x_m, y_m, x_m, y_m]))
    edge_m = MARKER_EDGE_CELLS * layout.side_m / CELLS
    between = 0.5 * (layout.side_m + layout.spacing_m * np.array([1.0, 3.0]))
    seams = between, np.empty(0)
    return _with_edge(np.vstack(black), width_m, layout.side_m, edge_m=edge_m, seams_m=seams)


def pattern_svg(pattern: Pattern, *, title: str) -> str:
    """Return a pattern as SVG in millimetres; one path, so that no seam shows between its rectangles."""
    width_mm, height_mm = _number(1e3 * pattern.width_m), _number(1e3 * pattern.height_m)
    path = "".join(
        f"M{_number(left)} {_number(top)}H{_number(right)}V{_number(bottom)}H{_number(left)}z"
        for left, top, right, bottom in (1e3 * pattern.black_m).tolist()
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width_mm}mm" height="{height_mm}mm" '
        f'viewBox="0 0 {width_mm} {height_mm}"><title>{title}</title>'
        f'<rect width="{width_mm}" height="{height_mm}" fill="#fff"/><path fill="#000" d="{path}"/></svg>\n'
    )


def _board_markers(board: Charuco) -> Rows:
    """Return the rectangles of a board's markers, (n, 4) m from the board's upper left corner."""
    printed = board.printed()
    dictionary = printed.getDictionary()
    cells = dictionary.markerSize + 2
    black = []
    for marker_id, corners_m in zip(np.ravel(printed.getIds()).tolist(), printed.getObjPoints(), strict=True):
        code = cv2.aruco.generateImageMarker(dictionary, marker_id, cells) == 0
        x_m, y_m = np.asarray(corners_m, dtype=np.float64)[0, :2].tolist()
        black.append(_rectangles(code, cell_m=board.marker_m / cells) + np.array([x_m, y_m, x_m, y_m]))
    return np.vstack(black)


def _marker(marker_id: int, side_m: float) -> Rows:
    return _rectangles(black_cells(marker_id) > 0.0, cell_m=side_m / CELLS)


def _rectangles(black: NDArray[np.bool_], *, cell_m: float) -> Rows:
    """Return one rectangle for each run of black cells in a row, (n, 4) m."""
    found = []
    for row, cells in enumerate(black):
        change = np.flatnonzero(np.diff(np.concatenate([[False], cells, [False]]).astype(np.int8)))
        found += [(start, row, end, row + 1) for start, end in change.reshape(-1, 2).tolist()]
    return cell_m * np.array(found, dtype=np.float64).reshape(-1, 4)


def _with_edge(
    black_m: Rows,
    width_m: float,
    height_m: float,
    *,
    edge_m: float,
    seams_m: tuple[NDArray[np.float64], NDArray[np.float64]] = (np.empty(0), np.empty(0)),
) -> Pattern:
    return Pattern(
        width_m=width_m + 2.0 * edge_m,
        height_m=height_m + 2.0 * edge_m,
        black_m=black_m + edge_m,
        seams_x_m=seams_m[0] + edge_m,
        seams_y_m=seams_m[1] + edge_m,
    )


def _number(value_mm: float) -> str:
    """Return millimetres to a tenth of a micrometre."""
    return f"{value_mm:.4f}".rstrip("0").rstrip(".")
