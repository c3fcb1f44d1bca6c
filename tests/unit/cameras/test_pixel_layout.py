"""Packed twelve bits and Bayer mosaics become pictures, exactly."""

import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_hardware.contract import PixelFormat
from foveacam_hardware.drivers.cameras.pixel_layout import demosaic_rg, picture_of, unpack_12p


def packed(pixels: NDArray[np.uint16]) -> NDArray[np.uint8]:
    """Pack as GenICam says: b0 = a[7:0], b1 = b[3:0] a[11:8], b2 = b[11:4]."""
    sent = []
    flat = [int(value) for value in pixels.reshape(-1)]
    for a, b in zip(flat[::2], [*flat, 0][1::2], strict=False):
        sent += [a & 0xFF, (b & 0xF) << 4 | a >> 8, b >> 4]
    return np.array(sent, dtype=np.uint8)


@pytest.mark.parametrize(("height", "width"), [(4, 6), (5, 7), (1, 1), (1080, 1440)])
def test_packed_pixels_come_out_as_they_went_in(height: int, width: int) -> None:
    pixels = np.random.default_rng(1).integers(0, 4096, (height, width), dtype=np.uint16)

    assert np.array_equal(unpack_12p(packed(pixels), height=height, width=width), pixels)


def test_the_first_three_bytes_are_those_of_the_standard() -> None:
    assert unpack_12p(np.array([0xBC, 0x6A, 0x45], dtype=np.uint8), height=1, width=2).tolist() == [
        [0xABC, 0x456]
    ]


def test_bytes_that_are_missing_are_refused_and_padding_is_not() -> None:
    pixels = np.full((2, 2), 7, dtype=np.uint16)
    with pytest.raises(ValueError, match="too few"):
        unpack_12p(packed(pixels)[:-1], height=2, width=2)
    padded = np.concatenate([packed(pixels), np.zeros(10, dtype=np.uint8)])
    assert np.array_equal(unpack_12p(padded, height=2, width=2), pixels)


@pytest.mark.parametrize(("row", "column", "channel"), [(0, 0, 0), (0, 1, 1), (1, 0, 1), (1, 1, 2)])
def test_each_place_of_the_mosaic_is_its_colour(row: int, column: int, channel: int) -> None:
    mosaic = np.zeros((12, 12), dtype=np.uint8)
    mosaic[row::2, column::2] = 200
    inner = demosaic_rg(mosaic)[4:8, 4:8].reshape(-1, 3)

    assert int(inner.max(axis=0).argmax()) == channel
    assert [int(level) for level in inner.max(axis=0)].count(0) == 2


@pytest.mark.parametrize(("height", "width"), [(2, 2), (2, 9), (3, 3), (9, 11), (40, 50)])
def test_a_mosaic_is_rgb_right_to_its_border(height: int, width: int) -> None:
    mosaic = np.full((height, width), 2000, dtype=np.uint16)
    mosaic[::2, ::2], mosaic[1::2, 1::2] = 3000, 1000
    picture = picture_of(packed(mosaic), PixelFormat.BAYER_RG12P, height=height, width=width)

    assert picture.reshape(-1, 3).tolist() == [[3000, 2000, 1000]] * (height * width)


def test_a_packed_mosaic_becomes_twelve_bit_rgb() -> None:
    mosaic = np.full((6, 8), 3000, dtype=np.uint16)
    picture = picture_of(packed(mosaic), PixelFormat.BAYER_RG12P, height=6, width=8)

    assert picture.shape == (6, 8, 3)
    assert picture.dtype == np.uint16
    assert int(picture.min()) == int(picture.max()) == 3000


def test_a_picture_does_not_change_when_the_buffer_is_used_again() -> None:
    buffer = np.zeros((3, 4), dtype=np.uint8)
    picture = picture_of(buffer, PixelFormat.MONO8, height=3, width=4)
    buffer[:] = 9

    assert int(picture.max()) == 0
