"""The wide lens: a mild barrel that undoes itself."""

import numpy as np
import pytest

from foveacam_hardware.sim.optics import WIDE_HEIGHT, WIDE_WIDTH, WideLens, wide_projections

LENS = WideLens()
GRID = np.array([(x, y) for x in np.linspace(0, 1439, 13) for y in np.linspace(0, 1079, 11)])


def test_distorting_undoes_undistorting() -> None:
    assert LENS.distorted_px(LENS.undistorted_px(GRID)) == pytest.approx(GRID, abs=1e-9)


def test_the_distortion_is_a_mild_barrel() -> None:
    """An ideal pinhole would draw the corners further out, by a few pixels of 900."""
    corner = np.array([[0.0, 0.0]])
    outwards_px = -(LENS.undistorted_px(corner) - corner)[0]

    assert np.all(outwards_px > 2.0)
    assert np.linalg.norm(outwards_px) < 8.0


def test_the_centre_is_not_the_middle_of_the_sensor() -> None:
    centre = np.array([[LENS.centre_x_px, LENS.centre_y_px]])

    assert LENS.undistorted_px(centre) == pytest.approx(centre)
    assert np.linalg.norm(centre - [(WIDE_WIDTH - 1) / 2, (WIDE_HEIGHT - 1) / 2]) > 1.0


def test_the_field_of_view_is_that_of_the_paper() -> None:
    edges = LENS.undistorted_px(np.array([[-0.5, 539.5], [1439.5, 539.5], [719.5, -0.5], [719.5, 1079.5]]))
    across_deg = np.rad2deg(np.arctan((edges - [LENS.centre_x_px, LENS.centre_y_px]) / LENS.focal_px))

    assert across_deg[1, 0] - across_deg[0, 0] == pytest.approx(25.6, abs=0.3)
    assert across_deg[3, 1] - across_deg[2, 1] == pytest.approx(19.4, abs=0.3)


def test_the_table_of_the_renderer_holds_the_same_lens() -> None:
    table = wide_projections(LENS)[1].rays
    assert table is not None
    assert (table.height, table.width) == (WIDE_HEIGHT, WIDE_WIDTH)
    for x, y in ((0, 0), (100, 900), (1439, 1079)):
        pixel = np.array([x, y])
        straight = LENS.undistorted_px(pixel[None])[0]
        assert pixel + table.shift_px[y, x] == pytest.approx(straight, abs=1e-5)
