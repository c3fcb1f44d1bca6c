"""Bytes of a stream and the pictures that they are."""

import zlib
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_hardware.contract import Image, InvalidInput
from foveacam_pipeline.capture.recording.pixels import (
    pack_12p,
    payload_of,
    picture_of,
    pixels_of,
    stream_format,
    to_eight_bits,
    unpack_12p,
)
from foveacam_pipeline.capture.recording.values import StreamFormat

RNG = np.random.default_rng(11)


def form_of(pixel_format: str, *, dtype: str = "U8", channels: int = 1, bits: int = 8) -> StreamFormat:
    return StreamFormat(
        pixel_format=pixel_format, dtype=dtype, height=4, width=6, channels=channels, bits=bits
    )


def picture(payload: bytes, form: StreamFormat, *, what: str = "frame") -> Image:
    """Return the picture that a message makes."""
    return picture_of(pixels_of(payload, form, what=what), form, what=what)


def deep(height: int, width: int) -> NDArray[np.uint16]:
    return RNG.integers(0, 4096, (height, width), dtype=np.uint16)


@pytest.mark.parametrize(
    ("image", "bits", "packed", "name"),
    [
        (RNG.integers(0, 256, (5, 7), dtype=np.uint8), 8, False, "Mono8"),
        (RNG.integers(0, 256, (5, 7, 3), dtype=np.uint8), 8, False, "RGB8"),
        (deep(5, 7), 12, False, "Mono12p"),
        (deep(5, 7), 12, True, "Mono12p"),
        (RNG.integers(0, 65536, (5, 7), dtype=np.uint16), 16, False, "Mono16"),
        (RNG.integers(0, 4096, (5, 7, 3), dtype=np.uint16), 12, False, "RGB16"),
    ],
)
def test_a_picture_comes_back_as_it_was(image: Image, bits: int, packed: bool, name: str) -> None:
    form = stream_format(image, bits=bits, packed=packed)
    back = picture(payload_of(image, form).tobytes(), form)

    assert form.pixel_format == name
    assert form.packed is packed
    assert StreamFormat.of_metadata(form.metadata(), what="stream") == form
    np.testing.assert_array_equal(back, image)
    assert back.dtype == image.dtype


def test_packed_pixels_lie_low_bits_first() -> None:
    assert pack_12p(np.array([[0xABC, 0x123]], dtype=np.uint16)).tolist() == [0xBC, 0x3A, 0x12]
    assert unpack_12p(np.array([0xBC, 0x3A, 0x12], dtype=np.uint8), height=1, width=2).tolist() == [
        [0xABC, 0x123]
    ]


@pytest.mark.parametrize(
    ("pixel_format", "red_at"),
    [("BayerRG8", (0, 0)), ("BayerGR8", (0, 1)), ("BayerGB8", (1, 0)), ("BayerBG8", (1, 1))],
)
def test_a_red_world_is_red_through_every_mosaic(pixel_format: str, red_at: tuple[int, int]) -> None:
    mosaic = np.zeros((8, 10), dtype=np.uint8)
    mosaic[red_at[0] :: 2, red_at[1] :: 2] = 200
    form = replace(form_of(pixel_format), height=8, width=10)
    rgb = picture(mosaic.tobytes(), form)

    assert rgb.reshape(-1, 3).tolist() == [[200, 0, 0]] * 80


@pytest.mark.parametrize(("height", "width"), [(2, 2), (2, 9), (3, 3), (5, 7), (8, 8), (9, 11), (40, 50)])
@pytest.mark.parametrize("pixel_format", ["BayerRG", "BayerGR", "BayerGB", "BayerBG"])
def test_a_mosaic_is_rgb_right_to_its_border(pixel_format: str, height: int, width: int) -> None:
    shades = {"R": 3000, "G": 2000, "B": 1000}
    first = pixel_format[5:]
    second = {"RG": "GB", "BG": "GR", "GR": "BG", "GB": "RG"}[first]
    rows = [[shades[row[column % 2]] for column in range(width)] for row in (first, second)]
    mosaic = np.array([rows[row % 2] for row in range(height)], dtype=np.uint16)
    form = replace(form_of(pixel_format + "12p", bits=12), height=height, width=width)

    raw = pixels_of(pack_12p(mosaic).tobytes(), form, what="frame")
    rgb = picture_of(raw, form, what="frame")

    np.testing.assert_array_equal(raw, mosaic)
    assert rgb.reshape(-1, 3).tolist() == [[3000, 2000, 1000]] * (height * width)


def test_the_pixels_of_a_grey_picture_are_the_picture() -> None:
    form = form_of("Mono8")
    raw = pixels_of(bytes(range(24)), form, what="frame")

    assert picture_of(raw, form, what="frame") is raw
    assert raw.tobytes() == bytes(range(24))


def test_a_packed_mosaic_of_twelve_bits_becomes_deep_rgb() -> None:
    mosaic = np.zeros((4, 6), dtype=np.uint16)
    mosaic[::2, ::2] = 3000
    rgb = picture(pack_12p(mosaic).tobytes(), form_of("BayerRG12p", bits=12))

    assert rgb.dtype == np.uint16
    assert rgb[1, 2].tolist() == [3000, 0, 0]


@pytest.mark.parametrize(
    ("pixel_format", "pixel"), [("BGR8", [3, 2, 1]), ("RGBA8", [1, 2, 3, 9]), ("BGRA8", [3, 2, 1, 9])]
)
def test_other_orders_of_channels_become_rgb(pixel_format: str, pixel: list[int]) -> None:
    data = np.array(pixel * 24, dtype=np.uint8)
    form = form_of(pixel_format, channels=len(pixel))

    assert picture(data.tobytes(), form)[0, 0].tolist() == [1, 2, 3]


def test_bytes_that_make_no_picture_are_refused_with_both_lengths() -> None:
    with pytest.raises(InvalidInput, match="are 24 bytes, 23 were found"):
        picture(bytes(23), form_of("Mono8"), what="frame 3 of left")


@pytest.mark.parametrize("data", [b"no zlib", zlib.compress(bytes(10_000_000))], ids=["noise", "bomb"])
def test_what_is_no_compressed_frame_is_refused(data: bytes) -> None:
    with pytest.raises(InvalidInput, match="frame"):
        picture(data, replace(form_of("Mono8"), compressed=True))


def test_a_format_that_nobody_knows_is_named() -> None:
    with pytest.raises(InvalidInput, match=r"'YUV422'.*known are Mono8"):
        picture(bytes(24), form_of("YUV422"))


@pytest.mark.parametrize(
    "wrong",
    [
        {"shape": "[0, 4]"},
        {"shape": "[4]"},
        {"shape": "nonsense"},
        {"dtype": "F32"},
        {"shape": "[4, 99999999]"},
        {"shape": "[4, 6, 2]"},
    ],
)
def test_metadata_that_describe_no_picture_are_refused(wrong: dict[str, str]) -> None:
    with pytest.raises(InvalidInput, match="left"):
        StreamFormat.of_metadata(form_of("Mono8").metadata() | wrong, what="left")


def test_twelve_bits_are_shown_at_their_full_scale() -> None:
    shown = to_eight_bits(np.array([[0, 2048, 4095]], dtype=np.uint16), bits=12)

    assert shown.tolist() == [[0, 128, 255]]
