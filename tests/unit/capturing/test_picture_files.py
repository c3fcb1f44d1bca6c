"""Grey values of picture files: as exposed, as viewers show them, and of cameras that fill few of 16 bits."""

import cv2
import numpy as np
import pytest
from cv2.typing import MatLike

from foveacam_pipeline.storage.pictures import eight_bits, gray_as_exposed, gray_over_white

RAMP = np.linspace(0, 255, 48 * 64).reshape(48, 64).astype(np.uint8)


def _png(image: MatLike) -> bytes:
    return cv2.imencode(".png", image)[1].tobytes()


@pytest.mark.parametrize("bits", [8, 10, 12, 14, 16])
def test_the_significant_bits_become_eight(bits: int) -> None:
    wide = np.asarray(RAMP.astype(np.uint16) << (bits - 8), dtype=np.uint16)
    assert (eight_bits(wide) == RAMP).all()
    assert gray_as_exposed(_png(wide)) is not None


def test_colours_and_opacity_do_not_change_what_was_exposed() -> None:
    colour = cv2.cvtColor(RAMP, cv2.COLOR_GRAY2BGRA)
    colour[..., 3] = 7
    read = gray_as_exposed(_png(colour))
    assert read is not None and np.abs(read.astype(int) - RAMP).max() <= 1


def test_twelve_bits_with_an_alpha_channel_of_sixteen_keep_their_own() -> None:
    values = RAMP.astype(np.uint16) << 4
    picture = np.dstack([values, values, values, np.full_like(values, 65535)])
    read = gray_as_exposed(_png(picture))
    assert read is not None and np.abs(read.astype(int) - RAMP).max() <= 1


@pytest.mark.parametrize("depth", [np.uint8, np.uint16])
def test_transparent_parts_of_a_drawing_are_white(depth: type[np.unsignedinteger]) -> None:
    full = np.iinfo(depth).max
    drawing = np.zeros((48, 64, 4), dtype=depth)
    drawing[10:20, 10:30, 3] = full
    drawing[30:40, 10:30, 3] = full // 2
    shown = gray_over_white(_png(drawing))
    assert shown is not None
    assert (shown[15, 20], shown[5, 5]) == (0, 255)
    assert abs(int(shown[35, 20]) - 127) <= 1


@pytest.mark.parametrize("content", [b"", b"no picture"])
def test_what_is_no_picture_is_none(content: bytes) -> None:
    assert gray_as_exposed(content) is None
    assert gray_over_white(content) is None


def test_a_picture_of_floating_point_is_none_to_be_measured() -> None:
    content = cv2.imencode(".tiff", RAMP.astype(np.float32))[1].tobytes()
    assert gray_as_exposed(content) is None
