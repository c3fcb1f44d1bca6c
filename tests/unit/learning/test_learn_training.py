"""Training: it learns, is resumed bit-equal, keeps its checkpoint, and exports what a backend runs."""

import pickle
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import onnx
import pytest
import torch
from safetensors.torch import load_file, save_file
from tests.support.scenes.learning_pairs import scene, varied_pair

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.learn import training
from foveacam_pipeline.learn.checkpoint import (
    Checkpoint,
    TrainingFacts,
    load_checkpoint,
    load_starting_weights,
    save_checkpoint,
)
from foveacam_pipeline.learn.evaluation import evaluate, network_answer
from foveacam_pipeline.learn.export import NormByRows, export_network, network_of_graph
from foveacam_pipeline.learn.loading import LARGEST_WORKERS, default_workers, step_batches
from foveacam_pipeline.learn.network.config import SIZES
from foveacam_pipeline.learn.network.network import FoveatedStereo
from foveacam_pipeline.learn.pairs import CropSource, load_datasets
from foveacam_pipeline.learn.training import CHECKPOINT, TrainingPlan, TrainingWatcher, learning_rate, train
from foveacam_pipeline.learn.truth_figures import filled
from foveacam_pipeline.networks.card import load_network
from foveacam_pipeline.networks.estimator import NetworkEstimator

pytestmark = pytest.mark.slow

PLAN = TrainingPlan(steps=4, batch=1, crop_px=(96, 64))


def watcher(
    *, stop_after: int | None = None, on_loss: Callable[[float], None] = lambda _loss: None
) -> TrainingWatcher:
    done = [0]

    def count(step: int, _steps: int, loss: float) -> None:
        done[0] = step
        on_loss(loss)

    return TrainingWatcher(on_step=count, stopped=lambda: stop_after is not None and done[0] >= stop_after)


@pytest.fixture(autouse=True)
def _one_thread() -> None:
    torch.set_num_threads(1)


def test_a_run_that_is_stopped_and_gone_on_with_ends_with_the_same_weights(tmp_path: Path) -> None:
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    for folder in (whole, parts):
        folder.mkdir()
    train([scene("a", seed=1)], whole, PLAN, watcher())
    facts = train([scene("a", seed=1)], parts, PLAN, watcher(stop_after=2))
    assert (facts.steps, facts.steps_planned) == (2, 4)
    train([scene("a", seed=1)], parts, PLAN, watcher())
    once, twice = load_file(whole / CHECKPOINT), load_file(parts / CHECKPOINT)
    assert once.keys() == twice.keys()
    assert all(torch.equal(once[name], twice[name]) for name in once)
    assert (whole / "curves.csv").read_text() == (parts / "curves.csv").read_text()
    assert (whole / "curves.png").stat().st_size > 5_000


def test_training_without_truth_brings_the_disparity_nearer_to_it(tmp_path: Path) -> None:
    plan = replace(PLAN, steps=20, batch=2)
    train([scene("a", seed=1, pairs=8)], tmp_path, plan, watcher())
    network = load_checkpoint(tmp_path / CHECKPOINT).network()
    dataset = scene("held out", seed=100, labelled=True)
    found = evaluate(network, dataset, on_pair=lambda _done, _total: None, stopped=lambda: False)
    errors = {row.method: row for row in found.methods}
    assert found.pairs == 4
    assert errors["network"].photometric < 0.8 * errors["zero"].photometric
    trained, zero = errors["network"].truth, errors["zero"].truth
    assert trained is not None and zero is not None
    assert trained.epe_px < 0.6 * zero.epe_px


def test_crops_depend_on_seed_and_step_alone() -> None:
    source = CropSource([scene("a", seed=1)], size=(96, 64), batch=2, seed=5)
    again = CropSource([scene("a", seed=1)], size=(96, 64), batch=2, seed=5)
    source.batch(0)
    assert torch.equal(source.batch(7).left, again.batch(7).left)
    assert not torch.equal(source.batch(7).left, source.batch(8).left)
    assert source.batch(0).left.shape == (2, 3, 64, 96)


def test_crops_that_worker_processes_make_are_the_same() -> None:
    source = CropSource([scene("a", seed=1)], size=(96, 64), batch=2, seed=5)
    steps = range(3, 8)
    for workers in (0, 2):
        found = list(step_batches(source, steps, workers=workers, device=torch.device("cpu")))
        assert len(found) == len(steps)
        for step, batch in zip(steps, found, strict=True):
            assert torch.equal(batch.left, source.batch(step).left)


def test_a_processor_makes_its_crops_itself_and_a_gpu_has_them_made() -> None:
    assert default_workers(torch.device("cpu")) == 0
    assert 1 <= default_workers(torch.device("cuda")) <= LARGEST_WORKERS


def test_a_folder_with_another_run_is_refused(tmp_path: Path) -> None:
    train([scene("a", seed=1)], tmp_path, PLAN, watcher(stop_after=1))
    for plan, dataset, what in (
        (replace(PLAN, seed=1), scene("a", seed=1), "seed"),
        (replace(PLAN, steps=5), scene("a", seed=1), "steps"),
        (PLAN, scene("b", seed=1), "datasets"),
    ):
        with pytest.raises(InvalidInput, match=f"a run with other {what}"):
            train([dataset], tmp_path, plan, watcher())
    with pytest.raises(InvalidInput, match="multiples of 8"):
        train([scene("a", seed=1)], tmp_path, replace(PLAN, crop_px=(100, 64)), watcher())


def test_a_training_begins_with_the_weights_of_another_one(tmp_path: Path) -> None:
    for name in ("before", "after", "tiny"):
        (tmp_path / name).mkdir()
    train([scene("a", seed=1)], tmp_path / "before", PLAN, watcher())
    start = load_starting_weights(tmp_path / "before" / CHECKPOINT)
    plan = replace(PLAN, seed=9)
    train([scene("b", seed=2)], tmp_path / "after", plan, watcher(stop_after=0), start=start)
    begun = load_checkpoint(tmp_path / "after" / CHECKPOINT)
    assert begun.facts.steps == 0
    assert begun.facts.started_from.startswith(f"{CHECKPOINT} ")
    assert all(torch.equal(begun.weights[name], value) for name, value in start.checkpoint.weights.items())
    found = train([scene("b", seed=2)], tmp_path / "after", plan, watcher(), start=start)
    assert found.steps == PLAN.steps
    with pytest.raises(InvalidInput, match="a run with other starting weights"):
        train([scene("b", seed=2)], tmp_path / "after", plan, watcher())
    with pytest.raises(InvalidInput, match=r"another network \(nano\); give those of the same size \(tiny\)"):
        train([scene("b", seed=2)], tmp_path / "tiny", replace(plan, size="tiny"), watcher(), start=start)


def test_a_disk_that_fills_leaves_the_last_checkpoint_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    train([scene("a", seed=1)], tmp_path, PLAN, watcher(stop_after=2))

    def full(*_arguments: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("foveacam_pipeline.learn.checkpoint.write_file", full)
        with pytest.raises(Exception, match="checkpoint"):
            train([scene("a", seed=1)], tmp_path, PLAN, watcher(stop_after=3))
    assert load_checkpoint(tmp_path / CHECKPOINT).facts.steps == 2
    assert train([scene("a", seed=1)], tmp_path, PLAN, watcher()).steps == 4


def checkpoint() -> Checkpoint:
    torch.manual_seed(2)
    network = FoveatedStereo(SIZES["nano"])
    facts = TrainingFacts(network=SIZES["nano"], steps=0, steps_planned=1, seed=0, datasets={}, commit="")
    return Checkpoint(facts=facts, weights=network.state_dict(), optimizer={})


def test_a_pickle_is_refused_and_never_loaded(tmp_path: Path) -> None:
    path = tmp_path / "weights.pt"

    class Trap:
        def __reduce__(self) -> tuple[object, ...]:
            return (Path.touch, (tmp_path / "sprung",))

    path.write_bytes(pickle.dumps(Trap()))
    with pytest.raises(InvalidInput, match="a pickle"):
        load_checkpoint(path)
    torch.save({"weights": torch.zeros(2)}, path)
    with pytest.raises(InvalidInput, match="a pickle"):
        load_checkpoint(path)
    assert not (tmp_path / "sprung").exists()


def test_checkpoints_of_another_version_or_architecture_are_refused(tmp_path: Path) -> None:
    path = tmp_path / CHECKPOINT
    save_file({"network.a": torch.zeros(2)}, path, {"format": "foveacam-checkpoint", "version": "2"})
    with pytest.raises(InvalidInput, match="found foveacam-checkpoint version 2"):
        load_checkpoint(path)
    good = checkpoint()
    save_checkpoint(path, replace(good, facts=good.facts.model_copy(update={"network": SIZES["tiny"]})))
    with pytest.raises(InvalidInput, match="another architecture"):
        load_checkpoint(path)
    with pytest.raises(InvalidInput, match="no such file"):
        load_checkpoint(tmp_path / "nothing.safetensors")


def test_the_exported_network_is_a_depth_backend_with_the_same_disparities(tmp_path: Path) -> None:
    trained = checkpoint()
    card = export_network(trained, tmp_path / "out", name="ours", licence="own work")
    pair = varied_pair(3, width=157, height=91)  # sides that are padded
    answer, seen = network_answer(trained.network(), pair)
    expected = answer.disparity_px
    found, deviation = NetworkEstimator.open(load_network(card)).answer_once(pair)
    assert np.abs(found - expected).max() <= 0.02
    assert answer.sigma_px is not None and deviation is not None
    assert np.allclose(deviation, answer.sigma_px, rtol=0.01)
    assert seen.shape == expected.shape == (91, 157)


def test_the_exported_graph_sums_row_by_row(tmp_path: Path) -> None:
    export_network(checkpoint(), tmp_path, name="ours", licence="own work")
    kinds = {node.op_type for node in onnx.load(str(tmp_path / "ours.onnx")).graph.node}
    assert "InstanceNormalization" not in kinds  # onnxruntime's is off by 1e-4 on large pictures
    norm = torch.nn.GroupNorm(2, 16)
    torch.nn.init.normal_(norm.weight)
    torch.nn.init.normal_(norm.bias)
    values = 3.0 * torch.randn(2, 16, 40, 60) + 5.0
    assert torch.allclose(NormByRows(norm)(values), norm(values), rtol=1e-5, atol=2e-5)


def test_exported_weights_are_stored_in_16_bits_and_read_back(tmp_path: Path) -> None:
    fresh = checkpoint()  # equal weights would share one name in the graph
    weights = {name: value + 0.01 * torch.randn(value.shape) for name, value in fresh.weights.items()}
    trained = replace(fresh, weights=weights)
    export_network(trained, tmp_path, name="ours", licence="own work")
    graph = tmp_path / "ours.onnx"
    kinds = {one.data_type for one in onnx.load(str(graph)).graph.initializer}
    assert onnx.TensorProto.FLOAT16 in kinds and onnx.TensorProto.FLOAT not in kinds
    network = network_of_graph(graph)
    assert network is not None
    for name, value in network.state_dict().items():
        assert torch.equal(value, trained.weights[name].half().float()), name


def test_holes_are_filled_from_what_is_behind() -> None:
    nan = np.nan
    rows = np.array([[nan, 5.0, nan, nan, 2.0, nan], [nan] * 6], dtype=np.float32)
    assert filled(rows).tolist() == [[5.0, 5.0, 2.0, 2.0, 2.0, 2.0], [0.0] * 6]


def test_the_rate_rises_and_falls_to_nothing() -> None:
    rates = [learning_rate(step, 100) for step in range(100)]
    assert max(rates) == pytest.approx(training.LEARNING_RATE, rel=0.01)
    assert rates[0] < 0.5 * training.LEARNING_RATE and rates[-1] < 0.01 * training.LEARNING_RATE


def test_a_folder_that_is_no_dataset_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput):
        load_datasets([tmp_path])
