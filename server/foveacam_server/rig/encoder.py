"""Encodes the newest picture of a view as JPEG: once per picture and size, on request, off the event loop."""

import asyncio
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Literal, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import DeviceFault, Image
from foveacam_server.foundation.watching import timings
from foveacam_server.foundation.watching.flows import ENCODER, count_flow, view_part
from foveacam_server.rig.frame_hub import FrameHub
from foveacam_server.rig.view_state import ViewPicture

QUALITY = 75
"""Measured: a grey 1440x1080 frame takes 3-4 ms and about 150 kB; PNG takes 64 ms and 2.3 MB."""

Scale: TypeAlias = Literal[1, 2, 4]
"""Pixels of the sensor along each side of a pixel of a picture."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EncodedPicture:
    """A picture as JPEG; `jpeg` decodes to RGB."""

    picture: ViewPicture
    scale: int
    """Pixels of the sensor along each side of one of `jpeg`."""
    jpeg: bytes


def eight_bit(image: Image, *, bits: int) -> NDArray[np.uint8]:
    """Return `image` with its `bits` significant bits reduced to the upper 8."""
    if image.dtype == np.uint8:
        return image.astype(np.uint8, copy=False)
    return np.right_shift(image, max(bits - 8, 0)).astype(np.uint8)


def halve(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the mean of each 2x2 block; an odd last row or column is left out.

    Any other factor would fall out of OpenCV's fast path and cost more than the encoding.
    """
    height, width = image.shape[0] // 2, image.shape[1] // 2
    even = image[: 2 * height, : 2 * width]
    return np.asarray(cv2.resize(even, (width, height), interpolation=cv2.INTER_AREA), dtype=np.uint8)


def encode_jpeg(image: Image, *, reduction: Scale = 1, bits: int = 8, quality: int = QUALITY) -> bytes:
    """Return `image`, (h, w) grey or (h, w, 3) RGB, as JPEG, full size or exactly halved once or twice."""
    pixels = eight_bit(image, bits=bits)
    for _ in range(reduction.bit_length() - 1):
        pixels = halve(pixels)
    if pixels.ndim == 3:
        pixels = np.asarray(cv2.cvtColor(pixels, cv2.COLOR_RGB2BGR), dtype=np.uint8)
    done, buffer = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, quality])
    if not done:
        raise DeviceFault(f"a picture of {image.shape} {image.dtype} could not be encoded as JPEG")
    return buffer.tobytes()


def encode_png(picture: NDArray[np.uint8]) -> bytes:
    """Return an RGB picture (h, w, 3) as PNG, quickly rather than small."""
    bgr = cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)
    _, buffer = cv2.imencode(".png", bgr, [cv2.IMWRITE_PNG_COMPRESSION, 1])
    return buffer.tobytes()


class JpegStore:
    """The newest JPEG of each view and size, shared by all clients of this event loop.

    Sizes are identified by the reduction of the camera's picture: all sizes larger than a binned picture
    share the encoding at its full size.
    """

    def __init__(self, hub: FrameHub, *, executor: Executor) -> None:
        self._hub = hub
        self._executor = executor
        self._newest: dict[tuple[str, Scale], tuple[ViewPicture, asyncio.Future[EncodedPicture]]] = {}
        self._encodes: dict[tuple[str, Scale], int] = {}

    @property
    def encodes(self) -> dict[tuple[str, Scale], int]:
        """Number of pictures that were encoded, by view and reduction."""
        return dict(self._encodes)

    async def newest(self, view: str, scale: Scale) -> EncodedPicture | None:
        """Return the newest picture of `view` as JPEG, at `scale` or at its own where that is coarser.

        None before the first picture.
        """
        picture = self._hub.newest(view)
        if picture is None:
            return None
        reduction = _reduction(scale, picture)
        held = self._newest.get((view, reduction))
        if held is None or held[0] is not picture:
            held = (picture, self._begin(picture, reduction))
            self._newest[(view, reduction)] = held
        # Shielded: a client that leaves must not cancel what others wait for
        return await asyncio.shield(held[1])

    def _begin(self, picture: ViewPicture, reduction: Scale) -> "asyncio.Future[EncodedPicture]":
        key = (picture.view, reduction)
        self._encodes[key] = self._encodes.get(key, 0) + 1
        count_flow(view_part(picture.view), ENCODER, "pictures")
        future = asyncio.get_running_loop().run_in_executor(self._executor, _encode, picture, reduction)
        future.add_done_callback(_retrieve)
        return future


def _reduction(scale: Scale, picture: ViewPicture) -> Scale:
    """Return the reduction of a picture for `scale`, or for the next coarser scale that it can have."""
    if scale <= picture.binning:
        return 1
    return 4 if scale // picture.binning >= 4 else 2


def _encode(picture: ViewPicture, reduction: Scale) -> EncodedPicture:
    with timings.ENCODE.time():
        jpeg = encode_jpeg(picture.image, reduction=reduction, bits=picture.bits)
    return EncodedPicture(picture=picture, scale=reduction * picture.binning, jpeg=jpeg)


def _retrieve(future: "asyncio.Future[EncodedPicture]") -> None:
    """Mark an error as retrieved, to avoid a warning when all waiting clients have left."""
    if not future.cancelled():
        future.exception()
