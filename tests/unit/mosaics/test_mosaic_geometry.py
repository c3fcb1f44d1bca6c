"""Where a mosaic lays things: exact parallax, tiles, registration, the adjustment, fused depth."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.dataset_scenes import CALIBRATION

from foveacam_hardware.contract import InvalidInput, MirrorVolts, Role, StereoVolts
from foveacam_pipeline.capture.mosaic.adjust import adjust_views
from foveacam_pipeline.capture.mosaic.chart import Chart, chart_around
from foveacam_pipeline.capture.mosaic.correspondences import ViewCorrespondence
from foveacam_pipeline.capture.mosaic.fuse import fill_gaps, fuse
from foveacam_pipeline.capture.mosaic.look import EyeLook
from foveacam_pipeline.capture.mosaic.pair_depth import CellDepth, DepthPixels, gather_cells
from foveacam_pipeline.capture.mosaic.pyramid import TilePyramid, halve, paint_tiles
from foveacam_pipeline.capture.mosaic.register import register
from foveacam_pipeline.geometry.plane_window import homography_apply
from foveacam_pipeline.stereo.rectify import plane_from_raw

VOLTS = StereoVolts(left=MirrorVolts(x_v=90.0, y_v=-60.0), right=MirrorVolts(x_v=70.0, y_v=-60.0))
RAW = np.array([[10.0, 20.0], [719.5, 539.5], [1400.0, 900.0]])
CHART = Chart(u0_px=0, v0_px=0, width=400, height=400, f_px=1000.0)


@pytest.mark.parametrize("role", [Role.LEFT, Role.RIGHT])
@pytest.mark.parametrize("z_m", [1.5, 7.0, np.inf])
def test_a_look_is_the_calibrated_homography_at_every_depth_and_back(role: Role, z_m: float) -> None:
    eye = CALIBRATION.eye(role)
    moved = replace(CALIBRATION, left=replace(eye, pivot_offset_m=(1e-3, -2e-3, 3e-3)), right=eye)
    look = EyeLook.of(moved, Role.LEFT, VOLTS.left)
    expected = homography_apply(plane_from_raw(moved, Role.LEFT, VOLTS, depth_m=z_m), RAW)
    np.testing.assert_allclose(look.plane(RAW, 1.0 / z_m), expected, atol=1e-6)
    adjusted_look = look.with_adjustment(np.array([3.0, -1.0]), np.array([[1.0, 2e-3], [-2e-3, 1.001]]))
    plane = adjusted_look.plane(RAW, 1.0 / z_m)
    x, y = adjusted_look.raw(plane[:, 0], plane[:, 1], np.full(3, 1.0 / z_m))
    np.testing.assert_allclose(np.column_stack([x, y]), RAW, atol=1e-6)


def test_a_chart_holds_its_corners_in_whole_cells_and_refuses_wild_poses() -> None:
    chart = chart_around(np.array([[-13.5, 4.0], [30.0, 90.0]]), f_px=1000.0)
    assert (chart.u0_px, chart.v0_px, chart.columns, chart.rows) == (-16, 0, 6, 12)
    with pytest.raises(InvalidInput, match="volts or its calibration"):
        chart_around(np.array([[0.0, 0.0], [1e6, 10.0]]), f_px=1000.0)


def picture(height: int, width: int) -> NDArray[np.uint8]:
    y, x = np.mgrid[:height, :width]
    return np.asarray((x // 7 + y // 5) % 200, dtype=np.uint8)


def test_deep_zoom_tiles_make_the_picture_at_every_level(tmp_path: Path) -> None:
    whole = picture(600, 1101)
    pyramid = TilePyramid(folder=tmp_path, width=1101, height=600, quality=100)
    painted: list[int] = []
    paint_tiles(pyramid, lambda x, y, w, h: whole[y : y + h, x : x + w], painted.append)
    assert sum(painted) == pyramid.leaves == 6
    assert pyramid.size(0) == (1, 1)
    assert np.abs(pyramid.read_level(pyramid.top).astype(int) - whole).max() <= 8
    smaller = pyramid.read_level(pyramid.top - 1)
    assert smaller.shape == (300, 551)
    assert np.abs(smaller.astype(int) - halve(whole)).mean() < 1.0


def test_tiles_that_are_there_are_not_painted_again_and_torn_ones_are(tmp_path: Path) -> None:
    whole = picture(520, 1030)
    pyramid = TilePyramid(folder=tmp_path, width=1030, height=520, quality=90)
    paint_tiles(pyramid, lambda x, y, w, h: whole[y : y + h, x : x + w], lambda count: None)
    content = {path: path.read_bytes() for path in tmp_path.rglob("*.jpg")}
    for level in range(pyramid.top):
        for path in (tmp_path / "mosaic_files" / str(level)).glob("*.jpg"):
            path.unlink()
    pyramid.path(pyramid.top, 1, 0).write_bytes(b"")
    again: list[tuple[int, int]] = []

    def paint(x: int, y: int, width: int, height: int) -> NDArray[np.uint8]:
        again.append((x, y))
        return whole[y : y + height, x : x + width]

    paint_tiles(pyramid, paint, lambda count: None)
    assert again == [(512, 0)]
    assert pyramid.path(pyramid.top, 1, 0).read_bytes() == content[pyramid.path(pyramid.top, 1, 0)]


def grain(seed: int) -> NDArray[np.float32]:
    noise = np.random.default_rng(seed).standard_normal((200, 200)).astype(np.float32)
    return np.asarray(128.0 + 150.0 * cv2.GaussianBlur(noise, (0, 0), 2.0), dtype=np.float32)


@pytest.mark.parametrize("shift", [(0.3, -0.45), (6.2, 3.7)])
def test_a_shift_is_found_within_its_error(shift: tuple[float, float]) -> None:
    texture = grain(1)
    away = np.array([[1.0, 0.0, -shift[0]], [0.0, 1.0, -shift[1]]])
    moved = cv2.warpAffine(texture, away, (200, 200), flags=cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP)
    found = register(texture[50:146, 50:146], np.asarray(moved, dtype=np.float32)[50:146, 50:146])
    assert found is not None
    assert np.abs(found.shift_px - shift).max() < 4.0 * np.sqrt(np.diag(found.covariance).max())
    assert np.abs(found.shift_px - shift).max() < 0.1


def test_other_things_and_bare_walls_are_not_registered() -> None:
    noise = np.random.default_rng(2).normal(100.0, 1.0, (96, 96)).astype(np.float32)
    assert register(grain(1)[:96, :96], grain(9)[:96, :96]) is None
    assert register(noise, noise[::-1].copy()) is None


def chain(
    offset_px: list[tuple[float, float]], *, noise_px: float, seed: int = 5
) -> list[ViewCorrespondence]:
    """Return links of views in a row, each `offset_px` of its neighbour, half of them held out."""
    rng = np.random.default_rng(seed)
    return [
        ViewCorrespondence(
            first=k,
            second=k + 1,
            place_px=(0.0, 0.0),
            offset_px=np.array(apart) + rng.normal(0.0, noise_px, 2),
            covariance=0.05**2 * np.eye(2),
            relative_px=np.array([[500.0, y], [-500.0, y]]),
            brightness=0.02 if k == 0 else 0.0,
            held_out=count % 2 == 1,
        )
        for k, apart in enumerate(offset_px)
        for count, y in enumerate(range(-300, 301, 60))
    ]


def test_shifts_larger_than_their_error_are_spread_over_the_views() -> None:
    links = chain([(0.0, 2.0), (1.5, 0.0), (0.0, -2.5)], noise_px=0.05)
    found = adjust_views(4, links, rejected=0)
    assert found.figures.adjusted
    assert found.figures.before_rms_px > 1.9
    assert found.figures.after_rms_px < 0.12
    assert found.gains[0] / found.gains[1] == pytest.approx(np.exp(0.02), rel=5e-3)


def test_noise_of_the_measurement_moves_nothing() -> None:
    found = adjust_views(4, chain([(0.0, 0.0)] * 3, noise_px=0.05), rejected=0)
    assert not found.figures.adjusted
    assert np.all(found.shifts_px == 0.0)
    assert found.figures.after_rms_px == found.figures.before_rms_px


def test_shifts_that_the_points_held_out_contradict_are_not_applied() -> None:
    links = chain([(0.0, 2.0), (1.5, 0.0), (0.0, -2.5)], noise_px=0.05)
    links = [replace(link, offset_px=np.zeros(2)) if link.held_out else link for link in links]
    found = adjust_views(4, links, rejected=0)
    assert not found.figures.adjusted
    assert np.all(found.shifts_px == 0.0)


def test_neighbouring_pixels_share_their_error() -> None:
    u_px, v_px = (each.ravel().astype(np.float64) for each in np.meshgrid(np.arange(8), np.arange(8)))
    pixels = DepthPixels(
        u_px=u_px,
        v_px=v_px,
        per_depth=np.full(64, 0.2),
        sigma=np.full(64, 2e-4),
        edge=np.zeros(64, dtype=np.bool_),
    )
    found = gather_cells(CHART, pixels, pose_sigma=1e-4)
    assert found.per_depth.shape == (1, 1)
    assert found.sigma[0, 0] == pytest.approx(2e-4, rel=1e-5)


def patch(value: float, *, row: int = 0, pose_sigma: float = 1e-4) -> CellDepth:
    cells = np.full((30, 50), value, dtype=np.float32)
    return CellDepth(
        row=row,
        column=0,
        per_depth=cells,
        sigma=np.full_like(cells, 2e-4),
        edge=np.full_like(cells, np.nan),
        pose_sigma=pose_sigma,
    )


def test_pairs_that_agree_are_averaged_and_one_that_contradicts_is_left_out() -> None:
    found = fuse(CHART, [patch(0.2000), patch(0.2002), patch(0.31)])
    assert found.per_depth[10, 10] == pytest.approx(0.2001, abs=1e-6)
    assert found.sigma[10, 10] == pytest.approx(np.sqrt(2e-4**2 / 2 + 1e-4**2), rel=1e-3)
    assert found.figures.outliers == pytest.approx(1 / 3)
    assert found.figures.known == pytest.approx(0.6)


def test_two_pairs_that_contradict_each_other_tell_nothing() -> None:
    found = fuse(CHART, [patch(0.2), patch(0.31)])
    assert not np.isfinite(found.per_depth).any()


def test_gaps_take_the_nearest_depth_and_specks_go() -> None:
    lone = patch(0.5, row=40)
    lone.per_depth[:] = np.nan
    lone.per_depth[2:6, 2:6] = 0.5
    found = fuse(CHART, [patch(0.2), lone])
    assert np.isnan(found.per_depth[43, 3])
    assert found.filled[43, 3] == pytest.approx(0.2)
    assert not fill_gaps(np.full((3, 3), np.nan, dtype=np.float32)).any()
