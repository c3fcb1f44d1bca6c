"""Training and judging by truth, where pairs have one."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import load_file
from tests.support.scenes.learning_pairs import scene, stored, varied_sample, watcher
from typer.testing import CliRunner

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.learn.checkpoint import (
    Checkpoint,
    TrainingFacts,
    load_checkpoint,
    save_checkpoint,
)
from foveacam_pipeline.learn.evaluation import Evaluation, evaluate
from foveacam_pipeline.learn.losses import LossWeights, PairBatch, matching_entropy, training_loss
from foveacam_pipeline.learn.network.config import SIZES
from foveacam_pipeline.learn.network.correlation import match_rows
from foveacam_pipeline.learn.network.network import FoveatedStereo
from foveacam_pipeline.learn.pair_folder import (
    PairSample,
)
from foveacam_pipeline.learn.pairs import CropSource, LoadedDataset, load_datasets
from foveacam_pipeline.learn.training import CHECKPOINT, TrainingPlan, train
from foveacam_pipeline.learn.truth_figures import TruthFigures
from foveacam_server.cli import app

PLAN = TrainingPlan(steps=4, batch=2, crop_px=(96, 64))


@pytest.fixture(autouse=True)
def _one_thread() -> None:
    torch.set_num_threads(1)


def judged(found: Evaluation) -> dict[str, TruthFigures]:
    return {row.method: row.truth for row in found.methods if row.truth is not None}


def test_a_folder_of_pairs_is_loaded_as_it_was_stored(tmp_path: Path) -> None:
    samples = [varied_sample(number) for number in range(3)]
    (found,) = load_datasets([stored(tmp_path / "pairs", samples)])
    assert (found.name, found.labelled, len(found.pairs), found.size) == ("pairs", True, 3, (160, 96))
    for given, read in zip(samples, found.pairs, strict=True):
        assert given.truth is not None and read.truth is not None
        assert np.array_equal(given.pair.left, read.pair.left)
        assert np.array_equal(given.truth.disparity_px, read.truth.disparity_px)
        assert np.array_equal(given.truth.occluded, read.truth.occluded)
        assert read.pair.offset_px == given.pair.offset_px
    assert found.pairs[1] is found.pairs[1]
    with pytest.raises(InvalidInput, match="has no pairs yet"):
        load_datasets([stored(tmp_path / "empty", [])])


def test_crops_keep_pictures_and_truth_together_also_mirrored() -> None:
    source = CropSource([scene("a", seed=1, labelled=True)], size=(96, 64), batch=16, seed=3)
    batch = source.batch(0)
    assert batch.disparity_px is not None and batch.known is not None and batch.labelled is not None
    assert batch.labelled.all()
    shown = (1, 2, 3)
    known = batch.known.expand(-1, 3, -1, -1)
    assert (batch.known.float().mean(dim=shown) > 0.4).all()
    columns = torch.arange(96) - batch.disparity_px.round().long()
    moved = batch.right.gather(3, columns.clamp(0, 95).expand(-1, 3, -1, -1))
    off = ((batch.left - moved).abs() * known).sum(dim=shown) / known.sum(dim=shown)
    unmoved = ((batch.left - batch.right).abs() * known).sum(dim=shown) / known.sum(dim=shown)
    assert (off < 0.7 * unmoved).all()


def test_the_matching_is_judged_by_the_true_column() -> None:
    true_px = torch.full((1, 1, 16, 64), 8.0)
    known = torch.ones_like(true_px)
    place = torch.arange(16)
    scores = torch.zeros(1, 4, 16, 16)
    scores[..., place[2:], place[:-2]] = 9.0  # two cells of four pixels
    right = matching_entropy(match_rows(scores), true_px, known)
    assert right < 0.01 < matching_entropy(match_rows(scores.transpose(2, 3)), true_px, known)


def test_pairs_without_truth_in_a_batch_are_trained_without_it() -> None:
    torch.manual_seed(0)
    network = FoveatedStereo(SIZES["nano"])
    datasets = [scene("a", seed=1, labelled=True), scene("b", seed=9)]
    step = 2  # both kinds of pairs are in it
    batch = CropSource(datasets, size=(96, 64), batch=4, seed=1).batch(step)
    assert batch.labelled is not None and batch.labelled.any() and not batch.labelled.all()
    prediction = network(batch.left, batch.right)
    loss, parts = training_loss(prediction, batch, LossWeights(), masked=False)
    torch.autograd.backward(loss)
    assert {"truth", "true matching", "true scale", "photometric"} < parts.keys()
    assert all(
        parameter.grad is None or torch.isfinite(parameter.grad).all() for parameter in network.parameters()
    )
    off = training_loss(prediction, batch, LossWeights(truth=0.0), masked=False)[1]
    assert "truth" not in off
    alone = PairBatch(left=batch.left, right=batch.right, valid_left=batch.valid_left)
    assert "truth" not in training_loss(prediction, alone, LossWeights(), masked=False)[1]


@pytest.mark.slow
def test_a_run_with_both_kinds_of_pairs_is_gone_on_with_bit_equal(tmp_path: Path) -> None:
    labelled = load_datasets([stored(tmp_path / "pairs", [varied_sample(number) for number in range(4)])])
    datasets: list[LoadedDataset] = [*labelled, scene("b", seed=9)]
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    for folder in (whole, parts):
        folder.mkdir()
    facts = train(datasets, whole, PLAN, watcher())
    train(datasets, parts, PLAN, watcher(stop_after=2))
    train(datasets, parts, PLAN, watcher())
    once, twice = load_file(whole / CHECKPOINT), load_file(parts / CHECKPOINT)
    assert all(torch.equal(once[name], twice[name]) for name in once)
    assert (whole / "curves.csv").read_text() == (parts / "curves.csv").read_text()
    assert facts.truth and {"truth", "photometric"} < facts.loss.keys()
    larger = replace(scene("c", seed=3), pairs=[PairSample(pair=varied_sample(3, 192, 128).pair)])
    with pytest.raises(InvalidInput, match="from 64 up to 160 x 96"):
        train([larger, *datasets], whole, replace(PLAN, crop_px=(168, 96)), watcher())
    with pytest.raises(InvalidInput, match="a run with other use of truth"):
        train(datasets, whole, replace(PLAN, weights=LossWeights(truth=0.0)), watcher())


@pytest.mark.slow
def test_training_by_truth_brings_the_disparity_nearer_to_it(tmp_path: Path) -> None:
    plan = replace(PLAN, steps=20)
    train([scene("a", seed=1, pairs=8, labelled=True)], tmp_path, plan, watcher())
    network = load_checkpoint(tmp_path / CHECKPOINT).network()
    dataset = scene("held out", seed=100, pairs=2, labelled=True)
    found = evaluate(network, dataset, on_pair=lambda _done, _total: None, stopped=lambda: False)
    figures = judged(found)
    assert list(figures) == ["zero", "sgbm, filled", "sgbm", "truth", "network"]
    assert (figures["truth"].epe_px, figures["truth"].bad_1) == (0.0, 0.0)
    assert figures["sgbm"].epe_px < 0.3 and figures["sgbm"].answered <= figures["sgbm, filled"].answered
    assert figures["network"].epe_px < 0.6 * figures["zero"].epe_px
    assert figures["zero"].within_1_sigma is None
    share = figures["network"].within_1_sigma
    assert share is not None and 0.3 < share < 1.0


def test_the_command_prints_errors_against_the_truth(tmp_path: Path) -> None:
    pairs = stored(tmp_path / "pairs", [varied_sample(7)])
    facts = TrainingFacts(network=SIZES["nano"], steps=0, steps_planned=1, seed=0, datasets={}, commit="")
    weights = FoveatedStereo(SIZES["nano"]).state_dict()
    path = tmp_path / CHECKPOINT
    save_checkpoint(path, Checkpoint(facts=facts, weights=weights, optimizer={}))
    told = CliRunner().invoke(app, ["learn", "evaluate", str(path), str(pairs)]).output
    assert "| EPE, px | above 1 px | answered | within 1 sigma" in told
    (truth,) = (line for line in told.splitlines() if line.strip().startswith("truth"))
    assert truth.endswith("| 0.000 | 0.000 | 1.000 | -")
