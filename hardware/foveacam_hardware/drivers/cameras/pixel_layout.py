"""Converts raw camera buffers to images: unpacks 12-bit packed pixels and demosaics Bayer patterns.

Pixel formats are GenICam's. Images are copies, so that the library's buffer can be returned at once.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Image, PixelFormat

BITS = {
    PixelFormat.MONO8: 8,
    PixelFormat.MONO12: 12,
    PixelFormat.MONO12P: 12,
    PixelFormat.BAYER_RG8: 8,
    PixelFormat.BAYER_RG12P: 12,
    PixelFormat.RGB8: 8,
}
"""Significant bits per channel."""
PACKED = (PixelFormat.MONO12P, PixelFormat.BAYER_RG12P)
BAYER = (PixelFormat.BAYER_RG8, PixelFormat.BAYER_RG12P)
SMALL_PX = 8
"""Mosaics with a shorter side are interpolated as a whole; of larger ones only the borders are redone."""
REFLECTED_PX = 2
"""Width of the reflected border; an even number keeps the mosaic's colour order."""


def unpack_12p(packed: NDArray[np.uint8], *, height: int, width: int) -> NDArray[np.uint16]:
    """Return (height, width) uint16 of GenICam's `12p`: two pixels in three bytes, low bits first.

    `packed`: (n,) uint8, at least as long as the pixels need, padding ignored. Raise `ValueError`
    when it is shorter.
    """
    pixels = height * width
    whole = (pixels + 1) // 2 * 3
    needed = (12 * pixels + 7) // 8
    if packed.size < needed:
        raise ValueError(f"{packed.size} bytes are too few for {width} x {height} pixels of 12 bit")
    data = packed.reshape(-1)[:whole]
    if data.size < whole:  # an odd number of pixels ends within a group of three bytes
        data = np.concatenate([data, np.zeros(whole - data.size, dtype=np.uint8)])
    triples = data.reshape(-1, 3).astype(np.uint16)
    pairs = np.empty((triples.shape[0], 2), dtype=np.uint16)
    pairs[:, 0] = triples[:, 0] | (triples[:, 1] & 0x0F) << 8
    pairs[:, 1] = triples[:, 1] >> 4 | triples[:, 2] << 4
    return pairs.reshape(-1)[:pixels].reshape(height, width)


def demosaic_rg(mosaic: Image) -> Image:
    """Return (h, w, 3) RGB of an (h, w) mosaic whose first row begins red, green.

    Border pixels are interpolated from the pixels present; OpenCV would copy the adjacent row or column.
    """
    height, width = mosaic.shape
    if min(height, width) < SMALL_PX:
        return _reflected_rg(mosaic)
    rgb = _bilinear_rg(mosaic)
    bottom, right = (
        (height - 3) // 2 * 2,
        (width - 3) // 2 * 2,
    )  # even, so that a strip starts with the mosaic's colours
    rgb[0], rgb[-1] = _reflected_rg(mosaic[:4])[0], _reflected_rg(mosaic[bottom:])[-1]
    rgb[:, 0], rgb[:, -1] = _reflected_rg(mosaic[:, :4])[:, 0], _reflected_rg(mosaic[:, right:])[:, -1]
    return rgb


def _reflected_rg(mosaic: Image) -> Image:
    """Return a mosaic as RGB, interpolated with reflection at its borders."""
    reflected = _as_image(cv2.copyMakeBorder(mosaic, *(REFLECTED_PX,) * 4, cv2.BORDER_REFLECT_101))
    inner = slice(REFLECTED_PX, -REFLECTED_PX)
    return _as_image(np.ascontiguousarray(_bilinear_rg(reflected)[inner, inner]))


def _bilinear_rg(mosaic: Image) -> Image:
    """Return a mosaic as RGB by OpenCV, its outermost pixels copied from their neighbours.

    OpenCV names mosaics by the second row and column: GenICam's RG is its BG.
    """
    return _as_image(cv2.cvtColor(mosaic, cv2.COLOR_BayerBG2RGB))


def _as_image(pixels: object) -> Image:
    found = np.asarray(pixels)
    if found.dtype == np.uint8:
        return found.astype(np.uint8, copy=False)
    return found.astype(np.uint16, copy=False)


def picture_of(sent: Image, pixel_format: PixelFormat, *, height: int, width: int) -> Image:
    """Return a buffer in `pixel_format` as an image, copied.

    `sent`: (height, width) or (height, width, 3), or the flat bytes of a packed format.
    """
    if pixel_format in PACKED:
        sent = unpack_12p(sent.view(np.uint8), height=height, width=width)
    if pixel_format in BAYER:
        return demosaic_rg(sent)
    return sent if pixel_format in PACKED else sent.copy()
