"""One place of each edge of a blank region's border speaks for a direction from the target."""

from dataclasses import replace

import numpy as np
import pytest

from foveacam_pipeline.verge.surroundings.border_depth import BorderDepth
from foveacam_pipeline.verge.surroundings.border_sectors import middles_by_sector

TARGET = np.zeros(2)


def _edge(
    y_tan: float, inverse_z_per_m: float, *, beyond: float | None = None, by_both: bool = True
) -> BorderDepth:
    return BorderDepth(
        tangents=(0.02, y_tan),
        inverse_z_per_m=inverse_z_per_m,
        sigma_per_m=1e-3,
        score=0.95,
        by_both=by_both,
        beyond=beyond,
    )


@pytest.mark.parametrize("outlier", [0.81, None])
def test_one_place_that_differs_does_not_say_what_lies_beyond_an_edge(outlier: float | None) -> None:
    edge = [_edge(0.001 * k, 0.25 + 1e-4 * k, beyond=0.97 + 0.002 * k) for k in range(4)]

    (middle,) = middles_by_sector([*edge, _edge(0.005, 0.25015, beyond=outlier)], TARGET)

    assert middle.inverse_z_per_m in (0.25015, pytest.approx(0.2502))
    assert middle.beyond == pytest.approx(0.972 if outlier else 0.973)


def test_what_one_eye_shows_beyond_an_edge_counts_as_well() -> None:
    by_one = [_edge(0.001 * k, 0.25, beyond=0.98, by_both=False) for k in range(3)]

    (middle,) = middles_by_sector([*by_one, _edge(0.004, 0.25, beyond=0.79)], TARGET)

    assert middle.by_both
    assert middle.beyond == pytest.approx(0.98)


def test_what_is_as_deep_as_no_other_place_does_not_say_what_lies_beyond_the_middle() -> None:
    edge = [_edge(0.001 * k, 0.25, beyond=0.97) for k in range(3)]

    (middle,) = middles_by_sector(
        [*edge, _edge(0.004, 0.5, beyond=0.1), _edge(0.005, 0.1, beyond=0.1)], TARGET
    )

    assert middle == edge[1]


def test_each_direction_has_one_place_and_one_eye_alone_counts_where_the_border_goes_on() -> None:
    right = [_edge(0.0005, 0.25), _edge(0.0015, 0.25)]
    left = [replace(edge, tangents=(-0.02, edge.tangents[1]), by_both=False) for edge in right]

    assert middles_by_sector(right, TARGET) == [right[1]]
    assert len(middles_by_sector([*right, *left], TARGET)) == 2
    assert middles_by_sector([*right, left[0]], TARGET) == [right[1]]
    apart = replace(left[1], inverse_z_per_m=0.255)
    assert middles_by_sector([*right, left[0], apart], TARGET) == [right[1]]


def test_two_edges_in_one_direction_have_a_place_each() -> None:
    far = [_edge(0.001 * k, 0.37, beyond=0.5) for k in range(3)]
    near = [_edge(0.003 + 0.001 * k, 0.51, beyond=0.99) for k in range(5)]

    middles = middles_by_sector([*far, *near], TARGET)

    assert [middle.inverse_z_per_m for middle in middles] == [0.37, 0.51]
    assert [middle.beyond for middle in middles] == [0.5, 0.99]


def test_what_lies_beyond_an_edge_is_told_by_its_places_in_other_directions_too() -> None:
    edge = [_edge(0.005 * k, 0.25, beyond=0.98) for k in range(-2, 2)]
    last = replace(_edge(0.02, 0.25, beyond=0.76), tangents=(0.018, 0.02))

    middles = middles_by_sector([*edge, last], TARGET)

    assert all(middle.beyond == 0.98 for middle in middles)
    assert len(middles) > 1
