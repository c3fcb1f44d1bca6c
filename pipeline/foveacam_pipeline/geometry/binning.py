"""Pixels of binned pictures and pixels of the sensor: x = n x_b + (n - 1) / 2 at binning n.

Everything counts pixels of the unbinned sensor, but for the functions that read the brightness of a picture.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Binning, Frame, InvalidInput


def sensor_px(pixels: NDArray[np.float64], binning: Binning) -> NDArray[np.float64]:
    """Return pixels of a binned picture, of any shape, as pixels of the sensor."""
    return np.asarray(binning * pixels + (binning - 1) / 2, dtype=np.float64)


def picture_px(pixels: NDArray[np.float64], binning: Binning) -> NDArray[np.float64]:
    """Return pixels of the sensor, of any shape, as pixels of a binned picture."""
    return np.asarray((pixels - (binning - 1) / 2) / binning, dtype=np.float64)


def sensor_from_picture(binning: Binning) -> NDArray[np.float64]:
    """Return (3, 3) float64: pixels of a binned picture to pixels of the sensor."""
    offset = (binning - 1) / 2
    return np.array([[binning, 0.0, offset], [0.0, binning, offset], [0.0, 0.0, 1.0]])


def binning_of(shape: tuple[int, ...], *, width: int, height: int) -> Binning:
    """Return the binning of a picture of `shape` (h, w, ...) by a sensor of `width` x `height` px."""
    for binning in (1, 2):
        if tuple(shape[:2]) == (height // binning, width // binning):
            return 2 if binning == 2 else 1
    raise InvalidInput(
        f"a picture of {shape[1]} x {shape[0]} px belongs to no binning of a sensor of {width} x {height} "
        "px; use the calibration of the camera that took it"
    )


def common_binning(*frames: Frame) -> Binning:
    """Return the common binning of frames that are compared; raise InvalidInput where they differ."""
    first = frames[0]
    for frame in frames:
        if frame.binning != first.binning:
            raise InvalidInput(
                f"the {first.role} frame is binned by {first.binning}, the {frame.role} one by "
                f"{frame.binning}; set all cameras alike and look again"
            )
    return first.binning


def enlarge(image: NDArray[np.uint8], *, binning: Binning) -> NDArray[np.uint8]:
    """Return a picture, (h, w) or (h, w, 3), at the size of its sensor, interpolated where it is binned."""
    if binning == 1:
        return image
    height, width = image.shape[:2]
    size = (binning * width, binning * height)
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_LINEAR), dtype=np.uint8)
