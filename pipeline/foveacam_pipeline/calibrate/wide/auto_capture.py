"""Automatic capture of a view when the board is held still and the view shows something new."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from foveacam_pipeline.calibrate.wide.board_detector import BoardView

CaptureState = Literal["no board", "moving", "nothing new", "holding", "taken"]
STATE_NOTES: dict[CaptureState, str] = {
    "no board": "no board in view",
    "moving": "hold the board still",
    "nothing new": "seen already: move or tilt the board",
    "holding": "hold it",
    "taken": "taken: move on",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class AutoCaptureVerdict:
    """Verdict on one image; `view`: the mean of the images of the board at rest, when captured."""

    state: CaptureState
    view: BoardView | None = None
    frames: int = 0


class AutoCapture:
    """Rates views in sequence. A board is still when no corner moves by more than `still_px` meanwhile.

    A view is the mean of `frames` images, or of fewer when the board has already been still for `held_s`.
    """

    def __init__(self, *, still_px: float = 0.4, frames: int = 3, held_s: float = 0.5) -> None:
        self._still_px = still_px
        self._frames = frames
        self._held_ns = round(held_s * 1e9)
        self._quick: BoardView | None = None
        self._quick_ns = 0
        self._held: list[BoardView] = []
        self._since_ns = 0

    def add_image(
        self,
        quick: BoardView | None,
        *,
        t_ns: int,
        exact: Callable[[], BoardView | None],
        is_new: Callable[[BoardView], bool],
    ) -> AutoCaptureVerdict:
        """Return the verdict on the next image, exposed at `t_ns`, by its quickly detected view.

        `exact` detects it again accurately; `is_new` returns whether a view would add something.
        """
        before, before_ns = self._quick, self._quick_ns
        self._quick, self._quick_ns = quick, t_ns
        if quick is None:
            self._held.clear()
            return AutoCaptureVerdict(state="no board")
        if before is None or not _same_corners(before, quick, within_px=self._still_px):
            self._held.clear()
            return AutoCaptureVerdict(state="moving")
        if not self._held and not is_new(quick):
            return AutoCaptureVerdict(state="nothing new")
        fine = exact()
        if fine is None or (self._held and not _same_corners(self._held[0], fine, within_px=self._still_px)):
            self._held.clear()
            return AutoCaptureVerdict(state="moving")
        if not self._held:
            self._since_ns = before_ns
        self._held.append(fine)
        if len(self._held) < self._frames and t_ns - self._since_ns < self._held_ns:
            return AutoCaptureVerdict(state="holding")
        view = mean_view(self._held)
        frames = len(self._held)
        self._held.clear()
        if view is None:
            return AutoCaptureVerdict(state="moving")
        return AutoCaptureVerdict(state="taken", view=view, frames=frames)


def mean_view(views: list[BoardView]) -> BoardView | None:
    """Return the mean of views of a board at rest, for their common corners; None when there are none."""
    first = views[0]
    shared = first.ids
    for view in views[1:]:
        shared = np.intersect1d(shared, view.ids)
    if len(shared) == 0:
        return None
    corners = [view.corners_px[np.searchsorted(view.ids, shared)] for view in views]
    return BoardView(
        board=first.board,
        corners_px=np.mean(corners, axis=0),
        ids=shared,
        width=first.width,
        height=first.height,
    )


def _same_corners(one: BoardView, other: BoardView, *, within_px: float) -> bool:
    """Return whether the common corners of both views are at the same positions."""
    shared, mine, theirs = np.intersect1d(one.ids, other.ids, return_indices=True)
    if 2 * len(shared) < len(one.ids):
        return False
    return float(np.abs(one.corners_px[mine] - other.corners_px[theirs]).max()) <= within_px
