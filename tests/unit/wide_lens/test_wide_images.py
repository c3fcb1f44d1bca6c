"""A directory of images as the source: a real camera's, and what can be wrong with one."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from tests.support.scenes.board_scenes import SMALL, WEBCAM, Pose, board_picture, write_board_pictures

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.wide.boards import Checkerboard
from foveacam_pipeline.calibrate.wide.fit_wide import choose_model, fit_wide
from foveacam_pipeline.calibrate.wide.wide_images import samples_from_images

CHESSBOARD = Path(__file__).resolve().parents[4] / "shared" / "data" / "real" / "chessboard"
BOARD = Checkerboard(columns=9, rows=6, square_m=0.025)
SIDES = ("left", "right")
real = pytest.mark.skipif(not CHESSBOARD.is_dir(), reason="the real images are not part of the product")


@real
@pytest.mark.parametrize("side", SIDES)
def test_a_real_camera_is_calibrated_as_well_as_its_publisher_did(side: str) -> None:
    samples = samples_from_images(CHESSBOARD, BOARD, pattern=f"{side}*")
    assert len(samples) == 9
    fit = fit_wide(samples)
    assert fit.rms_px <= 0.41
    assert fit.intrinsics.fx_px == pytest.approx(536.0, abs=5.0)


@real
def test_nine_real_views_do_not_call_for_the_rational_model() -> None:
    choice = choose_model(samples_from_images(CHESSBOARD, BOARD, pattern="left*"))
    assert choice.recommended.model == "five"


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Nine images of the board by each of two webcams, with distortion, blur and noise."""
    folder = tmp_path_factory.mktemp("pictures")
    for seed, side in enumerate(SIDES):
        write_board_pictures(folder, BOARD, name=side, seed=seed)
    return folder


@pytest.mark.parametrize("side", SIDES)
def test_a_webcam_is_calibrated_to_its_true_lens(pictures: Path, side: str) -> None:
    samples = samples_from_images(pictures, BOARD, pattern=f"{side}*")
    assert [sample.source for sample in samples] == [f"{side}{k:02d}.png" for k in range(9)]
    fit = fit_wide(samples)
    # noise of 5 and steps of 90 grey values over 2.2 px (blur of 0.9) leave 0.02 px of a corner
    assert 0.005 < fit.rms_px < 0.05
    # 0.02 px of 54 corners in nine views, in which focal length and distances trade: 0.1 px on 536
    assert fit.intrinsics.fx_px == pytest.approx(WEBCAM.focal_px, abs=0.6)
    assert (fit.intrinsics.cx_px, fit.intrinsics.cy_px) == pytest.approx(WEBCAM.centre_px, abs=0.6)
    assert fit.intrinsics.distortion[0] == pytest.approx(WEBCAM.bend, abs=0.02)  # k1 of the series


@pytest.mark.parametrize("side", SIDES)
def test_nine_views_by_a_webcam_do_not_call_for_the_rational_model(pictures: Path, side: str) -> None:
    choice = choose_model(samples_from_images(pictures, BOARD, pattern=f"{side}*"))
    assert choice.recommended.model == "five"


def test_a_board_of_the_wrong_size_is_named(tmp_path: Path) -> None:
    _shown(tmp_path, "a.png")
    wrong = Checkerboard(columns=8, rows=6, square_m=0.025)
    with pytest.raises(InvalidInput, match=r"no checkerboard of 8 x 6.*in any of 1 images.*9 x 6"):
        samples_from_images(tmp_path, wrong)


def _shown(folder: Path, name: str) -> Path:
    path = folder / name
    picture = board_picture(BOARD, Pose(place_m=(0.0, 0.0, 0.9), turn_rad=(0.2, 0.1, 0.0)), lens=SMALL)
    cv2.imwrite(str(path), picture)
    return path


def test_an_image_without_the_board_is_left_out(tmp_path: Path) -> None:
    _shown(tmp_path, "a.png")
    cv2.imwrite(str(tmp_path / "b.png"), np.full((540, 720), 80, dtype=np.uint8))
    samples = samples_from_images(tmp_path, BOARD)
    assert [sample.source for sample in samples] == ["a.png"]


def test_images_of_different_sizes_are_refused_by_name(tmp_path: Path) -> None:
    _shown(tmp_path, "a.png")
    cv2.imwrite(str(tmp_path / "b.png"), np.full((270, 360), 80, dtype=np.uint8))
    with pytest.raises(InvalidInput, match=r"b\.png is 360 x 270 px, a\.png 720 x 540"):
        samples_from_images(tmp_path, BOARD)


@pytest.mark.parametrize("content", [b"", b"\x89PNG\r\n\x1a\nnot really"])
def test_an_unreadable_file_is_refused_by_name(tmp_path: Path, content: bytes) -> None:
    _shown(tmp_path, "a.png")
    (tmp_path / "broken.png").write_bytes(content)
    with pytest.raises(InvalidInput, match=r"broken\.png.*cannot be read as an image"):
        samples_from_images(tmp_path, BOARD)


def test_no_board_in_any_image_says_what_there_is(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "wall.png"), np.full((540, 720), 80, dtype=np.uint8))
    with pytest.raises(InvalidInput, match=r"in any of 1 images; wall\.png: nothing like a board"):
        samples_from_images(tmp_path, BOARD)


def test_a_folder_without_images_is_refused(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("none", encoding="utf-8")
    with pytest.raises(InvalidInput, match="no image matches"):
        samples_from_images(tmp_path, BOARD)
    with pytest.raises(InvalidInput, match="no such folder"):
        samples_from_images(tmp_path / "nowhere", BOARD)
