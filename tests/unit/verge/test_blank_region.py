"""The blank region about a point of the wide image, and places on its border."""

import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.verge.surroundings.blank_region import blank_region, side_of_edge

NOISE = 1.5
CARD = (300, 420, 200, 330)
"""Left, right, top, bottom edge of a plain card, px."""


def _scene(seed: int = 3) -> NDArray[np.uint8]:
    rng = np.random.default_rng(seed)
    image = 90.0 + 40.0 * rng.random((540, 720))
    left, right, top, bottom = CARD
    image[top:bottom, left:right] = 170.0
    return np.clip(image + rng.normal(scale=NOISE, size=image.shape), 0, 255).astype(np.uint8)


def test_the_region_is_the_card_and_its_border_places_lie_on_its_edges() -> None:
    left, right, top, bottom = CARD
    region = blank_region(_scene(), np.array([350.0, 260.0]), noise=NOISE, places=6)

    assert not region.touches_rim
    assert 0.7 < region.mask.sum() * 4 / ((right - left) * (bottom - top)) < 1.1
    assert len(region.border_px) >= 4
    to_side_px = np.minimum(np.abs(region.border_px[:, 0] - left), np.abs(region.border_px[:, 0] - right))
    inside_rows = (region.border_px[:, 1] > top - 6) & (region.border_px[:, 1] < bottom + 6)
    assert inside_rows.all()
    assert np.median(to_side_px) <= 2.0  # one pixel of the halved picture


@pytest.mark.parametrize(
    ("rows", "columns"),
    [((0, 60), (300, 420)), ((480, 540), (300, 420)), ((200, 330), (0, 60)), ((200, 330), (660, 720))],
)
def test_a_region_at_any_rim_touches_it(rows: tuple[int, int], columns: tuple[int, int]) -> None:
    image = _scene()
    image[slice(*rows), slice(*columns)] = 170

    region = blank_region(image, np.array([np.mean(columns), np.mean(rows)]), noise=NOISE, places=6)

    assert region.touches_rim
    assert region.area_share < 0.05


def test_pixels_of_the_region_are_held_and_others_not() -> None:
    region = blank_region(_scene(), np.array([350.0, 260.0]), noise=NOISE, places=4)

    held = region.depth_px(np.array([[350.0, 260.0], [600.0, 100.0]])) > 0.0

    assert held.tolist() == [True, False]


def test_a_picture_without_any_edge_has_no_border_and_touches_the_rim() -> None:
    rng = np.random.default_rng(1)
    image = np.clip(120.0 + rng.normal(scale=NOISE, size=(540, 720)), 0, 255).astype(np.uint8)

    region = blank_region(image, np.array([300.0, 200.0]), noise=NOISE, places=6)

    assert len(region.border_px) == 0
    assert region.touches_rim


def test_an_edge_between_two_colours_of_one_brightness_is_an_edge() -> None:
    """In grey levels there is none."""
    blue, brown = (40, 100, 178), (140, 84, 0)
    picture = np.zeros((80, 120, 3), dtype=np.uint8)
    picture[:, :60], picture[:, 60:] = blue, brown
    assert np.ptp(gray(picture)) == 0

    side = side_of_edge(picture, np.array([56.0, 40.0]))

    assert (side[20:60, 45:54] == 255).all()
    assert not side[:, 66:].any()
