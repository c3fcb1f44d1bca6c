"""Pictures for people: which eye is which colour, near is warm, holes are striped, depths are labelled."""

from dataclasses import replace

import numpy as np
import pytest
from tests.support.scenes.stereo_pairs import HEIGHT, WIDTH, flat, pair_of

from foveacam_pipeline.stereo.pictures import HOLE, AnaglyphStyle, anaglyph, depth_picture, difference
from foveacam_pipeline.stereo.pictures import _label as label
from foveacam_pipeline.stereo.pictures import _ticks as ticks
from foveacam_pipeline.stereo.values import DepthMap


def depth_of(z_m: np.ndarray) -> DepthMap:
    z = z_m.astype(np.float32)
    return DepthMap(z_m=z, sigma_m=0.01 * z, pose_sigma_m=0.01 * z)


def ramp() -> np.ndarray:
    return np.tile(np.linspace(2.0, 8.0, WIDTH), (HEIGHT, 1))


def test_the_left_eye_is_red_and_the_right_one_cyan() -> None:
    pair = pair_of(flat(4.0))
    picture = anaglyph(pair)
    np.testing.assert_array_equal(picture[..., 0], pair.left)
    np.testing.assert_array_equal(picture[..., 1], pair.right)
    np.testing.assert_array_equal(picture[..., 2], pair.right)


@pytest.mark.parametrize(
    ("style", "left", "right", "dark"),
    [
        (AnaglyphStyle.RED_CYAN, [0], [1, 2], []),
        (AnaglyphStyle.RED_BLUE, [0], [2], [1]),
        (AnaglyphStyle.CYAN_RED, [1, 2], [0], []),
        (AnaglyphStyle.BLUE_RED, [2], [0], [1]),
    ],
)
def test_each_eye_has_the_colour_of_its_glass(
    style: AnaglyphStyle, left: list[int], right: list[int], dark: list[int]
) -> None:
    pair = pair_of(flat(4.0))
    picture = anaglyph(pair, style)
    for channels, expected in ((left, pair.left), (right, pair.right), (dark, np.zeros_like(pair.left))):
        for channel in channels:
            np.testing.assert_array_equal(picture[..., channel], expected)


def test_what_one_eye_alone_sees_is_dimmed() -> None:
    pair = pair_of(flat(0.0))
    pair.valid_right[:, :50] = False
    picture = anaglyph(pair)
    np.testing.assert_array_equal(picture[:, :50, 0], pair.left[:, :50] // 3)
    np.testing.assert_array_equal(picture[:, 50:, 0], pair.left[:, 50:])


def test_eyes_that_agree_differ_by_middle_grey_whatever_their_gain() -> None:
    pair = pair_of(flat(0.0), noise=0.0)
    pair = replace(pair, left=pair.left // 2, right=pair.right // 2)  # room to be brighter
    brighter = pair.right + np.uint8(9)
    assert np.abs(difference(replace(pair, right=brighter)).astype(int) - 128).max() <= 2
    assert difference(pair_of(flat(9.0))).std() > 4.0


def test_near_is_warm_and_far_is_cool() -> None:
    picture = depth_picture(depth_of(ramp())).astype(int)
    red_over_blue = picture[HEIGHT // 2, :WIDTH, 0] - picture[HEIGHT // 2, :WIDTH, 2]
    assert red_over_blue[30] > 60
    assert red_over_blue[WIDTH - 60] < -60


def test_the_scale_stands_beside_the_picture() -> None:
    picture = depth_picture(depth_of(ramp()))
    assert picture.shape[0] == HEIGHT and picture.shape[1] > WIDTH and picture.dtype == np.uint8
    bar = picture[:, WIDTH:].astype(int)
    lit = bar.max(axis=2) > 150
    assert lit.mean() > 0.03  # frame, ticks and numbers


def test_holes_are_striped_and_counted() -> None:
    z_m = ramp()
    z_m[:, 100:200] = np.nan
    picture = depth_picture(depth_of(z_m))
    hole = picture[:, 100:200].reshape(-1, 3)
    assert {tuple(colour) for colour in np.unique(hole, axis=0).tolist()} == set(HOLE)
    whole = depth_picture(depth_of(ramp()))
    assert (picture[:, WIDTH:] != whole[:, WIDTH:]).any()  # "none 21 %"


def test_a_depth_keeps_its_colour_when_the_scale_is_given() -> None:
    one = depth_picture(depth_of(np.full((HEIGHT, WIDTH), 5.0)), near_m=2.0, far_m=8.0)
    two = depth_picture(depth_of(ramp()), near_m=2.0, far_m=8.0)
    column = round((5.0 - 2.0) / 6.0 * (WIDTH - 1))
    np.testing.assert_allclose(one[0, 0].astype(int), two[0, column].astype(int), atol=4)


@pytest.mark.parametrize("z_m", [flat(np.nan), flat(3.0)])
def test_nothing_known_and_one_depth_can_be_shown(z_m: np.ndarray) -> None:
    assert depth_picture(depth_of(z_m)).shape[0] == HEIGHT


@pytest.mark.parametrize(("low_m", "high_m"), [(2.695, 2.702), (1.2, 3.4), (7.9, 8.1), (1.0, 30.0)])
def test_labels_are_a_few_different_round_depths_of_the_scale(low_m: float, high_m: float) -> None:
    values_m = ticks(low_m, high_m)
    assert 2 <= len(values_m) <= 8
    assert all(low_m <= value_m <= high_m for value_m in values_m)
    words = [label(value_m, high_m - low_m) for value_m in values_m]
    assert len(set(words)) == len(words)
    assert all(
        abs(float(word.removesuffix(" m")) - v) < 1e-6 for word, v in zip(words, values_m, strict=True)
    )
