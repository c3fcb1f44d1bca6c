"""The depth of a blank point from measured points around it."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_pipeline.verge.alternatives import several
from foveacam_pipeline.verge.surroundings.depth_samples import DepthSamples
from foveacam_pipeline.verge.surroundings.infer import InferredDepth, LastInference, infer_depth
from foveacam_pipeline.verge.surroundings.stated_depth import stated_depth

TARGET = np.array([0.05, -0.02])
RING = 0.03 * np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [0.7, 0.7]])
SIGMA_PER_M = 1.0e-4


def _samples(inverse_z_per_m: NDArray[np.float64]) -> DepthSamples:
    return DepthSamples(
        tangents=TARGET + RING,
        inverse_z_per_m=inverse_z_per_m,
        sigma_per_m=np.full(len(RING), SIGMA_PER_M),
    )


def test_no_samples_suggest_nothing() -> None:
    assert infer_depth(DepthSamples.none(), TARGET) == ()


def test_a_tilted_plane_is_interpolated_within_its_error() -> None:
    truth = 0.36
    slope_per_m = np.array([0.4, -0.2])

    best = infer_depth(_samples(truth + RING @ slope_per_m), TARGET)[0]

    assert abs(best.inverse_z_per_m - truth) <= 3.0 * best.sigma_per_m
    assert abs(best.inverse_z_per_m - truth) <= 1.0e-3 * truth
    assert best.samples == len(RING)


def test_something_in_front_of_the_surface_is_left_out() -> None:
    truth = 0.125
    measured = np.full(len(RING), truth)
    measured[1] = 0.5

    best = infer_depth(_samples(measured), TARGET)[0]

    assert best.inverse_z_per_m == pytest.approx(truth, rel=2.0e-3)
    assert best.probability > 0.8


def test_the_stated_error_covers_a_sphere_seen_by_its_rim() -> None:
    distance_m, radius_m = 5.4, 0.17
    rim = radius_m / distance_m
    samples = DepthSamples(
        tangents=TARGET + rim / 0.03 * RING[:4],
        inverse_z_per_m=np.full(4, 1.0 / distance_m),
        sigma_per_m=np.full(4, SIGMA_PER_M),
    )

    best = infer_depth(samples, TARGET)[0]

    assert abs(best.inverse_z_per_m - 1.0 / (distance_m - radius_m)) <= 3.0 * best.sigma_per_m


def test_of_two_surfaces_the_nearer_one_stands_in_front_of_the_point() -> None:
    measured = np.array([0.2, 0.2, 0.4, 0.4])
    samples = DepthSamples(
        tangents=TARGET + RING[:4], inverse_z_per_m=measured, sigma_per_m=np.full(4, SIGMA_PER_M)
    )

    best = infer_depth(samples, TARGET)[0]

    assert abs(best.inverse_z_per_m - 0.2) <= 3.0 * best.sigma_per_m


def test_points_that_differ_by_more_than_their_errors_leave_a_larger_one() -> None:
    sigma_per_m = 2.0e-3
    two = DepthSamples(
        tangents=TARGET + 1.0e-3 * np.array([[-1.0, 0.0], [1.0, 0.0]]),
        inverse_z_per_m=0.2 + 2.0 * sigma_per_m * np.array([-1.0, 1.0]),
        sigma_per_m=np.full(2, sigma_per_m),
    )

    best = infer_depth(two, TARGET, blank=False)[0]

    assert best.inverse_z_per_m == pytest.approx(0.2, rel=1.0e-3)
    assert 0.95 * sigma_per_m < best.sigma_per_m < 1.5 * sigma_per_m  # of their mean alone it is 0.7 of that


def test_a_single_sample_leaves_a_large_error() -> None:
    alone = DepthSamples(
        tangents=(TARGET + RING[:1]), inverse_z_per_m=np.array([0.2]), sigma_per_m=np.array([SIGMA_PER_M])
    )

    best = infer_depth(alone, TARGET)[0]

    assert best.sigma_per_m >= 0.02 * best.inverse_z_per_m


WALL, STATUE = 0.125, 0.24
AT_THE_RIGHT = 0.03 * np.array([[1.0, 0.3], [1.0, -0.3], [1.0, 0.9], [1.0, -0.9]])
AT_THE_LEFT = 0.05 * np.array([[-1.0, 0.2]])


def _wall_and_statue(wall: NDArray[np.float64]) -> DepthSamples:
    statue = np.full(len(AT_THE_LEFT), STATUE)
    return DepthSamples(
        tangents=TARGET + np.concatenate([wall, AT_THE_LEFT]),
        inverse_z_per_m=np.append(np.full(len(wall), WALL), statue),
        sigma_per_m=np.full(len(wall) + len(statue), SIGMA_PER_M),
    )


def test_a_surface_that_goes_on_behind_something_nearer_surrounds_the_point_with_it() -> None:
    best = infer_depth(_wall_and_statue(AT_THE_RIGHT), TARGET)[0]

    assert best.inverse_z_per_m == pytest.approx(WALL, rel=2.0e-3)
    assert best.held


def test_a_surface_seen_on_one_side_alone_or_in_few_places_does_not_hold() -> None:
    one_side = _wall_and_statue(AT_THE_RIGHT).only(np.arange(4))

    assert not infer_depth(one_side, TARGET)[0].held
    assert not infer_depth(_wall_and_statue(AT_THE_RIGHT[:2]), TARGET)[0].held


def test_edges_behind_a_surface_that_agree_are_no_mismatches() -> None:
    chance = {
        count: infer_depth(_wall_and_statue(AT_THE_RIGHT[:count]), TARGET)[0].probability for count in (2, 4)
    }

    assert chance[4] > chance[2] > 0.7


def test_an_inference_is_made_anew_only_when_something_changed() -> None:
    measured = np.full(len(RING), 0.125)
    samples, chances = _samples(measured), np.full(len(RING), 0.55)
    last = LastInference()

    first = last.infer(samples, TARGET, chances, blank=True)
    again = last.infer(_samples(measured.copy()), TARGET, chances, blank=True)
    of_others = last.infer(_samples(measured + 0.01), TARGET, chances, blank=True)

    assert again is first
    assert of_others == infer_depth(_samples(measured + 0.01), TARGET, own_chance=chances, blank=True)
    assert of_others[0].inverse_z_per_m == pytest.approx(0.135, rel=2.0e-3)


def _edges(places: list[int], inverse_z_per_m: list[float]) -> DepthSamples:
    return DepthSamples(
        tangents=TARGET + RING[places],
        inverse_z_per_m=np.array(inverse_z_per_m),
        sigma_per_m=np.full(len(places), SIGMA_PER_M),
    )


SHARED = 0.4  # chance of an edge that may belong to either side


@pytest.mark.parametrize("places", [[0], [0, 4]])
def test_one_surface_beside_a_blank_region_is_as_likely_as_not_something_in_front(places: list[int]) -> None:
    edges = _edges(places, [0.2] * len(places))
    own, behind = infer_depth(edges, TARGET, own_chance=np.full(len(places), SHARED))
    assert own.inverse_z_per_m == pytest.approx(0.2, rel=1.0e-3)
    assert 0.45 <= own.probability <= 0.6
    assert behind.samples == 0
    assert behind.inverse_z_per_m + 3.0**0.5 * behind.sigma_per_m == pytest.approx(0.2, rel=1.0e-3)


def test_one_surface_is_likely_the_target_s_if_it_surrounds_it_or_owns_an_edge() -> None:
    around = _edges([0, 1, 2, 3], [0.2] * 4)
    assert infer_depth(around, TARGET, own_chance=np.full(4, SHARED))[0].probability >= 0.9
    owning = _edges([0], [0.2])
    assert infer_depth(owning, TARGET, own_chance=np.array([0.98]))[0].probability >= 0.9


def test_of_two_surfaces_without_an_edge_of_the_target_the_farther_is_likely() -> None:
    two = _edges([0, 1, 2], [0.2, 0.2, 0.4])
    best = infer_depth(two, TARGET, own_chance=np.full(3, SHARED))[0]
    assert best.inverse_z_per_m == pytest.approx(0.2, rel=2.0e-3)
    assert 0.75 <= best.probability <= 0.9


def test_of_what_lies_behind_all_that_is_measured_no_distance_is_stated_or_listed() -> None:
    own = InferredDepth(
        inverse_z_per_m=0.2, sigma_per_m=0.002, probability=0.45, samples=2, owned=False, held=False
    )
    behind = replace(own, inverse_z_per_m=0.1, sigma_per_m=0.058, probability=0.55, samples=0)
    assert stated_depth((behind, own), farthest_per_m=0.2, blank=True) is None
    assert stated_depth((own, behind), farthest_per_m=0.2, blank=True) is not None
    assert several((own, behind), TARGET) == ()
    other = replace(own, inverse_z_per_m=0.15, probability=0.25)
    listed = several((behind, own, other), TARGET)
    assert [one.probability for one in listed] == pytest.approx([0.45 / 1.25, 0.25 / 1.25])
