"""Half-size images of a UVC camera in place of binning, where a comparison shows that they are 2x2 means.

OpenCV does not report whether a smaller size is scaled, cropped or subsampled.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Binning, DeviceFault
from foveacam_hardware.drivers.cameras.host_binning import average_2x2
from foveacam_hardware.drivers.cameras.opencv.source import OpenCvCapture

SETTLING_FRAMES = 2
"""Frames read after a change of size; the last one is compared."""
LEAST_CONTRAST = 6.0
"""Standard deviation, grey levels, below which a picture cannot be compared."""
LEAST_CORRELATION = 0.95
MOST_SHIFT_PX = 0.1
"""Largest shift between the two pictures, binned pixels; subsampling would shift by a quarter."""
Size = tuple[int, int]


class HalfSize:
    """Switches one opened camera between full and half size; compares both once, at the first use."""

    def __init__(self, capture: OpenCvCapture, *, label: str) -> None:
        self._capture = capture
        self._label = label
        self._whole = _size(capture)
        self._is_mean: bool | None = None

    def apply(self, binning: Binning) -> Binning:
        """Set the size for a binning; return the camera's binning: 1 leaves the averaging to the host."""
        width, height = self._whole
        if binning == 1 or width % 2 or height % 2 or self._is_mean is False:
            self._set(self._whole)
            return 1
        half = (width // 2, height // 2)
        if self._is_mean is None:
            self._is_mean = self._compare(half)
        return 2 if self._is_mean and self._set(half) else self.apply(1)

    def _compare(self, half: Size) -> bool:
        self._set(self._whole)
        whole_image = self._read(self._whole)
        half_image = self._read(half) if self._set(half) else None
        return whole_image is not None and half_image is not None and is_mean_of(half_image, whole_image)

    def _read(self, size: Size) -> NDArray[np.uint8] | None:
        """Return a grey picture; None for one of another size."""
        image = None
        for _ in range(SETTLING_FRAMES):
            there, image = self._capture.read()
            if not there or image is None or image.shape[1::-1] != size:
                return None
        if image is None or image.ndim == 2:
            return image
        return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)

    def _set(self, size: Size) -> bool:
        """Set a size; return whether the camera took it. Raise `DeviceFault` if full size is lost."""
        if _size(self._capture) != size:
            self._capture.set(cv2.CAP_PROP_FRAME_WIDTH, size[0])
            self._capture.set(cv2.CAP_PROP_FRAME_HEIGHT, size[1])
        found = _size(self._capture)
        if size == self._whole and found != size:
            raise DeviceFault(
                f"{self._label}: asked for {size[0]}x{size[1]} pixels again, and it stays at {found[0]}x"
                f"{found[1]}; plug it in anew"
            )
        return found == size


def is_mean_of(half: NDArray[np.uint8], whole: NDArray[np.uint8]) -> bool:
    """Return whether a grey picture is the 2x2 mean of another, up to gain and offset."""
    a, b = average_2x2(whole).astype(np.float64), half.astype(np.float64)
    if a.shape != b.shape or min(a.std(), b.std()) < LEAST_CONTRAST:
        return False
    if np.corrcoef(a.ravel(), b.ravel())[0, 1] < LEAST_CORRELATION:
        return False
    return _shift_px(a, b) < MOST_SHIFT_PX


def _shift_px(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Return a small shift between two pictures, fitted with their gain and offset by least squares."""
    down, along = np.gradient(b)
    columns = np.stack([b.ravel(), np.ones(b.size), along.ravel(), down.ravel()], axis=1)
    gain, _, x, y = np.linalg.lstsq(columns.T @ columns, columns.T @ a.ravel(), rcond=None)[0]
    return float(np.hypot(x, y) / max(abs(gain), 1e-6))


def _size(capture: OpenCvCapture) -> Size:
    return round(capture.get(cv2.CAP_PROP_FRAME_WIDTH)), round(capture.get(cv2.CAP_PROP_FRAME_HEIGHT))
