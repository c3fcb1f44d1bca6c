"""Kernelised correlation filter (KCF) tracker on grey values (Henriques et al., TPAMI 2015).

OpenCV 5 has no KCF: its trackers are networks, whose weights it does not ship, and MIL, which takes 60 ms an
image.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.matching.correlation import largest, vertex
from foveacam_pipeline.track.image_tracker import LEAST_SIDE_PX, GreyImage, TrackBox, TrackMatch, cut_box
from foveacam_pipeline.track.template_tracker import TemplateTracker

PADDING = 2.5
"""Side of the filter's window, in sides of the box."""
KERNEL_SIGMA = 0.2
REGULARISATION = 1.0e-4
LABEL_SHARE = 0.1
"""Standard deviation of the desired response (a Gaussian), as a share of the box's mean side."""
LEARNING = 0.075
FOUND_PEAK = 0.25
"""Least response for the target to count as found; it is 1 on the image that was learned."""


class CorrelationFilterTracker:
    """Tracks by a filter whose response peaks at the target, updated with every image that shows it.

    A lost target is found again by a `TemplateTracker` that keeps its first picture.
    """

    def __init__(self) -> None:
        self._at = (0.0, 0.0)
        self._size = (0, 0)
        self._window = np.zeros((0, 0))
        self._wanted = np.zeros((0, 0), dtype=np.complex128)
        self._model = np.zeros((0, 0), dtype=np.complex128)
        self._alpha = self._model
        self._lost = False
        self._finder = TemplateTracker()

    def start(self, image: GreyImage, box: TrackBox) -> None:
        """Learn the target; raise `OutOfRange` where the box is not inside the image or shows nothing."""
        self._finder.start(image, box)
        width, height = max(LEAST_SIDE_PX, box.width_px), max(LEAST_SIDE_PX, box.height_px)
        self._size = round(PADDING * width) | 1, round(PADDING * height) | 1
        self._at = box.x_px, box.y_px
        self._window = np.outer(np.hanning(self._size[1]), np.hanning(self._size[0]))
        sigma_px = LABEL_SHARE * np.sqrt(width * height)
        y, x = (np.arange(side) - side // 2 for side in self._window.shape)
        label = np.exp(-0.5 * (x[None, :] ** 2 + y[:, None] ** 2) / sigma_px**2)
        self._wanted = np.fft.fft2(np.fft.ifftshift(label))
        self._model = self._spectrum(image, self._at)
        self._alpha = self._trained(self._model)
        self._lost = False

    def update(self, image: GreyImage, near: tuple[float, float] | None) -> TrackMatch | None:
        """Return the target's position; None if it is not found, in which case nothing is learned."""
        expected = self._at if near is None else near
        if self._lost:
            match = self._finder.update(image, near)
            if match is None:
                return None
            expected = match.x_px, match.y_px
        seen = self._spectrum(image, expected)
        answer = np.real(np.fft.ifft2(self._alpha * np.fft.fft2(self._correlate(seen, self._model))))
        right, down, height = _peak_of_period(answer)
        if height < FOUND_PEAK:
            self._lost = True
            self._finder.misses = max(1, self._finder.misses)
            return None
        self._lost = False
        self._at = expected[0] + right, expected[1] + down
        self._learn(image)
        return TrackMatch(x_px=self._at[0], y_px=self._at[1], score=min(1.0, height))

    def avoid(self, places_px: Sequence[tuple[float, float]]) -> None:
        """Set where other targets are, px: a lost target is not found there."""
        self._finder.avoid(places_px)

    def refuse(self) -> None:
        """Reject the last match as another object; the target is then searched for elsewhere."""
        self._lost = True
        self._finder.refuse()

    def _learn(self, image: GreyImage) -> None:
        here = self._spectrum(image, self._at)
        self._model = (1.0 - LEARNING) * self._model + LEARNING * here
        self._alpha = (1.0 - LEARNING) * self._alpha + LEARNING * self._trained(here)

    def _spectrum(self, image: GreyImage, about: tuple[float, float]) -> NDArray[np.complex128]:
        part = cut_box(
            image, x_px=about[0], y_px=about[1], width_px=self._size[0], height_px=self._size[1]
        ).astype(np.float64)
        spread = max(float(part.std()), 1.0e-6)
        return np.fft.fft2(self._window * (part - part.mean()) / spread)

    def _correlate(self, seen: NDArray[np.complex128], model: NDArray[np.complex128]) -> NDArray[np.float64]:
        """Return the Gaussian kernel of `seen` with every shift of `model` (Henriques et al., Eq. 31)."""
        count = seen.size
        energy = float(np.sum(np.abs(seen) ** 2) + np.sum(np.abs(model) ** 2)) / count
        cross = np.real(np.fft.ifft2(seen * np.conj(model)))
        apart = np.maximum(0.0, energy - 2.0 * cross) / count
        return np.asarray(np.exp(-apart / KERNEL_SIGMA**2), dtype=np.float64)

    def _trained(self, model: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """Return the dual coefficients of a ridge regression on one image (Henriques et al., Eq. 17)."""
        return self._wanted / (np.fft.fft2(self._correlate(model, model)) + REGULARISATION)


def _peak_of_period(answer: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return the sub-pixel (x, y) shift of the peak of a periodic response, and the peak's height."""
    column, row = largest(answer)
    shifts = []
    for index, line in ((column, answer[row]), (row, answer[:, column])):
        three = (float(line[(index + step) % len(line)]) for step in (-1, 0, 1))
        signed = index - len(line) if index > len(line) // 2 else index
        shifts.append(signed + vertex(*three))
    return shifts[0], shifts[1], float(answer[row, column])
