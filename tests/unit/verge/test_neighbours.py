"""What points about a target tell of its surface."""

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.plane_head import CALIBRATION

from foveacam_pipeline.verge.matching.wide_patch import cut_template
from foveacam_pipeline.verge.surroundings.blank_region import blank_region
from foveacam_pipeline.verge.surroundings.border_depth import BorderDepth
from foveacam_pipeline.verge.surroundings.depth_samples import DepthSamples
from foveacam_pipeline.verge.surroundings.infer import OWN_CHANCE, encloses
from foveacam_pipeline.verge.surroundings.neighbours import (
    INSIDE_CHANCE,
    OWN_EDGE_CHANCE,
    SHARED_EDGE_CHANCE,
    WINDOW_PX,
    beside_edges,
    edge_owners,
    few_around,
    is_open,
    own_chances,
    repeats_in_row,
    textured_chances,
)

WIDE = CALIBRATION.wide
PX_TAN = 1.0 / WIDE.fx_px
CARD = (600, 840, 440, 640)
"""Left, right, top, bottom edge of a plain card, wide px."""
MIDDLE_PX = np.array([720.0, 540.0])
SIGMA_PER_M = 2.0e-4


def _tangents(pixels: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.tan(WIDE.angles_rad(np.asarray(pixels, dtype=np.float64)))


def _samples(pixels: list[tuple[float, float]], inverse_z_per_m: list[float]) -> DepthSamples:
    return DepthSamples(
        tangents=_tangents(np.array(pixels)),
        inverse_z_per_m=np.array(inverse_z_per_m),
        sigma_per_m=np.full(len(pixels), SIGMA_PER_M),
    )


def _edge(pixel: tuple[float, float], *, beyond: float | None = None) -> BorderDepth:
    tx, ty = _tangents(np.array([pixel]))[0].tolist()
    return BorderDepth(
        tangents=(tx, ty),
        inverse_z_per_m=0.5,
        sigma_per_m=SIGMA_PER_M,
        score=0.95,
        by_both=True,
        beyond=beyond,
    )


def _card() -> NDArray[np.uint8]:
    image = 90.0 + 60.0 * np.random.default_rng(3).random((WIDE.height, WIDE.width))
    left, right, top, bottom = CARD
    image[top:bottom, left:right] = 170.0
    return image.astype(np.uint8)


def test_of_one_direction_the_nearest_surfaces_are_kept_and_farther_points_not() -> None:
    x, y = MIDDLE_PX.tolist()
    samples = _samples(
        [(x + 5, y + 1), (x + 6, y + 1), (x + 7, y + 1), (x + 30, y + 1)], [0.5, 0.5, 0.2, 0.9]
    )

    few = few_around(samples, _tangents(MIDDLE_PX[None])[0], px_tan=PX_TAN)

    assert sorted(few.inverse_z_per_m.tolist()) == [0.2, 0.5]


def test_an_edge_before_something_farther_is_the_regions_own_and_one_level_with_it_may_be_either() -> None:
    left, right, top, _ = CARD
    region = blank_region(_card(), MIDDLE_PX, noise=1.0, places=6)
    row = float(top + 80)
    edges = [_edge((left, row)), _edge((right, row)), _edge((left, row + 90.0))]
    behind_left, level_right = (
        [(left - 14.0 - k, row) for k in range(3)],
        [(right + 14.0 + k, row) for k in range(3)],
    )
    points = _samples(behind_left + level_right, 3 * [0.3] + 3 * [0.5])

    chances = edge_owners(edges, points, region, WIDE)

    assert chances.tolist() == [
        OWN_EDGE_CHANCE,
        SHARED_EDGE_CHANCE,
        OWN_CHANCE,
    ]  # nothing is known beyond the third


def test_what_moves_along_with_an_edge_tells_its_owner_before_any_points() -> None:
    left, _, top, _ = CARD
    region = blank_region(_card(), MIDDLE_PX, noise=1.0, places=6)
    place = (left, float(top + 80))
    behind, level = (_samples([(left - 14.0 - k, place[1]) for k in range(3)], 3 * [q]) for q in (0.3, 0.5))

    assert edge_owners([_edge(place, beyond=0.6)], level, region, WIDE).tolist() == [OWN_EDGE_CHANCE]
    assert edge_owners([_edge(place, beyond=0.99)], behind, region, WIDE).tolist() == [SHARED_EDGE_CHANCE]
    assert edge_owners([_edge(place, beyond=0.9)], behind, region, WIDE).tolist() == [OWN_EDGE_CHANCE]


def test_what_reaches_the_rim_of_the_image_is_open_like_the_sky_unless_its_edges_hide_something() -> None:
    sky = np.full((WIDE.height, WIDE.width), 200, dtype=np.uint8)
    sky[700:] = np.random.default_rng(2).integers(30, 120, (WIDE.height - 700, WIDE.width))
    above = blank_region(sky, np.array([720.0, 200.0]), noise=1.0, places=6)
    card = blank_region(_card(), MIDDLE_PX, noise=1.0, places=6)
    places = [(200.0 + 200.0 * k, 690.0) for k in range(5)]
    skyline, room = (_samples(places, 5 * [1.0 / z_m]) for z_m in (35.0, 8.0))
    level, hiding = np.full(5, SHARED_EDGE_CHANCE), np.full(5, OWN_EDGE_CHANCE)

    assert is_open(above, skyline, level)
    assert not is_open(above, skyline, hiding)
    assert not is_open(above, room, level)
    assert not is_open(card, skyline, level)


def test_points_well_within_a_blank_region_are_of_it_and_those_by_its_border_may_not_be() -> None:
    region = blank_region(_card(), MIDDLE_PX, noise=1.0, places=6)
    left = float(CARD[0])

    inside, border, beyond = own_chances(
        np.array([MIDDLE_PX, (left + 4.0, 540.0), (left - 40.0, 540.0)]), region
    )

    assert inside == INSIDE_CHANCE > border > beyond


def test_a_point_that_shows_no_more_than_an_edge_beside_it_counts_as_that_edge() -> None:
    edge_px, reach_px = (float(CARD[0]), 540.0), WINDOW_PX
    edges = [_edge(edge_px), _edge((float(CARD[1]), 540.0))]
    inward = [0.5 * reach_px, 0.5 * reach_px, 0.9 * reach_px, 1.5 * reach_px]
    points = _samples([(edge_px[0] + px, 540.0) for px in inward], [0.5, 0.45, 0.505, 0.5])

    shown = beside_edges(points, edges, reach_tan=reach_px * PX_TAN)

    assert shown.tolist() == [True, False, True, False]  # one is deeper, one too far away
    assert not beside_edges(points, [], reach_tan=1.0).any()


def test_the_nearer_a_point_is_to_a_textured_target_the_likelier_it_is_of_its_surface() -> None:
    chances = textured_chances(np.array([0.0, 2.0, 10.0, 100.0]))

    assert (np.diff(chances) < 0.0).all()
    assert chances[-1] == pytest.approx(OWN_CHANCE, abs=1e-6)


@pytest.mark.parametrize(
    ("kind", "repeats"), [("noise", False), ("wave", True), ("edge along the row", False)]
)
def test_only_a_patch_that_fits_its_own_row_again_repeats(kind: str, repeats: bool) -> None:
    rng = np.random.default_rng(5)
    image = rng.integers(60, 200, (WIDE.height, WIDE.width)).astype(np.float32)
    if kind == "wave":
        image = 128.0 + 50.0 * np.sin(2.0 * np.pi * np.arange(WIDE.width) / 16.0) + 0.02 * (image - 130.0)
    if kind == "edge along the row":
        image = np.where(np.arange(WIDE.height)[:, None] < 540, 80.0, 170.0) + 0.02 * (image - 130.0)
    gray = image.astype(np.uint8)
    target = _tangents(MIDDLE_PX[None])[0]
    template = cut_template(gray, WIDE, target, half_px=(14, 14), noise=1.0)

    assert repeats_in_row(gray, WIDE, template, target) is repeats


def test_points_enclose_a_target_only_without_a_gap_of_half_a_turn() -> None:
    about = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])

    assert encloses(about)
    assert not encloses(np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.1], [0.5, 0.5]]))
    assert not encloses(about[:3])
