"""Calibration boards: their dimensions, and their construction from plain values.

`board_detector` finds them in images, `calibrate.pattern` draws them.
"""

from dataclasses import dataclass
from typing import TypeAlias, get_args

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.wide.dictionary_names import DictionaryName

DICTIONARIES = {name: getattr(cv2.aruco, f"DICT_{name}") for name in get_args(DictionaryName)}
"""OpenCV's dictionaries of square markers. A larger one of the same cells begins with the smaller one."""
MIN_CORNERS = 3
"""Minimum inner corners along either side; with fewer no detector works."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Checkerboard:
    """A plain checkerboard; `columns`, `rows` count the inner corners, so it has one square more each way.

    It is detected only when all of it is visible.
    """

    columns: int = 9
    rows: int = 6
    square_m: float = 0.036

    def __post_init__(self) -> None:
        _check_lattice(self.columns, self.rows, self.square_m)

    @property
    def kind(self) -> str:
        """Name of the kind of board."""
        return "checkerboard"

    @property
    def corners(self) -> int:
        """Number of inner corners."""
        return self.columns * self.rows

    def places_m(self) -> NDArray[np.float64]:
        """Return the (corners, 2) positions of the inner corners, row by row; the first is (0, 0)."""
        return _lattice_m(self.columns, self.rows, self.square_m)

    def __str__(self) -> str:
        return f"checkerboard of {self.columns} x {self.rows} inner corners"


@dataclass(frozen=True, slots=True, kw_only=True)
class Charuco:
    """A checkerboard with an ArUco marker in each white square, which identifies parts of it.

    `columns`, `rows` count the inner corners, as for a checkerboard. Drawn as OpenCV draws it since 4.6:
    the first square is black, markers are numbered row by row. `legacy_pattern`: drawn as before, where an
    even number of squares downwards begins with a white one.
    """

    columns: int = 9
    rows: int = 6
    square_m: float = 0.036
    marker_m: float = 0.027
    dictionary: str = "4X4_50"
    legacy_pattern: bool = False

    def __post_init__(self) -> None:
        _check_lattice(self.columns, self.rows, self.square_m)
        if not 0.0 < self.marker_m < self.square_m:
            raise InvalidInput(
                f"board: a marker side between 0 and the square's {self.square_m * 1e3:g} mm is needed, "
                f"{self.marker_m * 1e3:g} mm was given; give a smaller marker, as it is printed"
            )
        if self.dictionary not in DICTIONARIES:
            raise InvalidInput(
                f"board: dictionary {self.dictionary!r} is not known; use one of {', '.join(DICTIONARIES)}"
            )
        there = int(cv2.aruco.getPredefinedDictionary(DICTIONARIES[self.dictionary]).bytesList.shape[0])
        if self.markers > there:
            raise InvalidInput(
                f"board: {self} needs {self.markers} markers, dictionary {self.dictionary} has {there}; "
                "take a smaller board or a larger dictionary"
            )

    @property
    def kind(self) -> str:
        """Name of the kind of board."""
        return "charuco"

    @property
    def corners(self) -> int:
        """Number of inner corners."""
        return self.columns * self.rows

    @property
    def markers(self) -> int:
        """Number of markers, one in each white square."""
        return (self.columns + 1) * (self.rows + 1) // 2

    def places_m(self) -> NDArray[np.float64]:
        """Return the (corners, 2) positions of the inner corners, row by row; the first is (0, 0)."""
        return _lattice_m(self.columns, self.rows, self.square_m)

    def printed(self) -> cv2.aruco.CharucoBoard:
        """Return the board as OpenCV's object."""
        words = cv2.aruco.getPredefinedDictionary(DICTIONARIES[self.dictionary])
        size = (self.columns + 1, self.rows + 1)
        board = cv2.aruco.CharucoBoard(size, self.square_m, self.marker_m, words)
        board.setLegacyPattern(self.legacy_pattern)
        return board

    @property
    def drawn(self) -> str:
        """How the markers are drawn, in words."""
        return f"{self.dictionary}, legacy pattern" if self.legacy_pattern else self.dictionary

    def __str__(self) -> str:
        return f"ChArUco board of {self.columns} x {self.rows} inner corners"


Board: TypeAlias = Checkerboard | Charuco


def board_from(
    kind: str,
    *,
    columns: int,
    rows: int,
    square_m: float,
    marker_m: float | None = None,
    dictionary: str = "4X4_50",
    legacy_pattern: bool = False,
) -> Board:
    """Return the board of plain values, as from a request, a file or a command line."""
    if kind == "checkerboard":
        return Checkerboard(columns=columns, rows=rows, square_m=square_m)
    if kind == "charuco":
        marker_m = 0.75 * square_m if marker_m is None else marker_m
        return Charuco(
            columns=columns,
            rows=rows,
            square_m=square_m,
            marker_m=marker_m,
            dictionary=dictionary,
            legacy_pattern=legacy_pattern,
        )
    raise InvalidInput(f"board: kind {kind!r} is not known; use 'checkerboard' or 'charuco'")


def _check_lattice(columns: int, rows: int, square_m: float) -> None:
    if min(columns, rows) < MIN_CORNERS:
        raise InvalidInput(
            f"board: at least {MIN_CORNERS} x {MIN_CORNERS} inner corners are needed, {columns} x {rows} "
            "were given; count the corners where four squares meet"
        )
    if not 0.0 < square_m < np.inf:
        raise InvalidInput(
            f"board: a square's side above 0 mm is needed, {square_m * 1e3:g} mm was given; measure the board"
        )


def _lattice_m(columns: int, rows: int, square_m: float) -> NDArray[np.float64]:
    y, x = np.mgrid[:rows, :columns]
    return np.column_stack([x.ravel(), y.ravel()]).astype(np.float64) * square_m
