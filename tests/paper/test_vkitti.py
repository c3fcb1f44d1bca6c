"""Virtual KITTI 2 where a user has it: its real layout, read from a tree of two frames made here."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.study.tradeoff.study import tradeoff_study
from foveacam_pipeline.study.tradeoff.vkitti import load_vkitti, vkitti_frames

DISPARITY_PX = 20
DEPTH_CM = round(725.0087 * 0.532725 / DISPARITY_PX * 100.0)
SKY_CM = 65535


def planted(root: Path, *, merged: bool = False, frames: int = 2) -> Path:
    """Write a data set of a wall under a sky."""
    rgb_root = root if merged else root / "vkitti_2.0.3_rgb"
    depth_root = root if merged else root / "vkitti_2.0.3_depth"
    wall = np.random.default_rng(1).integers(0, 256, (375, 1242 + DISPARITY_PX, 3), dtype=np.uint8)
    wall[..., 0] = 200  # RGB: reddish
    depth = np.full((375, 1242), DEPTH_CM, dtype=np.uint16)
    depth[:100] = SKY_CM
    for camera, image in ((0, wall[:, :1242]), (1, wall[:, DISPARITY_PX:])):
        below = f"Scene01/clone/frames/{{}}/Camera_{camera}"
        rgb, z = rgb_root / below.format("rgb"), depth_root / below.format("depth")
        rgb.mkdir(parents=True)
        z.mkdir(parents=True)
        for number in range(frames):
            bgr = cv2.cvtColor(image, cv2.COLOR_RGB2BGR)
            cv2.imwrite(str(rgb / f"rgb_{number:05d}.jpg"), bgr, [cv2.IMWRITE_JPEG_QUALITY, 50])
            cv2.imwrite(str(z / f"depth_{number:05d}.png"), depth, [cv2.IMWRITE_PNG_COMPRESSION, 1])
    return root


@pytest.mark.parametrize("merged", [False, True])
def test_frames_are_found_in_either_layout(tmp_path: Path, *, merged: bool) -> None:
    frames = vkitti_frames(planted(tmp_path, merged=merged), count=9)
    assert [frame.name for frame in frames] == ["Scene01/clone 00000", "Scene01/clone 00001"]
    assert [path.parent.name for path in frames[1].images] == ["Camera_0", "Camera_1"]
    assert all(path.is_file() for frame in frames for path in (*frame.images, *frame.depths))


def test_a_frame_has_depth_in_metres_and_no_sky(tmp_path: Path) -> None:
    (frame,) = vkitti_frames(planted(tmp_path, frames=1), count=1)
    scene = load_vkitti(frame)
    assert (scene.f_px, scene.baseline_m) == (725.0087, 0.532725)
    np.testing.assert_allclose(scene.truth_z_m[200], DEPTH_CM / 100.0, rtol=1e-6)
    assert np.isnan(scene.truth_z_m[:100]).all()
    assert not scene.seen[200, : DISPARITY_PX - 1].any()  # beyond the right image's edge
    assert scene.seen[200, DISPARITY_PX + 1 :].all()
    assert scene.left[..., 0].mean() > scene.left[..., 2].mean() + 20  # RGB, not BGR


def test_a_data_set_is_told_beside_the_streets(tmp_path: Path) -> None:
    study = tradeoff_study(scenes=1, quick=True, vkitti=planted(tmp_path, frames=1))
    assert study.values["vkitti_scenes"] == 1
    coverage = study.values["vkitti_coverage_by_bin"]
    assert isinstance(coverage, list)
    assert coverage[:9] == [None] * 9  # a single wall is all in one bin
    assert sum("Virtual KITTI 2" in row.quantity for row in study.rows) == 13
    assert not any("was not given" in said for said in study.deviations)
    assert "vkitti-tradeoff-bins" in [picture.name for picture in study.pictures]


def test_few_frames_are_spread_over_all(tmp_path: Path) -> None:
    root = planted(tmp_path, frames=2)
    images = root / "vkitti_2.0.3_rgb/Scene01/clone/frames/rgb/Camera_0"
    for number in range(2, 9):
        (images / f"rgb_{number:05d}.jpg").touch()
    assert [frame.name[-1] for frame in vkitti_frames(root, count=3)] == ["0", "4", "8"]


def test_what_is_not_there_is_said_with_the_remedy(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"no Virtual KITTI 2 was found at .* unpack vkitti_2\.0\.3_rgb"):
        vkitti_frames(tmp_path / "nowhere", count=1)
    root = planted(tmp_path / "here", frames=1)
    with pytest.raises(InvalidInput, match=r"no images of the variation 'fog'; it has: clone"):
        vkitti_frames(root, count=1, variation="fog")
    with pytest.raises(InvalidInput, match="0 frames of Virtual KITTI 2"):
        vkitti_frames(root, count=0)


def test_a_frame_that_is_missing_broken_or_of_another_size_is_named(tmp_path: Path) -> None:
    (frame,) = vkitti_frames(planted(tmp_path, frames=1), count=1)
    depth = frame.depths[0]
    cv2.imwrite(str(depth), np.zeros((375, 1242), dtype=np.uint8))
    with pytest.raises(InvalidInput, match=r"depth_00000\.png is uint8 .* 16 bit and grey"):
        load_vkitti(frame)
    cv2.imwrite(str(depth), np.ones((100, 200), dtype=np.uint16))
    with pytest.raises(InvalidInput, match=r"depth_00000\.png is 200 x 100 px; .* 1242 x 375 px"):
        load_vkitti(frame)
    frame.images[1].unlink()
    with pytest.raises(InvalidInput, match=r"Camera_1/rgb_00000\.jpg is missing"):
        load_vkitti(frame)
    frame.images[0].write_bytes(b"no picture")
    with pytest.raises(InvalidInput, match=r"Camera_0/rgb_00000\.jpg cannot be read as a picture"):
        load_vkitti(frame)
