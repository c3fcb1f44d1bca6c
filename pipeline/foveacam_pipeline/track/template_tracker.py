"""Template tracker: normalised cross-correlation with two templates, with re-detection after occlusion.

The first template never changes and prevents drift; the second adapts to the target's appearance. A lost
target is searched for about its expected position, wider with each image, then in the whole image.
"""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import OutOfRange
from foveacam_pipeline.matching.correlation import correlation, peak, score_map
from foveacam_pipeline.track.image_tracker import (
    LEAST_SIDE_PX,
    GreyImage,
    TrackBox,
    TrackMatch,
    check_inside,
    cut_box,
)

FOUND_SCORE = 0.45
LOCKED_SCORE = 0.6
"""Least correlation to re-acquire a lost target."""
RENEWAL = 0.05
"""Weight of the newest image in the second template."""
RENEWED_SCORE = 0.6
"""Least correlation with the first template for the second to be updated."""
LEAST_REACH_PX = 8
MOST_REACH_PX = 256
MOVES_REACH = 3.0
"""Search radius in multiples of the smoothed residual of the prediction."""
SMOOTHING = 0.3
WIDENING_MISSES = 5
"""Images in a row without the target after which the whole image is searched."""
STRIDE = 2
BESIDE = 0.75
"""Distance from another target, in sides of the box, within which a match shows a part of that one."""
LEAST_CONTRAST = 1.0
"""Least standard deviation of a box with enough texture to track, grey levels."""


class TemplateTracker:
    """Correlates the image about the expected position with the first and the adaptive template."""

    def __init__(self) -> None:
        self._first = np.zeros((0, 0), dtype=np.float32)
        self._renewed = self._first
        self._at = (0.0, 0.0)
        self._move_px = 0.0
        self._refused: tuple[float, float] | None = None
        self._others: tuple[tuple[float, float], ...] = ()
        self.misses = 0
        """Images in a row in which the target was not found."""

    def start(self, image: GreyImage, box: TrackBox) -> None:
        """Learn the target; raise `OutOfRange` where the box is not inside the image or shows nothing."""
        width, height = max(LEAST_SIDE_PX, box.width_px) | 1, max(LEAST_SIDE_PX, box.height_px) | 1
        check_inside(box, columns=image.shape[1], rows=image.shape[0])
        first = cut_box(image, x_px=box.x_px, y_px=box.y_px, width_px=width, height_px=height)
        if float(first.std()) < LEAST_CONTRAST:
            raise OutOfRange("the box shows nothing that could be followed; choose something with texture")
        self._first = self._renewed = first
        self._at, self._move_px, self.misses = (box.x_px, box.y_px), 0.0, 0

    def update(self, image: GreyImage, near: tuple[float, float] | None) -> TrackMatch | None:
        """Return the target's position; None if it is not found."""
        expected = self._at if near is None else near
        lost = self.misses > 0
        if self.misses > WIDENING_MISSES:
            found = self.search(image)
        else:
            found = self._search(image, expected, self._first)
            if not lost:
                found = max(found, self._search(image, expected, self._renewed), key=lambda one: one.score)
        if found.score < (LOCKED_SCORE if lost else FOUND_SCORE):
            self.misses += 1
            return None
        self.misses, self._refused = 0, None
        moved_px = float(np.hypot(found.x_px - expected[0], found.y_px - expected[1]))
        self._move_px += SMOOTHING * (moved_px - self._move_px)
        self._at = found.x_px, found.y_px
        self._renew(image, found)
        return found

    def avoid(self, places_px: Sequence[tuple[float, float]]) -> None:
        """Set where other targets are, px: a lost target is not found there."""
        self._others = tuple(places_px)

    def refuse(self) -> None:
        """Reject the last match as another object; the target is then searched for elsewhere."""
        self.misses = WIDENING_MISSES + 1
        self._refused = self._at

    def _reach_px(self) -> int:
        usual = max(LEAST_REACH_PX, max(self._first.shape) / 2, MOVES_REACH * self._move_px)
        return round(min(MOST_REACH_PX, usual * 2.0 ** min(self.misses, 4)))

    def _search(
        self, image: GreyImage, about: tuple[float, float], template: NDArray[np.float32]
    ) -> TrackMatch:
        """Return the best match around `about`; a maximum on the border of the search window enlarges it.

        There the score still rises outwards: a fast target has moved beyond the window.
        """
        height, width = template.shape
        x, y = (round(value) for value in about)
        reach = self._reach_px()
        while True:
            part = cut_box(image, x_px=x, y_px=y, width_px=width + 2 * reach, height_px=height + 2 * reach)
            scores = score_map(part, template)
            if self.misses > 0:
                self._leave_out(scores, self._others, corner=(x - reach, y - reach))
            right, down, score = peak(scores)
            beside = max(abs(right - reach), abs(down - reach))
            if beside < reach or score < FOUND_SCORE or reach == MOST_REACH_PX:
                return TrackMatch(x_px=x - reach + right, y_px=y - reach + down, score=score)
            reach = min(MOST_REACH_PX, 2 * reach)

    def search(self, image: GreyImage) -> TrackMatch:
        """Return the best match in the whole image except at a refused place, coarse (half size) to fine."""
        height, width = self._first.shape
        small, template = _halved(image), _halved(self._first)
        scores = score_map(small, template)
        middle_y, middle_x = ((side - 1) / 2 / STRIDE for side in (height, width))
        left_out = self._others if self._refused is None else (*self._others, self._refused)
        self._leave_out(scores, left_out, corner=(STRIDE * middle_x, STRIDE * middle_y), stride=STRIDE)
        x, y, _ = peak(scores)
        about = round(STRIDE * (x + middle_x)), round(STRIDE * (y + middle_y))
        part = cut_box(
            image,
            x_px=about[0],
            y_px=about[1],
            width_px=width + 2 * LEAST_REACH_PX,
            height_px=height + 2 * LEAST_REACH_PX,
        )
        right, down, score = peak(score_map(part, self._first))
        return TrackMatch(
            x_px=about[0] - LEAST_REACH_PX + right, y_px=about[1] - LEAST_REACH_PX + down, score=score
        )

    def _leave_out(
        self,
        scores: NDArray[np.float32],
        places_px: Sequence[tuple[float, float]],
        *,
        corner: tuple[float, float],
        stride: int = 1,
    ) -> None:
        """Set the scores about some places to the least; `corner`: place of the first score, px."""
        radius = round(BESIDE * max(self._first.shape) / stride)
        for x_px, y_px in places_px:
            at = round((x_px - corner[0]) / stride), round((y_px - corner[1]) / stride)
            cv2.circle(scores, at, radius, -1.0, thickness=-1)

    def _renew(self, image: GreyImage, found: TrackMatch) -> None:
        height, width = self._first.shape
        seen = cut_box(image, x_px=found.x_px, y_px=found.y_px, width_px=width, height_px=height)
        if correlation(seen, self._first) >= RENEWED_SCORE:
            self._renewed = np.asarray(
                cv2.addWeighted(self._renewed, 1.0 - RENEWAL, seen, RENEWAL, 0.0), dtype=np.float32
            )


def _halved(picture: GreyImage | NDArray[np.float32]) -> NDArray[np.float32]:
    small = cv2.resize(picture, None, fx=1.0 / STRIDE, fy=1.0 / STRIDE, interpolation=cv2.INTER_AREA)
    return np.asarray(small, dtype=np.float32)
