"""What a training computes on, and in which precision."""

from dataclasses import replace
from pathlib import Path

import pytest
import torch
from tests.support.scenes.learning_pairs import scene

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.learn.checkpoint import load_checkpoint
from foveacam_pipeline.learn.device import PROCESSOR, TrainingDevice, choose_device
from foveacam_pipeline.learn.network.config import SIZES
from foveacam_pipeline.learn.network.network import FoveatedStereo
from foveacam_pipeline.learn.training import CHECKPOINT, TrainingPlan, TrainingWatcher, train

pytestmark = pytest.mark.slow

PLAN = TrainingPlan(steps=4, batch=1, crop_px=(96, 64))
REDUCED = TrainingDevice(device=torch.device("cpu"), reduced=True)


def losses(folder: Path, device: TrainingDevice) -> list[float]:
    folder.mkdir()
    seen: list[float] = []
    watcher = TrainingWatcher(on_step=lambda _step, _steps, loss: seen.append(loss), stopped=lambda: False)
    train([scene("a", seed=1)], folder, PLAN, watcher, device=device)
    return seen


def test_features_in_bfloat16_train_nearly_as_those_in_float32(tmp_path: Path) -> None:
    torch.set_num_threads(1)
    whole, reduced = losses(tmp_path / "whole", PROCESSOR), losses(tmp_path / "reduced", REDUCED)
    assert whole != reduced
    assert reduced[0] == pytest.approx(whole[0], rel=0.01)  # of equal weights
    assert sum(reduced) == pytest.approx(sum(whole), rel=0.1)
    weights = load_checkpoint(tmp_path / "reduced" / CHECKPOINT).weights
    assert {value.dtype for value in weights.values()} == {torch.float32}


def test_places_of_pixels_stay_in_float32() -> None:
    network = FoveatedStereo(SIZES["nano"])
    network.reduced = True
    found = network(*(torch.rand(1, 3, 64, 96) for _ in range(2)))
    assert found.disparity.dtype == found.log_scale.dtype == torch.float32


def test_a_gpu_is_chosen_where_there_is_one_and_computes_in_bfloat16(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    assert choose_device() == TrainingDevice(device=torch.device("cuda"), reduced=True)
    assert choose_device("cpu") == PROCESSOR
    assert choose_device("cuda", "float32") == TrainingDevice(device=torch.device("cuda"))
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    assert choose_device() == PROCESSOR
    assert choose_device("auto", "bfloat16") == replace(PROCESSOR, reduced=True)


def test_what_is_not_there_is_refused_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    with pytest.raises(InvalidInput, match="finds no GPU on this machine"):
        choose_device("cuda")
    with pytest.raises(InvalidInput, match="--device tpu: the choices are auto, cpu, cuda"):
        choose_device("tpu")
    with pytest.raises(InvalidInput, match="--precision int8"):
        choose_device("cpu", "int8")
