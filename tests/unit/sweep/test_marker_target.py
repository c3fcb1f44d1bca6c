"""The three markers as one body: where it stands, and what is said when it is not the one agreed on."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.calibrate.sweep.marker_code import CELLS, black_cells
from foveacam_pipeline.calibrate.sweep.marker_model import cell_corners, outer_corners
from foveacam_pipeline.calibrate.sweep.marker_target import check_order, locate_target
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout, MarkerView
from foveacam_pipeline.models.intrinsics import Intrinsics

WIDE = Intrinsics(
    width=1440,
    height=1080,
    fx_px=3155.0,
    fy_px=3155.0,
    cx_px=723.0,
    cy_px=537.0,
    distortion=(-0.06, 0.0, 0.0, 0.0, 0.0),
)
LAYOUT = MarkerLayout()
NOISE_PX = 0.01


def turned(x_rad: float, y_rad: float, z_rad: float) -> NDArray[np.float64]:
    cx, sx, cy, sy, cz, sz = (f(a) for a in (x_rad, y_rad, z_rad) for f in (math.cos, math.sin))
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return np.asarray(about_z @ about_y @ about_x, dtype=np.float64)


def seen(
    middle_m: tuple[float, float, float],
    rotation: NDArray[np.float64],
    *,
    layout: MarkerLayout = LAYOUT,
    seed: int = 0,
) -> dict[int, MarkerView]:
    """Return the wide view of a target, every corner with its noise."""
    rng = np.random.default_rng(seed)
    views = {}
    for role in Role:
        marker_id = layout.id_of(role)
        cells = np.vstack([outer_corners(), cell_corners(black_cells(marker_id))])
        places = cells * layout.side_m / CELLS
        points = np.array(middle_m) + (places + layout.middle_m(role)) @ rotation[:, :2].T
        corners = WIDE.pixels(np.arctan(points[:, :2] / points[:, 2:])) + rng.normal(
            0.0, NOISE_PX, places.shape
        )
        views[marker_id] = MarkerView(
            id=marker_id, corners_px=corners, places_m=places, sharpness=1.6, complete=True
        )
    return views


def test_the_target_stands_where_its_corners_say() -> None:
    middle, rotation = (0.5, -0.4, 4.9), turned(0.08, -0.12, 0.03)

    pose = locate_target(seen(middle, rotation), LAYOUT, WIDE)

    # 50 corners of 0.01 px: 0.0014 px sideways, 4e-7 rad; along the view Z (0.01 px / 130 px) / sqrt(50).
    assert np.allclose(pose.middle_m[:2] / pose.middle_m[2], np.array(middle[:2]) / middle[2], atol=3e-6)
    assert pose.distance_m == pytest.approx(float(np.linalg.norm(middle)), abs=4.0 * pose.distance_sigma_m)
    assert pose.distance_sigma_m < 2e-3
    assert pose.misfit_px == pytest.approx(math.sqrt(2.0) * NOISE_PX, rel=0.3)
    left = np.array(middle) - 0.1 * rotation[:, 0]
    assert np.allclose(pose.marker_rig_m(Role.LEFT), left, atol=2e-3)


def test_distances_scatter_as_far_as_they_say() -> None:
    middle, rotation = (0.5, -0.4, 4.9), turned(0.08, -0.12, 0.03)
    ratios = []
    for seed in range(200):
        pose = locate_target(seen(middle, rotation, seed=seed), LAYOUT, WIDE)
        ratios.append((pose.distance_m - float(np.linalg.norm(middle))) / pose.distance_sigma_m)
    assert 0.85 <= float(np.sqrt(np.mean(np.square(ratios)))) <= 1.25  # 200 draws know it to 5 %


def test_a_tape_changes_no_direction() -> None:
    views = seen((0.5, -0.4, 4.9), turned(0.05, 0.1, 0.0))
    free = locate_target(views, LAYOUT, WIDE)

    taped = locate_target(views, LAYOUT, WIDE, distance_m=5.0)

    assert taped.distance_m == pytest.approx(5.0)
    for role in Role:
        one, other = free.marker_rig_m(role), taped.marker_rig_m(role)
        assert np.allclose(one / np.linalg.norm(one), other / np.linalg.norm(other), atol=1e-12)


def test_a_tape_that_contradicts_the_markers_is_refused() -> None:
    views = seen((0.0, 0.0, 4.9), np.eye(3))

    with pytest.raises(InvalidInput, match=r"by tape it is 2\.500 m away, by its markers 4\.9"):
        locate_target(views, LAYOUT, WIDE, distance_m=2.5)


def test_swapped_markers_are_named() -> None:
    swapped = MarkerLayout(left_id=2, right_id=1)
    views = seen((0.0, 0.0, 5.0), np.eye(3), layout=swapped)

    with pytest.raises(InvalidInput, match="from the left its markers are 2, 0, 1 instead of 1, 0, 2 "):
        locate_target(views, LAYOUT, WIDE)


def test_two_swapped_markers_are_named_even_when_the_third_is_hidden() -> None:
    views = seen((0.0, 0.0, 5.0), np.eye(3), layout=MarkerLayout(left_id=2, right_id=1))
    del views[0]

    with pytest.raises(InvalidInput, match="they are swapped"):
        check_order(views, LAYOUT)


def test_another_layout_is_refused_by_what_it_leaves() -> None:
    views = seen((0.0, 0.0, 2.5), np.eye(3), layout=replace(LAYOUT, spacing_m=0.104))

    with pytest.raises(InvalidInput, match="60 mm, 100 mm apart"):
        locate_target(views, LAYOUT, WIDE)


def test_one_marker_is_not_a_target() -> None:
    views = seen((0.0, 0.0, 5.0), np.eye(3))

    with pytest.raises(InvalidInput, match="1 of its markers in the wide view, 2 are needed"):
        locate_target({1: views[1]}, LAYOUT, WIDE)


def test_two_markers_are_enough() -> None:
    views = seen((0.1, 0.0, 5.0), turned(0.0, 0.1, 0.0))
    del views[2]

    pose = locate_target(views, LAYOUT, WIDE)

    assert pose.distance_m == pytest.approx(math.hypot(0.1, 5.0), abs=5.0 * pose.distance_sigma_m)


@pytest.mark.parametrize("bad", [{"side_m": 0.0}, {"spacing_m": 0.05}, {"left_id": 2}])
def test_a_layout_that_cannot_be_is_refused(bad: dict[str, float]) -> None:
    with pytest.raises(InvalidInput, match="markers"):
        replace(LAYOUT, **bad)  # type: ignore[arg-type] # values of mixed types by name
