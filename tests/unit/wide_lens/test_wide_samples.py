"""Views of a board in a session's folder."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from tests.support.scenes.board_scenes import SMALL, board_samples, board_view, many_poses

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.wide.boards import Charuco, Checkerboard
from foveacam_pipeline.calibrate.wide.wide_samples import WideSample, WideSamples, thumbnail, views_path

BOARD = Charuco()


def _samples(count: int = 3) -> WideSamples:
    samples = WideSamples(BOARD)
    for k, pose in enumerate(many_poses(count, np.random.default_rng(1))):
        view = board_view(BOARD, pose)
        picture = np.full((view.height, view.width, 3), 90, dtype=np.uint8)
        samples.add(
            WideSample(view=view, thumbnail_jpeg=thumbnail(picture, view), frames=k + 1, source=f"{k}.png")
        )
    return samples


def test_views_survive_a_folder_bit_for_bit(tmp_path: Path) -> None:
    samples = _samples()
    samples.save(tmp_path)
    loaded = WideSamples.load(tmp_path)
    assert loaded.board == BOARD
    assert loaded.size == (1440, 1080)
    for mine, theirs in zip(samples, loaded, strict=True):
        assert (mine.id, mine.frames, mine.source) == (theirs.id, theirs.frames, theirs.source)
        np.testing.assert_array_equal(mine.view.corners_px, theirs.view.corners_px)
        np.testing.assert_array_equal(mine.view.ids, theirs.view.ids)
        assert mine.thumbnail_jpeg == theirs.thumbnail_jpeg


def test_thumbnails_lie_beside_as_jpeg_named_by_their_view(tmp_path: Path) -> None:
    samples = _samples()
    samples.save(tmp_path)
    assert len(list((tmp_path / "wide").glob("*.jpg"))) == len(list(samples)) == 3
    for sample in samples:
        picture = cv2.imread(str(tmp_path / "wide" / f"{sample.id}.jpg"))
        assert picture is not None
        assert picture.shape == (240, 320, 3)


def test_a_view_that_was_removed_is_gone_from_the_folder_too(tmp_path: Path) -> None:
    samples = _samples()
    samples.save(tmp_path)
    gone = next(iter(samples)).id
    samples.remove(gone)
    samples.save(tmp_path)
    assert [s.id for s in WideSamples.load(tmp_path)] == [s.id for s in samples]
    assert not (tmp_path / "wide" / f"{gone}.jpg").exists()
    with pytest.raises(InvalidInput, match=gone):
        samples.remove(gone)


def test_the_same_view_counts_once() -> None:
    samples = _samples(1)
    samples.add(next(iter(samples)))
    assert len(samples) == 1


def test_a_view_of_another_board_is_refused() -> None:
    pose = many_poses(1, np.random.default_rng(2))[0]
    with pytest.raises(InvalidInput, match=r"squares 36 mm, markers 27 mm.*checkerboard.*squares 36 mm"):
        _samples().add(WideSample(view=board_view(Checkerboard(), pose), thumbnail_jpeg=b""))


def test_a_view_of_another_size_is_refused() -> None:
    pose = many_poses(1, np.random.default_rng(2))[0]
    with pytest.raises(InvalidInput, match=r"1440 x 1080 px, odd.png is 720 x 540 px"):
        _samples().add(
            WideSample(view=board_view(BOARD, pose, lens=SMALL), thumbnail_jpeg=b"", source="odd.png")
        )


def test_another_boards_views_are_not_overwritten(tmp_path: Path) -> None:
    _samples().save(tmp_path)
    before = (views_path(tmp_path)).read_bytes()
    other = board_samples(Charuco(square_m=0.04, marker_m=0.03), many_poses(2, np.random.default_rng(3)))
    with pytest.raises(InvalidInput, match="nothing was overwritten"):
        other.save(tmp_path)
    assert (views_path(tmp_path)).read_bytes() == before


def test_a_truncated_file_is_refused_and_left_alone(tmp_path: Path) -> None:
    samples = _samples()
    samples.save(tmp_path)
    path = views_path(tmp_path)
    path.write_bytes(path.read_bytes()[:-200])
    cut = path.read_bytes()
    with pytest.raises(InvalidInput, match=r"wide\.json cannot be read"):
        WideSamples.load(tmp_path)
    with pytest.raises(InvalidInput, match=r"wide\.json cannot be read"):
        samples.save(tmp_path)
    assert path.read_bytes() == cut


def test_a_file_whose_corners_are_not_on_its_board_is_refused(tmp_path: Path) -> None:
    _samples().save(tmp_path)
    path = views_path(tmp_path)
    document = json.loads(path.read_text(encoding="utf-8"))
    document["samples"][0]["ids"][-1] = 54
    path.write_text(json.dumps(document), encoding="utf-8")
    with pytest.raises(InvalidInput, match="on a board of 54"):
        WideSamples.load(tmp_path)


def test_a_folder_without_views_says_so(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="take views of a board first"):
        WideSamples.load(tmp_path)
