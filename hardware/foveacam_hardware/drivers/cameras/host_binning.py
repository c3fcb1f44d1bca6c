"""Binning on the host, for cameras that cannot average pixels themselves."""

import cv2
import numpy as np

from foveacam_hardware.contract import DeviceFault, Image


def average_2x2(image: Image) -> Image:
    """Return (h // 2, w // 2) means of 2x2 pixels, per channel, halves rounded up; dtype and range are kept.

    An odd last row or column is left out, so that x = 2 x_b + 0.5 holds for every pixel.
    Raise `DeviceFault` for an image without a block of 2x2.
    """
    height, width = image.shape[0] // 2, image.shape[1] // 2
    if min(height, width) < 1:
        raise DeviceFault(
            f"asked for binning 2, and its pictures have {image.shape[1]}x{image.shape[0]} pixels; read a"
            " larger part of its sensor"
        )
    whole = image[: 2 * height, : 2 * width]
    averaged = np.asarray(cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA))
    if averaged.dtype == np.uint8:
        return averaged.astype(np.uint8, copy=False)
    return averaged.astype(np.uint16, copy=False)
