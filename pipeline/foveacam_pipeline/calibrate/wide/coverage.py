"""Coverage of the image and of the possible tilts by views of a board."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.wide.board_detector import BoardView
from foveacam_pipeline.calibrate.wide.board_pose import TILTS, BoardPose, pose_of_view
from foveacam_pipeline.models.intrinsics import Intrinsics

COLUMNS, ROWS = 12, 9
_NEW_CELLS = 3
_NEW_TURN_RAD = math.radians(8.0)
_NEW_PLACE = 0.08
_NEW_SIZE = 0.15


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BoardCoverage:
    """Coverage by views. `cells`: (9, 12) int64, number of views with a corner in each part of the image.

    `tilts`: number of views of each of `TILTS`.
    """

    cells: NDArray[np.int64]
    tilts: tuple[int, ...]

    @property
    def fraction(self) -> float:
        """Covered share of the image, 0 to 1."""
        return float((self.cells > 0).mean())

    @property
    def tilts_covered(self) -> int:
        """Number of the five tilts that have been shown."""
        return sum(count > 0 for count in self.tilts)

    def __str__(self) -> str:
        missing = [tilt for tilt, count in zip(TILTS, self.tilts, strict=True) if count == 0]
        words = f"{100.0 * self.fraction:.0f} % of the image covered"
        return words + (f"; not shown yet: {', '.join(missing)}" if missing else ", tilted every way")


class CoverageTracker:
    """Coverage of the views so far, and whether another view would add to it."""

    def __init__(
        self, views: Iterable[BoardView] = (), lens: Intrinsics | None = None, *, role: Role = Role.WIDE
    ) -> None:
        self._lens, self._role = lens, role
        self._cells = np.zeros((ROWS, COLUMNS), dtype=np.int64)
        self._tilts = [0] * len(TILTS)
        self._known: list[tuple[BoardView, BoardPose]] = []
        for view in views:
            self.add(view)

    @property
    def coverage(self) -> BoardCoverage:
        """The coverage so far."""
        return BoardCoverage(cells=self._cells.copy(), tilts=tuple(self._tilts))

    def add(self, view: BoardView) -> None:
        """Add a view."""
        pose = pose_of_view(view, self._lens, role=self._role)
        self._cells += cells_of(view)
        self._tilts[TILTS.index(pose.tilt)] += 1
        self._known.append((view, pose))

    def is_new(self, view: BoardView) -> bool:
        """Return whether a view shows new parts of the image, or differs from each one so far."""
        if int((cells_of(view) & (self._cells == 0)).sum()) >= _NEW_CELLS:
            return True
        pose = pose_of_view(view, self._lens, role=self._role)
        return not any(_are_alike(view, pose, *known) for known in self._known)


def coverage_of(
    views: Iterable[BoardView], lens: Intrinsics | None = None, *, role: Role = Role.WIDE
) -> BoardCoverage:
    """Return the coverage of views, with tilts by a calibrated lens or the nominal one of the camera."""
    return CoverageTracker(views, lens, role=role).coverage


def different_views(views: Iterable[BoardView]) -> int:
    """Return how many views show the board otherwise than those before; repeated pictures are one."""
    tracker, different = CoverageTracker(), 0
    for view in views:
        if tracker.is_new(view):
            tracker.add(view)
            different += 1
    return different


def cells_of(view: BoardView) -> NDArray[np.bool_]:
    """Return the (9, 12) mask of the parts of the image that have a corner of the board."""
    column = np.clip(view.corners_px[:, 0] * COLUMNS / view.width, 0, COLUMNS - 1).astype(np.int64)
    row = np.clip(view.corners_px[:, 1] * ROWS / view.height, 0, ROWS - 1).astype(np.int64)
    cells = np.zeros((ROWS, COLUMNS), dtype=np.bool_)
    cells[row, column] = True
    return cells


def _are_alike(view: BoardView, mine: BoardPose, other: BoardView, theirs: BoardPose) -> bool:
    turn = math.acos(np.clip((np.trace(mine.rotation.T @ theirs.rotation) - 1.0) / 2.0, -1.0, 1.0))
    shift = np.hypot(*(np.array(view.centre_px) - np.array(other.centre_px))) / view.width
    size = abs(math.log(np.linalg.norm(mine.middle_m) / np.linalg.norm(theirs.middle_m)))
    return bool(turn < _NEW_TURN_RAD and shift < _NEW_PLACE and size < _NEW_SIZE)
