"""Reading a dataset: `Dataset.open(path)[i].left`, lazily; poses and pairs by its own calibration."""

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.support.scenes.dataset_scenes import (
    CALIBRATION,
    header,
    noise_frame,
    noise_point,
    noise_texture,
    painted,
    plane_point,
    written,
)

from foveacam_hardware.contract import InvalidInput, NotCalibrated, Role
from foveacam_pipeline.capture.dataset import CapturedPoint, Dataset, DatasetWriter, PlanPosition, Shot
from foveacam_pipeline.learn.raster import PairIndex, pair_arrays, torch_dataset
from foveacam_pipeline.stereo.match import match


def test_points_can_be_counted_sliced_and_walked_through(tmp_path: Path) -> None:
    dataset = written(tmp_path / "raster", 4)
    assert len(dataset) == 4
    assert dataset[-1].index == 3
    assert [point.index for point in dataset[1:3]] == [1, 2]
    np.testing.assert_array_equal(dataset[2].wide, noise_frame(Role.WIDE, 2).image)
    assert [point.place.column for point in dataset] == [0, 1, 0, 1]
    with pytest.raises(IndexError):
        dataset[4]


def test_scans_are_told_apart(tmp_path: Path) -> None:
    with DatasetWriter.create(tmp_path / "raster", header(3)) as writer:
        for index, scan in enumerate([0, 1, 1]):
            writer.add(noise_point(index, scan=scan))
        writer.finish()
    dataset = Dataset.open(tmp_path / "raster")
    assert dataset.scans == (0, 1)
    assert [point.index for point in dataset.scan(1)] == [1, 2]
    with pytest.raises(InvalidInput, match="no scan 2"):
        dataset.scan(2)


def test_images_are_read_when_they_are_asked_for(tmp_path: Path) -> None:
    dataset = written(tmp_path / "raster", 1)
    (dataset.folder / "images" / "00000-left-b0-s0.tiff").unlink()
    assert dataset[0].right.shape == (6, 8)
    with pytest.raises(InvalidInput, match="cannot be read"):
        _ = dataset[0].left


def test_a_stack_is_averaged_to_more_bits(tmp_path: Path) -> None:
    frames = [noise_frame(Role.LEFT, 0, stack=n, bits=10) for n in range(4)]
    shots = tuple(Shot(frame=frame, stack=n) for n, frame in enumerate(frames))
    with DatasetWriter.create(tmp_path / "raster", header(1)) as writer:
        writer.add(CapturedPoint(place=PlanPosition(index=0), shots=shots))
        writer.finish()
    mean = Dataset.open(tmp_path / "raster")[0].stacked(Role.LEFT)
    assert mean.bits == 16
    wanted = np.mean([frame.image for frame in frames], axis=0) * 64.0
    assert np.abs(mean.image - wanted).max() <= 0.5


def test_poses_come_from_volts_by_the_embedded_calibration(tmp_path: Path) -> None:
    dataset = painted(tmp_path / "raster", [plane_point(0, aim_deg=(3.0, -2.0), z_m=4.0)[0]])
    assert dataset.calibration is not None
    assert dataset.calibration.id == CALIBRATION.id
    pose = dataset[0].pose
    assert pose.volts is not None
    assert (pose.left_rad, pose.right_rad) == CALIBRATION.gaze_rad(pose.volts)


def test_a_pair_rectified_on_the_fly_has_the_planes_depth(tmp_path: Path) -> None:
    point, _ = plane_point(0, aim_deg=(3.0, -2.0), z_m=4.0, texture=noise_texture())
    pair = painted(tmp_path / "raster", [point])[0].rectified(scale=0.5)
    assert pair.verged_z_m == pytest.approx(4.0, rel=2e-3)
    assert abs(float(np.nanmedian(match(pair).residual_px))) < 0.1
    item = pair_arrays(pair)
    assert item["left"].shape == (1, 540, 720)
    assert float(item["left"].max()) <= 1.0


def test_without_a_calibration_there_are_no_pairs(tmp_path: Path) -> None:
    with pytest.raises(NotCalibrated, match="has no calibration"):
        written(tmp_path / "raster", 1)[0].rectified()


def test_what_a_point_lacks_is_said_with_what_it_has(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="has no left frame of bracket 2; it has wide b0 s0"):
        written(tmp_path / "raster", 1)[0].stacked(Role.LEFT, bracket=2)


def test_pairs_of_several_datasets_are_counted_through(tmp_path: Path) -> None:
    shots = tuple(
        Shot(frame=replace(noise_frame(role, 0), seq=bracket), bracket=bracket)
        for role in (Role.LEFT, Role.RIGHT)
        for bracket in (0, 1)
    )
    with DatasetWriter.create(tmp_path / "bracketed", header(1)) as writer:
        writer.add(CapturedPoint(place=PlanPosition(index=0), shots=shots))
        writer.finish()
    index = PairIndex(
        [written(tmp_path / "a", 3), Dataset.open(tmp_path / "bracketed"), written(tmp_path / "b", 1)]
    )
    found = [(index[n].dataset, index[n].position, index[n].bracket) for n in range(len(index))]
    assert found == [(0, 0, 0), (0, 1, 0), (0, 2, 0), (1, 0, 0), (1, 0, 1), (2, 0, 0)]
    assert index[-1].dataset == 2
    with pytest.raises(IndexError, match="pair 6 was asked for, there are 6"):
        index[6]


def test_without_torch_a_sentence_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "torch", None)
    with pytest.raises(InvalidInput, match=r"needs torch.*foveacam-duo\[learn\]"):
        torch_dataset([])


def test_a_loader_of_pytorch_gets_rectified_pairs_in_batches(tmp_path: Path) -> None:
    torch = pytest.importorskip("torch", reason="the extra `learn` is not installed")
    point, _ = plane_point(0, aim_deg=(3.0, -2.0), z_m=4.0)
    folders = [painted(tmp_path / name, [point]).folder for name in ("a", "b")]

    pairs = torch_dataset(folders)
    batch = next(iter(torch.utils.data.DataLoader(pairs, batch_size=2)))

    assert isinstance(pairs, torch.utils.data.Dataset)
    assert (len(pairs), batch["dataset"].tolist(), batch["point"].tolist()) == (2, [0, 1], [0, 0])
    assert (batch["left"].shape, batch["left"].dtype) == ((2, 1, 540, 720), torch.float32)
    assert (batch["valid_right"].shape, batch["valid_right"].dtype) == ((2, 540, 720), torch.bool)
    depth_m = batch["f_px"] * batch["baseline_m"] / batch["offset_px"]
    assert depth_m.tolist() == pytest.approx([4.0, 4.0], rel=2e-3)
    wanted = pair_arrays(Dataset.open(folders[1])[0].rectified(scale=0.5))
    np.testing.assert_array_equal(batch["left"][1].numpy(), wanted["left"])
    again = pickle.loads(pickle.dumps(pairs))  # noqa: S301 - what a loader does for workers that are not forked
    assert (len(again), again[1]["f_px"]) == (2, pairs[1]["f_px"])
