"""A directory of images as the source: a real camera's, and what can be wrong with one."""

import struct
from dataclasses import replace
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
POSE = Pose(place_m=(0.0, 0.0, 0.9), turn_rad=(0.2, 0.1, 0.0))
real = pytest.mark.skipif(not CHESSBOARD.is_dir(), reason="the real images are not part of the product")


@real
@pytest.mark.parametrize("side", SIDES)
def test_a_real_camera_is_calibrated_as_well_as_its_publisher_did(side: str) -> None:
    samples = samples_from_images(CHESSBOARD, BOARD, pattern=f"{side}*").samples
    assert len(samples) == 9
    fit = fit_wide(samples)
    assert fit.rms_px <= 0.41
    assert fit.intrinsics.fx_px == pytest.approx(536.0, abs=5.0)


@real
def test_nine_real_views_do_not_call_for_the_rational_model() -> None:
    choice = choose_model(samples_from_images(CHESSBOARD, BOARD, pattern="left*").samples)
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
    samples = samples_from_images(pictures, BOARD, pattern=f"{side}*").samples
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
    choice = choose_model(samples_from_images(pictures, BOARD, pattern=f"{side}*").samples)
    assert choice.recommended.model == "five"


def test_a_board_of_the_wrong_size_is_named(tmp_path: Path) -> None:
    _shown(tmp_path, "a.png")
    wrong = Checkerboard(columns=8, rows=6, square_m=0.025)
    with pytest.raises(InvalidInput, match=r"no checkerboard of 8 x 6.*in any of 1 images.*9 x 6"):
        samples_from_images(tmp_path, wrong)


def _shown(folder: Path, name: str) -> Path:
    path = folder / name
    cv2.imwrite(str(path), board_picture(BOARD, POSE, lens=SMALL))
    return path


def test_what_is_no_view_is_left_out_with_its_reason_and_the_rest_goes_on(tmp_path: Path) -> None:
    for name in ("a.png", "c.png"):
        _shown(tmp_path, name)
    cv2.imwrite(str(tmp_path / "b.png"), np.full((540, 720), 80, dtype=np.uint8))
    cv2.imwrite(str(tmp_path / "d.png"), board_picture(BOARD, POSE, lens=replace(SMALL, height=520)))
    (tmp_path / "e.png").write_bytes(b"")
    (tmp_path / "f.png").write_bytes(b"\x89PNG\r\n\x1a\nnot really")
    (tmp_path / "._a.png").write_bytes(b"\x00\x05\x16\x07 a companion of macOS")
    found = samples_from_images(tmp_path, BOARD)
    assert [sample.source for sample in found.samples] == [
        "a.png"
    ]  # the second shows the same and counts once
    reasons = {one.name: one.reason for one in found.left_out}
    assert "nothing like a board" in reasons["b.png"]
    assert "720 x 520 px, most are 720 x 540" in reasons["d.png"]
    assert all("cannot be read" in reasons[name] for name in ("e.png", "f.png"))
    assert set(reasons) == {"b.png", "d.png", "e.png", "f.png"}


@pytest.mark.parametrize("orientation", [3, 6, 8])
def test_pictures_are_measured_as_exposed_whatever_their_tag_says(tmp_path: Path, orientation: int) -> None:
    picture = board_picture(BOARD, POSE, lens=SMALL)
    encoded = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 98])[1].tobytes()
    (tmp_path / "plain.jpg").write_bytes(encoded)
    (tmp_path / "tagged.jpg").write_bytes(_tagged(encoded, orientation))
    turned = cv2.imread(str(tmp_path / "tagged.jpg"))
    assert turned is not None
    assert turned.shape[:2] == ((540, 720) if orientation == 3 else (720, 540))
    found = samples_from_images(tmp_path, BOARD)
    assert found.left_out == ()
    (sample,) = found.samples  # both are one and the same view
    assert (sample.view.width, sample.view.height) == (720, 540)


@pytest.mark.parametrize("bits", [10, 12, 16])
def test_the_significant_bits_of_sixteen_are_used(tmp_path: Path, bits: int) -> None:
    picture = board_picture(BOARD, POSE, lens=SMALL)
    cv2.imwrite(str(tmp_path / "narrow.png"), picture)
    cv2.imwrite(str(tmp_path / "wide.png"), picture.astype(np.uint16) << (bits - 8))
    narrow, wide = (
        next(iter(samples_from_images(tmp_path, BOARD, pattern=pattern).samples)).view.corners_px
        for pattern in ("narrow*", "wide*")
    )
    assert np.abs(narrow - wide).max() < 1e-3


def test_a_pattern_that_is_none_is_refused_with_what_to_do(tmp_path: Path) -> None:
    _shown(tmp_path, "a.png")
    with pytest.raises(InvalidInput, match=r"images by the pattern ''.*leave it out for all"):
        samples_from_images(tmp_path, BOARD, pattern="")
    with pytest.raises(InvalidInput, match=r"images by the pattern '/\*'"):
        samples_from_images(tmp_path, BOARD, pattern="/*")


def _tagged(jpeg: bytes, orientation: int) -> bytes:
    """Return a JPEG file with an EXIF segment that says how a viewer should turn it."""
    entry = struct.pack("<HHIHH", 0x0112, 3, 1, orientation, 0)
    exif = b"Exif\0\0II*\0" + struct.pack("<IH", 8, 1) + entry + struct.pack("<I", 0)
    return jpeg[:2] + b"\xff\xe1" + struct.pack(">H", len(exif) + 2) + exif + jpeg[2:]


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
