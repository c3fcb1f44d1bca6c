"""What overlapping views of one eye tell of depth: enough to lay both alike, on either side of a jump."""

import math
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.mosaic_scenes import SIDE, STEP_DEG, Z_M, painted, scan, small_calibration, texture

from foveacam_hardware.contract import Role
from foveacam_pipeline.capture.mosaic.build import chart_of
from foveacam_pipeline.capture.mosaic.chart import Chart, chart_around
from foveacam_pipeline.capture.mosaic.correspondences import match_overlap, overlap_points
from foveacam_pipeline.capture.mosaic.fuse import fuse
from foveacam_pipeline.capture.mosaic.look import EyeLook
from foveacam_pipeline.capture.mosaic.parallax import add_overlap_depth, overlap_cells, overlap_strip
from foveacam_pipeline.capture.mosaic.values import MosaicSettings
from foveacam_pipeline.capture.mosaic.views import ViewPictureCache, mosaic_views

NEAR_M, EDGE_TEXELS = 1.5, 301
"""The card begins in the middle of the overlap, and jumps there by 5 px against the plane."""
Picture = NDArray[np.uint8]


def test_overlaps_lie_as_both_views_tell(tmp_path: Path) -> None:
    calibration, settings = small_calibration(), MosaicSettings()
    views = mosaic_views(scan(tmp_path / "raster"), calibration, settings)
    chart = chart_of(views, calibration)
    steps = list(add_overlap_depth(fuse(chart, []), views, ViewPictureCache(settings), chart=chart))
    assert [done for done, _ in steps] == [1, 2, 3, 4]
    found = steps[-1][1]
    assert np.isnan(found.per_depth).all()  # it is for laying alone: no depth in the files
    told = found.provisional[np.isfinite(found.provisional)]
    assert told.size > 0.3 * found.provisional.size
    strip = overlap_strip(views[0].look, views[1].look, (_half(texture()[:360, :480]),) * 2)
    assert strip is not None
    seams_px = np.abs(told - 1.0 / Z_M) * 2.0 * strip.pair.f_px
    assert np.median(seams_px) < 0.15
    assert np.percentile(seams_px, 95) < 0.5
    assert abs(np.median(told - 1.0 / Z_M)) * 2.0 * strip.pair.f_px < 0.05  # no side is favoured


def test_a_point_whose_depth_is_not_measured_moves_no_view(tmp_path: Path) -> None:
    calibration, settings = small_calibration(), MosaicSettings()
    views = mosaic_views(scan(tmp_path / "raster"), calibration, settings)
    chart, pictures = chart_of(views, calibration), ViewPictureCache(settings)
    unknown = np.full((chart.rows, chart.columns), np.nan, dtype=np.float32)
    laid = replace(fuse(chart, []), filled=np.full_like(unknown, 1.0 / Z_M))
    measured = replace(laid, per_depth=laid.filled)
    place = next(place for place in overlap_points(views, chart) if not place.held_out)
    links = [match_overlap(place, views, pictures, chart=chart, depth=depth) for depth in (laid, measured)]
    assert [link is not None and link.held_out for link in links] == [True, False]


def card_before_the_plane(look_deg: float) -> tuple[EyeLook, Picture]:
    """Return a look, and what it sees: a card that hides the plane's right half."""
    calibration = small_calibration()
    volts = calibration.steer(math.radians(look_deg), 0.0, distance_m=4.0)
    columns = np.broadcast_to(np.arange(SIDE) >= EDGE_TEXELS, (SIDE, SIDE))
    card = painted(np.where(columns, 255, 0).astype(np.uint8), Role.LEFT, volts, z_m=NEAR_M) > 127
    near = painted(np.ascontiguousarray(texture()[::-1]), Role.LEFT, volts, z_m=NEAR_M)
    image = np.where(card, near, painted(texture(), Role.LEFT, volts, z_m=Z_M))
    return EyeLook.of(calibration, Role.LEFT, volts.left), np.asarray(image, dtype=np.uint8)


@pytest.fixture(scope="module")
def told() -> tuple[Chart, NDArray[np.float32]]:
    """What two neighbours tell of the card and the plane: q on a chart."""
    seen = [card_before_the_plane(side * STEP_DEG / 2) for side in (-1.0, 1.0)]
    looks, halves = (seen[0][0], seen[1][0]), (_half(seen[0][1]), _half(seen[1][1]))
    corners = np.concatenate([look.corners(small_calibration(), 0.0) for look in looks])
    chart = chart_around(corners, f_px=small_calibration().fovea_f_px)
    cells = overlap_cells(looks, halves, chart)
    assert cells is not None
    whole = np.full((chart.rows, chart.columns), np.nan, dtype=np.float32)
    whole[cells.rows, cells.columns] = cells.per_depth
    return chart, whole


def test_beside_a_jump_every_cell_is_laid_on_its_own_side(told: tuple[Chart, NDArray[np.float32]]) -> None:
    chart, per_depth = told
    calibration = small_calibration()
    x_m = (EDGE_TEXELS - SIDE / 2) * NEAR_M / calibration.fovea_f_px
    edge_px = calibration.fovea_f_px * (x_m - calibration.reference_rig_m(Role.LEFT)[0]) / NEAR_M
    column = int((edge_px - chart.u0_px) // 8)
    far, near = per_depth[8:-8, column - 6 : column - 1], per_depth[8:-8, column + 2 : column + 7]
    assert np.isfinite(far).mean() > 0.7
    assert np.isfinite(near).mean() > 0.7
    assert np.nanmedian(far) == pytest.approx(1.0 / Z_M, abs=0.015)
    assert np.nanmedian(near) == pytest.approx(1.0 / NEAR_M, abs=0.015)
    middle = (1.0 / Z_M + 1.0 / NEAR_M) / 2
    assert np.nanmean(far > middle) < 0.1
    assert np.nanmean(near < middle) < 0.1


def test_views_that_hardly_move_apart_tell_nothing() -> None:
    look, picture = card_before_the_plane(0.2)
    assert overlap_strip(look, look, (_half(picture), _half(picture))) is None


def _half(picture: Picture) -> Picture:
    size = picture.shape[1] // 2, picture.shape[0] // 2
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
