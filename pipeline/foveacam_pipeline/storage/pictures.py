"""Decoding of picture files into grey values of 8 bits."""

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

BITS = 8
ALPHA = 3
"""Channel of a decoded picture that holds its opacity."""


def gray_as_exposed(content: bytes) -> NDArray[np.uint8] | None:
    """Return a picture to be measured, (h, w) uint8; None if it is none of 8 or 16 bits.

    A note in the file that a viewer should turn it is ignored: it would exchange the axes of the lens.
    """
    image = _decoded(content)
    if image is None:
        return None
    narrow = eight_bits(image)
    if narrow.ndim == 2:
        return narrow
    return np.asarray(cv2.cvtColor(narrow[..., :ALPHA], cv2.COLOR_BGR2GRAY), dtype=np.uint8)


def gray_over_white(content: bytes) -> NDArray[np.uint8] | None:
    """Return a drawing as viewers show it on white paper, (h, w) uint8; None if it is no picture."""
    image = _decoded(content)
    if image is None:
        return None
    if image.dtype == np.uint8 and (image.ndim == 2 or image.shape[2] <= ALPHA):
        shown = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_GRAYSCALE)  # turned as viewers do
        return None if shown is None else np.asarray(shown, dtype=np.uint8)
    gray = gray_as_exposed(content)
    if gray is None or image.ndim == 2 or image.shape[2] <= ALPHA:
        return gray
    opacity = image[..., ALPHA] / np.iinfo(image.dtype).max
    return np.asarray(np.rint(255.0 - opacity * (255.0 - gray)), dtype=np.uint8)


def eight_bits(image: NDArray[np.unsignedinteger[Any]]) -> NDArray[np.uint8]:
    """Return an image, (h, w) or (h, w, c) of unsigned integers, in 8 bits.

    Cameras of 10 or 12 bits fill the low bits of 16: the largest value tells how many are significant.
    """
    if image.dtype == np.uint8:
        return np.asarray(image, dtype=np.uint8)
    values = image[..., :ALPHA] if image.ndim == ALPHA else image  # opacity fills all bits
    significant = int(values.max(initial=0)).bit_length()
    return np.asarray(values >> max(0, significant - BITS), dtype=np.uint8)


def _decoded(content: bytes) -> NDArray[np.unsignedinteger[Any]] | None:
    read = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED) if content else None
    if read is None:
        return None
    image: NDArray[Any] = read
    return image if image.dtype in (np.uint8, np.uint16) else None
