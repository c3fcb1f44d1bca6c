"""Simulated pairs with truth: the truth explains the pictures, and folders are made again bit by bit."""

import json
import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from foveacam_hardware.contract import InvalidInput, StorageFull
from foveacam_hardware.sim.scenes.materials import CheckerboardMaterial, NoiseMaterial
from foveacam_pipeline.learn import pair_folder
from foveacam_pipeline.learn.pair_folder import DOCUMENT, PairTruth, Split, StoredPairs
from foveacam_pipeline.stereo.match import match
from foveacam_pipeline.stereo.values import RectifiedPair
from foveacam_pipeline.workers.pool import HereAndNow, Part, WorkersLost, WorkPool
from foveacam_server.cli import app
from foveacam_server.resources.studying.learning import rendered_pairs as simulated
from foveacam_server.resources.studying.learning.random_scenes import draw_scene, scene_seed
from foveacam_server.resources.studying.learning.rendered_pairs import (
    MadePairs,
    PairOrder,
    make_pair,
    make_pairs,
)

T = TypeVar("T")
SIZE = (360, 270)
SEED = 1


def order(folder: Path, *, count: int = 2) -> PairOrder:
    return PairOrder(folder=folder, count=count, seed=SEED, split=Split.TRAIN, size=SIZE)


def made(
    wanted: PairOrder,
    *,
    pool: WorkPool | None = None,
    on_pair: Callable[[int], None] = lambda _done: None,
    stopped: Callable[[], bool] = lambda: False,
) -> MadePairs:
    def count(done: int, _total: int, _rate: float) -> None:
        on_pair(done)

    return make_pairs(wanted, pool or HereAndNow(), on_pair=count, stopped=stopped)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("pairs") / "train"
    made(order(path, count=3))
    return path


def labelled(folder: Path) -> Iterator[tuple[RectifiedPair, PairTruth]]:
    for sample in StoredPairs(folder):
        assert sample.truth is not None
        yield sample.pair, sample.truth


@pytest.mark.slow
def test_the_right_picture_warped_by_the_truth_is_the_left_one(folder: Path) -> None:
    for pair, truth in labelled(folder):
        rows, columns = np.indices(truth.both.shape)
        x = np.asarray(columns - np.nan_to_num(truth.disparity_px), dtype=np.float32)
        y = np.asarray(rows, dtype=np.float32)
        warped = np.asarray(cv2.remap(pair.right, x, y, cv2.INTER_LINEAR), dtype=np.float64)
        left = pair.left.astype(np.float64)
        seen = truth.both
        fitted = np.polyval(np.polyfit(warped[seen].ravel(), left[seen].ravel(), 1), warped)
        off, unwarped = (np.median(np.abs(left - other)[seen]) for other in (fitted, pair.right))
        assert off < 2.0 and off < 0.6 * unwarped  # grey levels: noise, and rows that differ by 0.3 px


@pytest.mark.slow
def test_semi_global_matching_finds_the_truth(folder: Path) -> None:
    errors_px = []
    for pair, truth in labelled(folder):
        found = match(pair).residual_px
        known = truth.both & np.isfinite(found)
        errors_px.append(np.median(np.abs(found - truth.disparity_px)[known]))
    assert max(errors_px) < 0.4


@pytest.mark.slow
def test_masks_divide_what_the_left_eye_sees(folder: Path) -> None:
    for _pair, truth in labelled(folder):
        seen = np.isfinite(truth.disparity_px)
        assert not (truth.both & truth.occluded).any()
        assert np.array_equal(truth.both | truth.occluded, seen)
        assert truth.both.mean() > 0.3 and truth.occluded.mean() > 0.005
        assert np.nanmin(truth.disparity_px) < 0.0 < np.nanmax(truth.disparity_px)


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bytes_also_after_a_stop(folder: Path, tmp_path: Path) -> None:
    done = [0]

    def count(number: int) -> None:
        done[0] = number

    first = made(order(tmp_path / "a", count=3), on_pair=count, stopped=lambda: done[0] >= 1)
    assert (first.made, len(StoredPairs(tmp_path / "a"))) == (1, 1)
    again = made(order(tmp_path / "a", count=3))
    assert (again.made, len(again.document.pairs)) == (2, 3)
    for path in folder.iterdir():
        assert (tmp_path / "a" / path.name).read_bytes() == path.read_bytes()


def test_another_seed_is_refused_in_a_folder_that_goes_on(folder: Path) -> None:
    with pytest.raises(InvalidInput, match="holds pairs with other seed"):
        made(replace(order(folder), seed=SEED + 1))
    with pytest.raises(InvalidInput, match="sizes 360x270, 720x540, 1440x1080"):
        made(replace(order(folder), size=(300, 200)))


def test_scenes_and_textures_of_both_splits_are_disjoint() -> None:
    seeds = {split: {scene_seed(SEED, split, index) for index in range(50)} for split in Split}
    assert not seeds[Split.TRAIN] & seeds[Split.HELD_OUT]
    scenes = {split: [draw_scene(seed) for seed in sorted(seeds[split])[:20]] for split in Split}
    materials = {
        split: [given for scene in found for given in scene.file.materials.values()]
        for split, found in scenes.items()
    }
    stretches = {
        split: [given.stretch for given in found if isinstance(given, NoiseMaterial)]
        for split, found in materials.items()
    }
    assert max(stretches[Split.TRAIN]) < min(stretches[Split.HELD_OUT])
    assert any(isinstance(given, CheckerboardMaterial) for given in materials[Split.TRAIN])
    assert not any(isinstance(given, CheckerboardMaterial) for given in materials[Split.HELD_OUT])


@pytest.mark.slow
def test_a_full_disk_leaves_what_was_there(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)

    def full(*_arguments: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(pair_folder, "write_file", full)
        with pytest.raises(StorageFull, match="the same command goes on"):
            made(order(tmp_path, count=4))
    assert len(list(StoredPairs(tmp_path))) == 3


@pytest.mark.slow
def test_workers_that_are_lost_leave_what_was_made(tmp_path: Path) -> None:
    class OnePart(HereAndNow):
        def result(self, part: Part[T]) -> T:
            if self.answered:
                raise WorkersLost("the scheduler is gone", remedy="start it again")
            self.answered = True
            return part.result()

        answered = False

    with pytest.raises(WorkersLost, match="the scheduler is gone; 1 pairs are kept; start it again"):
        made(order(tmp_path), pool=OnePart())
    assert len(list(StoredPairs(tmp_path))) == 1


@pytest.mark.slow
def test_a_damaged_pair_is_refused(folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    document = json.loads((tmp_path / DOCUMENT).read_text())
    document["pairs"][0]["sha256"] = "0" * 64
    (tmp_path / DOCUMENT).write_text(json.dumps(document))
    with pytest.raises(InvalidInput, match="differs from its hash"):
        StoredPairs(tmp_path)[0]
    (tmp_path / "pairs-00000.npz").write_bytes(b"no shard")
    with pytest.raises(InvalidInput, match="the shard cannot be read"):
        StoredPairs(tmp_path)[0]


@pytest.mark.slow
@pytest.mark.usefixtures("without_benches")
def test_the_command_says_how_many_pairs_a_second_it_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    once = make_pair(SEED, Split.HELD_OUT, 0, SIZE)
    monkeypatch.setattr(simulated, "make_pair", lambda *_arguments: once)
    arguments = ["--out", str(tmp_path), "--count", "3", "--seed", str(SEED), "--split", "held-out"]
    result = CliRunner().invoke(app, ["learn", "pairs", *arguments])
    assert "3 of 3 pairs, " in result.output and "pairs/s" in result.output
    with pytest.raises(InvalidInput, match="one of train, held-out"):
        CliRunner().invoke(
            app, ["learn", "pairs", *arguments[:-1], "x"], standalone_mode=False, catch_exceptions=False
        )
