"""Markers are found with every corner where it was printed, blurred or not, and what is covered is said."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.marker_images import draw_marker, homography, true_corners

from foveacam_pipeline.calibrate.sweep.marker_code import CELLS
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerView
from foveacam_pipeline.calibrate.sweep.markers import (
    SIDE_M,
    find_markers,
    mean_view,
    middle_px,
    refind_marker,
)

WIDE_SIZE, FOVEA_SIZE = (140, 120), (1440, 1080)
WIDE_BLUR_PX, FOVEA_BLUR_PX = 0.6, 1.4  # the simulated lenses; diffraction in the fovea


def errors_px(view: MarkerView, px_from_cells: NDArray[np.float64]) -> NDArray[np.float64]:
    return view.corners_px - true_corners(px_from_cells, view.places_m * CELLS / SIDE_M)


@pytest.mark.parametrize(("side_px", "limit_px"), [(38.0, 0.02), (76.0, 0.02)])
def test_corners_in_the_wide_view_are_good_to_hundredths_of_a_pixel(side_px: float, limit_px: float) -> None:
    errors = []
    for seed in range(6):
        placed = homography(side_px, (70.3 + 0.17 * seed, 60.1 - 0.13 * seed), turn_rad=0.03 * seed - 0.1)
        image = draw_marker(seed % 3, placed, size=WIDE_SIZE, blur_px=WIDE_BLUR_PX, seed=seed)
        view = find_markers(image)[seed % 3]
        assert view.complete
        errors.append(errors_px(view, placed))

    # Noise of 2.5 levels on edges of 120 levels a pixel, 280 of them: 0.005 px; the rest is the drawing.
    assert np.sqrt(np.mean(np.concatenate(errors) ** 2)) <= limit_px


@pytest.mark.parametrize("side_px", [345.0, 690.0])
def test_corners_in_the_fovea_are_not_drawn_inwards_by_its_blur(side_px: float) -> None:
    placed = homography(side_px, (731.4, 518.8), turn_rad=0.12, keystone=2e-4)
    image = draw_marker(1, placed, size=FOVEA_SIZE, blur_px=FOVEA_BLUR_PX, finer=2)

    view = find_markers(image, large=True)[1]

    error = errors_px(view, placed)
    outward = view.corners_px[:4] - middle_px(view)
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    assert np.sqrt(np.mean(error**2)) <= 0.02
    assert abs(float(np.mean(np.sum(error[:4] * outward, axis=1)))) <= 0.02
    assert view.blur_px == pytest.approx(FOVEA_BLUR_PX, abs=0.1)
    assert len(view.corners_px) > 10


@pytest.mark.parametrize(
    ("side_px", "size", "blur_px", "large"),
    [
        (38.0, WIDE_SIZE, WIDE_BLUR_PX, False),
        (76.0, WIDE_SIZE, WIDE_BLUR_PX, False),
        (690.0, FOVEA_SIZE, FOVEA_BLUR_PX, True),
    ],
)
def test_corners_in_binned_pictures_are_places_on_the_sensor(
    side_px: float, size: tuple[int, int], blur_px: float, large: bool
) -> None:
    errors = []
    for seed in range(2 if large else 6):
        middle = (731.4, 518.8) if large else (70.3 + 0.17 * seed, 60.1 - 0.13 * seed)
        placed = homography(side_px, middle, turn_rad=0.03 * seed - 0.1)
        whole = draw_marker(seed % 3, placed, size=size, blur_px=blur_px, seed=seed)
        half = cv2.resize(whole, (size[0] // 2, size[1] // 2), interpolation=cv2.INTER_AREA)
        image = np.asarray(half, dtype=np.uint8)
        view = find_markers(image, large=large, binning=2)[seed % 3]
        again = refind_marker(image, view, binning=2)
        assert again is not None
        assert np.abs(again.corners_px - view.corners_px).max() < 0.02
        assert view.blur_px == pytest.approx(blur_px, abs=0.15)
        errors.append(errors_px(view, placed))

    # A binned pixel averages four: its noise is half as large, its edges are a third wider.
    assert np.sqrt(np.mean(np.concatenate(errors) ** 2)) <= 0.03


def test_small_markers_are_found_wherever_they_lie_on_the_pixels_of_a_binned_picture() -> None:
    for step in range(24):
        placed = homography(38.0, (70.0 + 0.37 * step, 60.0 - 0.23 * step), turn_rad=0.004 * step - 0.05)
        whole = draw_marker(step % 3, placed, size=WIDE_SIZE, blur_px=WIDE_BLUR_PX, seed=step)
        half = cv2.resize(whole, (WIDE_SIZE[0] // 2, WIDE_SIZE[1] // 2), interpolation=cv2.INTER_AREA)

        found = find_markers(np.asarray(half, dtype=np.uint8), only=(step % 3,), binning=2)

        # In cells of 3.2 px, OpenCV alone misses one in fifty or so, here number 6.
        assert list(found) == [step % 3]
        apart_px = found[step % 3].corners_px - find_markers(whole)[step % 3].corners_px
        assert np.sqrt(np.mean(apart_px**2)) <= 0.03


def test_a_marker_is_found_on_white_paper_that_hangs_on_a_dark_wall() -> None:
    for seed in range(6):
        placed = homography(76.0, (70.0, 60.0), turn_rad=0.03 * seed - 0.1)
        image = draw_marker(2, placed, size=WIDE_SIZE, blur_px=WIDE_BLUR_PX, seed=seed)

        assert list(find_markers(image)) == [2]


def test_a_covered_corner_is_left_out_and_the_others_stay_where_they_are() -> None:
    placed = homography(345.0, (700.0, 540.0))
    image = draw_marker(2, placed, size=FOVEA_SIZE, blur_px=FOVEA_BLUR_PX, finer=2)
    x, y = np.rint(true_corners(placed, np.array([[3.0, 3.0]]))[0]).astype(int).tolist()
    whole = find_markers(image, large=True)[2]
    image[y - 12 : y + 30, x - 12 : x + 30] = 190

    view = refind_marker(image, whole)

    assert view is not None
    assert not view.complete
    assert len(view.corners_px) == len(whole.corners_px) - 1
    assert np.sqrt(np.mean(errors_px(view, placed) ** 2)) <= 0.05


def test_a_marker_that_is_cut_off_is_not_found_whole() -> None:
    placed = homography(345.0, (130.0, 540.0))
    image = draw_marker(0, placed, size=FOVEA_SIZE, blur_px=FOVEA_BLUR_PX, finer=2)

    found = find_markers(image, large=True)

    assert 0 not in found or not found[0].complete


def test_a_marker_that_is_gone_is_not_found_again() -> None:
    placed = homography(38.0, (70.0, 60.0))
    known = find_markers(draw_marker(0, placed, size=WIDE_SIZE, blur_px=WIDE_BLUR_PX))[0]
    empty = np.full((120, 140), 105, dtype=np.uint8)

    assert refind_marker(empty, known) is None


def test_only_the_asked_ids_are_measured() -> None:
    placed = homography(38.0, (70.0, 60.0))
    image = draw_marker(1, placed, size=WIDE_SIZE, blur_px=WIDE_BLUR_PX)

    assert find_markers(image, only=(0, 2)) == {}


def test_the_mean_of_several_views_is_better_than_one() -> None:
    placed = homography(38.0, (70.3, 60.6), turn_rad=0.15)
    views = [
        find_markers(draw_marker(0, placed, size=WIDE_SIZE, blur_px=WIDE_BLUR_PX, noise=10.0, seed=seed))[0]
        for seed in range(16)
    ]

    mean = mean_view(views)

    one = np.sqrt(np.mean([np.mean(errors_px(view, placed) ** 2) for view in views]))
    assert np.sqrt(np.mean(errors_px(mean, placed) ** 2)) < 0.7 * one
    assert mean.sigma_px == pytest.approx(views[0].sigma_px / 4.0, rel=0.2)
    outer = np.sqrt(np.mean([np.mean(errors_px(view, placed)[:4] ** 2) for view in views]))
    assert 0.7 * outer < np.mean([view.sigma_px for view in views]) < 1.1 * outer


def test_the_mean_keeps_the_corners_that_all_views_have() -> None:
    places = np.array([[0.0, 0.0], [0.01, 0.0], [0.0, 0.01], [0.01, 0.01], [0.02, 0.0]])

    def view(kept: list[int], shift: float) -> MarkerView:
        corners = 1e3 * places[kept] + shift
        return MarkerView(
            id=0, corners_px=corners, places_m=places[kept], sharpness=1.0, complete=len(kept) == 5
        )

    mean = mean_view([view([0, 1, 2, 3, 4], 0.0), view([4, 2, 1, 0], 1.0)])

    assert mean.places_m.tolist() == places[[0, 1, 2, 4]].tolist()
    assert np.allclose(mean.corners_px, 1e3 * places[[0, 1, 2, 4]] + 0.5)
    assert not mean.complete
