"""Conversion of pictures to a network's input and of its output to disparities: layout, scaling, tiles."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.networks.card import NetworkInputs

Picture: TypeAlias = NDArray[np.uint8]
"""(h, w) or (h, w, 3) uint8 RGB."""
Tensor: TypeAlias = NDArray[np.float32]
IMAGENET_MEAN = np.array([0.485, 0.456, 0.406], dtype=np.float32) * 255.0
IMAGENET_DEVIATION = np.array([0.229, 0.224, 0.225], dtype=np.float32) * 255.0
TILE_OVERLAP = 0.25
"""Share of a tile that the next one repeats; disparities of the overlap are blended."""


def to_tensor(picture: Picture, inputs: NetworkInputs) -> Tensor:
    """Return a picture as a tensor of one image, float32, in the card's layout, order and scaling."""
    planes = _channels(picture, inputs).astype(np.float32)
    if inputs.scaling == "0..1":
        planes /= 255.0
    elif inputs.scaling == "-1..1":
        planes = planes / 127.5 - 1.0
    elif inputs.scaling == "imagenet":
        mean, deviation = IMAGENET_MEAN, IMAGENET_DEVIATION
        if inputs.channels == 1:
            mean, deviation = mean.mean(keepdims=True), deviation.mean(keepdims=True)
        elif inputs.order == "BGR":
            mean, deviation = mean[::-1], deviation[::-1]
        planes = (planes - mean) / deviation
    batch = planes[None] if inputs.layout == "NHWC" else np.moveaxis(planes, 2, 0)[None]
    return np.ascontiguousarray(batch, dtype=np.float32)


def padded(picture: Picture, size: tuple[int, int]) -> Picture:
    """Return a picture padded at the right and below to (width, height) px by repeating its border."""
    height, width = picture.shape[:2]
    bottom, right = size[1] - height, size[0] - width
    if (bottom, right) == (0, 0):
        return picture
    return np.asarray(cv2.copyMakeBorder(picture, 0, bottom, 0, right, cv2.BORDER_REPLICATE), dtype=np.uint8)


def padded_size(width: int, height: int, divisor: int) -> tuple[int, int]:
    """Return width and height, px, rounded up to multiples of the divisor."""
    return -(-width // divisor) * divisor, -(-height // divisor) * divisor


def shifted_left(picture: Picture, shift_px: int) -> Picture:
    """Return a right picture moved to the left, so that every disparity grows by `shift_px`."""
    if shift_px == 0:
        return picture
    moved = np.empty_like(picture)
    moved[:, :-shift_px] = picture[:, shift_px:]
    moved[:, -shift_px:] = picture[:, -1:]
    return moved


@dataclass(frozen=True, slots=True, kw_only=True)
class Tile:
    """A window of both pictures, px, and the blending weight (h, w) of the network's output in it."""

    x_px: int
    y_px: int
    weight: Tensor

    def of(self, picture: Picture) -> Picture:
        """Return the tile's part of a picture."""
        height, width = self.weight.shape
        return picture[self.y_px : self.y_px + height, self.x_px : self.x_px + width]


def tiles(width: int, height: int, size: tuple[int, int]) -> Iterator[Tile]:
    """Yield tiles of (width, height) px that cover a picture of at least that size."""
    weight = np.minimum.outer(_ramp(size[1]), _ramp(size[0])).astype(np.float32)
    for y in _starts(height, size[1]):
        for x in _starts(width, size[0]):
            yield Tile(x_px=x, y_px=y, weight=weight)


def _starts(length: int, tile: int) -> list[int]:
    step = max(1, round(tile * (1.0 - TILE_OVERLAP)))
    count = 1 + max(0, -(-(length - tile) // step))
    return [min(index * step, length - tile) for index in range(count)]


def _ramp(length: int) -> Tensor:
    """Return weights that fall towards both ends of a tile, never to zero."""
    distance = np.minimum(np.arange(length), np.arange(length)[::-1]) + 1.0
    return np.minimum(distance / max(1.0, TILE_OVERLAP * length), 1.0).astype(np.float32)


def _channels(picture: Picture, inputs: NetworkInputs) -> Picture:
    if inputs.channels == 1:
        grey = picture if picture.ndim == 2 else cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
        return np.asarray(grey, dtype=np.uint8)[:, :, None]
    colour = picture if picture.ndim == 3 else np.repeat(picture[:, :, None], 3, axis=2)
    return colour[:, :, ::-1] if inputs.order == "BGR" else colour
