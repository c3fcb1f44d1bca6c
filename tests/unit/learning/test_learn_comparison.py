"""Every row of Table 3 from a tiny run: trained, judged, gone on with, stopped."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from tests.support.scenes.learning_pairs import stored, varied_sample

from foveacam_hardware.contract import Cancelled
from foveacam_pipeline.learn.comparison import (
    ComparisonPlan,
    compare,
    halved_sample,
    variant_answer,
)
from foveacam_pipeline.learn.losses import warped
from foveacam_pipeline.learn.network.config import SIZES
from foveacam_pipeline.learn.network.network import FoveatedStereo
from foveacam_pipeline.learn.pair_folder import PairSample
from foveacam_pipeline.learn.pairs import picture_planes
from foveacam_pipeline.study.learned.outcomes import SHIFT_PX, LearnedBudget, Method
from foveacam_pipeline.study.learned.study import learned_study

BUDGET = LearnedBudget(pairs=2, held_out=1, steps=1, prior_steps=1, batch=1, crop_px=(72, 64), seeds=1)


class Watch:
    """Cancels after some steps."""

    def __init__(self, until: int) -> None:
        self.until, self.done = until, 0

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        self.done = done

    def cancelled(self) -> bool:
        return self.done >= self.until


def plan(folder: Path) -> ComparisonPlan:
    train, held_out = (
        stored(folder / name, [varied_sample(seed + number, 272, 208) for number in range(2)])
        for name, seed in (("train", 0), ("held", 50))
    )
    return ComparisonPlan(train=train, held_out=held_out, runs=folder / "runs", budget=BUDGET)


@pytest.mark.slow
def test_the_table_comes_from_a_tiny_run_that_was_stopped_and_gone_on_with(tmp_path: Path) -> None:
    wanted = plan(tmp_path)
    with pytest.raises(Cancelled, match="goes on with the trainings"):
        compare(wanted, watch=Watch(4))
    outcome = compare(wanted)
    assert list(outcome.rows) == list(Method)
    assert all(len(rows) == 1 for rows in outcome.rows.values())
    assert outcome.rows[Method.TRUTH][0].epe_px == 0.0
    assert outcome.rows[Method.MONO_ORACLE][0].epe_px < outcome.rows[Method.ZERO][0].epe_px
    assert [len(pair.disparities_px) for pair in outcome.shown] == [len(Method)]
    assert outcome.shown[0].disparities_px[Method.UNSIGNED].min() >= 0.0
    assert outcome.shown[0].left.shape == (104, 136, 3)
    study = learned_study(outcome, quick=True)
    assert study.rows[0].quantity == "photometric error, zero disparity"
    assert "Quick: one seed" in study.deviations[-1]


@pytest.mark.slow
def test_processes_give_the_same_rows_as_one_and_stop_when_asked(tmp_path: Path) -> None:
    wanted = replace(plan(tmp_path), trained=())
    alone = compare(wanted)
    assert compare(replace(wanted, runs=tmp_path / "two"), processes=2).rows == alone.rows
    with pytest.raises(Cancelled):
        compare(replace(wanted, runs=tmp_path / "three"), processes=2, watch=Watch(0))
    assert not (tmp_path / "three" / "stop").exists()


def test_an_unsigned_network_answers_negative_disparities_by_the_shift_adapter() -> None:
    torch.manual_seed(0)
    network = FoveatedStereo(SIZES["nano"].model_copy(update={"signed": False})).eval()
    pair = varied_sample(3, 160, 96).pair
    assert variant_answer(network, pair, shifted=False).disparity_px.min() >= 0.0
    shifted_px = variant_answer(network, pair, shifted=True).disparity_px
    assert -SHIFT_PX <= shifted_px.min() < 0.0


def test_a_halved_truth_explains_the_halved_pictures() -> None:
    sample = halved_sample(varied_sample(5, 270, 206))
    assert sample.truth is not None and sample.truth.both.mean() > 0.5
    assert sample.pair.left.shape == (103, 135, 3) == (*sample.truth.both.shape, 3)
    left, right = (torch.from_numpy(picture_planes(p))[None] for p in (sample.pair.left, sample.pair.right))
    both = torch.from_numpy(sample.truth.both)[None, None]

    def off(disparity_px: np.ndarray[tuple[int, ...], np.dtype[np.float32]]) -> float:
        rebuilt, _ = warped(right, torch.from_numpy(np.nan_to_num(disparity_px))[None, None])
        return float((rebuilt - left).abs().mean(dim=1, keepdim=True)[both].mean())

    true = off(sample.truth.disparity_px)
    assert true < 0.5 * off(np.zeros_like(sample.truth.disparity_px))
    assert true < off(sample.truth.disparity_px + np.float32(0.5))
    assert true < off(sample.truth.disparity_px - np.float32(0.5))
    assert halved_sample(PairSample(pair=varied_sample(5, 270, 206).pair)).truth is None
