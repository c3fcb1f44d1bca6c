"""The monocular prior: its alignment and schedule, its training, and networks from a local folder."""

import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest
import torch
from safetensors.torch import load_file, save_file
from tests.support.scenes.learning_pairs import scene, watcher

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.learn.checkpoint import load_checkpoint
from foveacam_pipeline.learn.losses import LossWeights
from foveacam_pipeline.learn.monocular.network import MonocularConfig, MonocularDepth
from foveacam_pipeline.learn.monocular.prior import DepthAnythingPrior, load_prior
from foveacam_pipeline.learn.monocular.prior_loss import aligned, difference_loss, prior_loss, prior_weight
from foveacam_pipeline.learn.monocular.training import PriorPlan, inverse_depth_loss, train_prior
from foveacam_pipeline.learn.pairs import CropSource
from foveacam_pipeline.learn.training import CHECKPOINT, TrainingPlan, train
from foveacam_server.resources.studying.learning.run import TrainingOrder, run_training

PLAN = PriorPlan(steps=4, batch=2, crop_px=(96, 64))


@pytest.fixture(autouse=True)
def _one_thread() -> None:
    torch.set_num_threads(1)


def test_the_weight_of_an_annealed_prior_falls_to_nothing_at_three_fifths_of_the_steps() -> None:
    assert [prior_weight("annealed", share) for share in (0.0, 0.3, 0.6, 1.0)] == pytest.approx(
        [0.15, 0.075, 0.0, 0.0]
    )
    assert prior_weight("full", 0.9) == 1.0
    assert prior_weight("none", 0.0) == 0.0


def test_scale_and_shift_are_those_of_least_squares_where_seen() -> None:
    generator = torch.Generator().manual_seed(1)
    target = torch.randn(2, 1, 8, 8, generator=generator)
    prior = 0.25 * target - 3.0 + 0.1 * torch.randn(2, 1, 8, 8, generator=generator)
    seen = torch.rand(2, 1, 8, 8, generator=generator) > 0.3
    prior = torch.where(seen, prior, torch.full_like(prior, 50.0))
    found = aligned(prior, target, seen)
    for number in range(2):
        kept = seen[number, 0]
        columns = torch.stack([prior[number, 0][kept], torch.ones(int(kept.sum()))], dim=1)
        solved = torch.linalg.lstsq(columns, target[number, 0][kept][:, None]).solution
        assert found[number, 0][kept] == pytest.approx((columns @ solved)[:, 0], abs=1e-3)


def test_a_prior_that_calls_near_far_is_no_guide() -> None:
    target = torch.linspace(0.0, 7.0, 8).expand(1, 1, 4, 8)
    seen = torch.ones(1, 1, 4, 8, dtype=torch.bool)
    assert aligned(-target, target, seen) == pytest.approx(torch.full((1, 1, 4, 8), 3.5))


def test_the_loss_by_a_prior_knows_neither_its_scale_nor_its_shift() -> None:
    generator = torch.Generator().manual_seed(2)
    disparity = torch.randn(1, 1, 16, 24, generator=generator).requires_grad_()
    seen = torch.ones(1, 1, 16, 24, dtype=torch.bool)
    assert prior_loss(disparity, 0.1 * disparity.detach() + 5.0, seen) < 1e-4
    loss = prior_loss(disparity, torch.randn(1, 1, 16, 24, generator=generator), seen)
    torch.autograd.backward(loss)
    assert loss > 0.5 / 16.0
    assert disparity.grad is not None and disparity.grad.isfinite().all()


def test_what_is_not_seen_counts_for_no_difference() -> None:
    off = torch.zeros(1, 1, 16, 16)
    off[..., 8:] = 100.0
    seen = torch.ones(1, 1, 16, 16, dtype=torch.bool)
    seen[..., 8:] = False
    assert difference_loss(off, seen) == 0.0


def test_a_monocular_network_takes_pictures_of_any_size_and_every_weight_gets_a_finite_gradient() -> None:
    torch.manual_seed(0)
    network = MonocularDepth(MonocularConfig())
    weights = sum(parameter.numel() for parameter in network.parameters())
    assert 0.3e6 < weights < 1.0e6
    batch = CropSource([scene("a", seed=1, labelled=True)], size=(104, 72), batch=2, seed=0).batch(0)
    found = network(batch.left)
    assert found.shape == (2, 1, 72, 104)
    torch.autograd.backward(inverse_depth_loss(found, batch))
    for name, parameter in network.named_parameters():
        assert parameter.grad is not None and parameter.grad.isfinite().all(), name
    assert network(torch.rand(1, 3, 45, 67)).shape == (1, 1, 45, 67)


@pytest.mark.slow
def test_a_prior_is_trained_gone_on_with_bit_equal_and_used_by_stereo(tmp_path: Path) -> None:
    labelled = [scene("a", seed=1, labelled=True)]
    whole, parts, stereo = (tmp_path / name for name in ("whole", "parts", "stereo"))
    for folder in (whole, parts, stereo):
        folder.mkdir()
    facts = train_prior(labelled, whole, PLAN, watcher())
    train_prior(labelled, parts, PLAN, watcher(stop_after=2))
    train_prior(labelled, parts, PLAN, watcher())
    once, twice = load_file(whole / CHECKPOINT), load_file(parts / CHECKPOINT)
    assert all(torch.equal(once[name], twice[name]) for name in once)
    assert (facts.steps, list(facts.loss)) == (4, ["inverse depth"])
    with pytest.raises(InvalidInput, match="no disparities of two eyes"):
        load_checkpoint(whole / CHECKPOINT).network()
    prior = load_prior(whole / CHECKPOINT)
    plan = TrainingPlan(
        steps=5, batch=1, crop_px=(96, 64), prior="annealed", weights=LossWeights(photometric=0.0)
    )
    stereo_facts = train([scene("b", seed=5)], stereo, plan, watcher(), prior=prior)
    assert (stereo_facts.prior, stereo_facts.prior_network) == ("annealed", prior.name)
    assert stereo_facts.without == ["photometric"]
    rows = (stereo / "curves.csv").read_text().splitlines()
    column = rows[0].split(",").index("prior")
    weighted = [float(row.split(",")[column]) for row in rows[1:]]
    assert all(weight > 0.0 for weight in weighted[:3]) and weighted[3:] == [0.0, 0.0]
    with pytest.raises(InvalidInput, match="other monocular prior"):
        train([scene("b", seed=5)], stereo, replace(plan, prior="full"), watcher(), prior=prior)
    with pytest.raises(InvalidInput, match="other parts of the loss"):
        train([scene("b", seed=5)], stereo, replace(plan, weights=LossWeights()), watcher(), prior=prior)
    with pytest.raises(InvalidInput, match="that of a stereo network"):
        load_prior(stereo / CHECKPOINT)


def test_a_prior_is_trained_by_truth_alone(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="b has no truth"):
        train_prior([scene("b", seed=5)], tmp_path, PLAN, watcher())


class FakeTransformers(ModuleType):
    """Stands for transformers: its model answers the mean of the channels at the size that it was given."""

    def __init__(self, *, fails: bool = False) -> None:
        super().__init__("transformers")
        self.asked: dict[str, object] = {}
        self.fails = fails
        self.AutoModelForDepthEstimation = self

    def from_pretrained(self, folder: Path, **options: object) -> "FakeTransformers":
        if self.fails:
            raise OSError("no such model\nand more")
        self.asked = {"folder": folder, **options}
        return self

    def eval(self) -> "FakeTransformers":
        return self

    def __call__(self, pixel_values: torch.Tensor) -> SimpleNamespace:
        assert [side % 14 for side in pixel_values.shape[2:]] == [0, 0]
        return SimpleNamespace(predicted_depth=pixel_values.mean(dim=1))


def weights_folder(folder: Path) -> Path:
    save_file({"a": torch.zeros(1)}, folder / "model.safetensors")
    return folder


def test_depth_anything_comes_from_a_local_folder_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fake = FakeTransformers()
    monkeypatch.setitem(sys.modules, "transformers", fake)
    prior = load_prior(weights_folder(tmp_path))
    assert isinstance(prior, DepthAnythingPrior)
    assert fake.asked == {
        "folder": tmp_path,
        "local_files_only": True,
        "use_safetensors": True,
        "trust_remote_code": False,
    }
    bright = torch.zeros(1, 3, 40, 60)
    bright[..., 30:] = 1.0
    found = prior.inverse_depth(bright)
    assert found.shape == (1, 1, 40, 60)
    assert found[0, 0, 20, 55] > found[0, 0, 20, 5]


def test_what_is_no_prior_is_refused_in_words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InvalidInput, match=r"has no model\.safetensors"):
        load_prior(tmp_path)
    folder = weights_folder(tmp_path)
    monkeypatch.setitem(sys.modules, "transformers", None)
    with pytest.raises(InvalidInput, match=r"pip install 'foveacam-duo\[prior\]'"):
        load_prior(folder)
    monkeypatch.setitem(sys.modules, "transformers", FakeTransformers(fails=True))
    with pytest.raises(InvalidInput, match=r"cannot load it: no such model$"):
        load_prior(folder)


@pytest.mark.parametrize(
    ("order", "message"),
    [
        ({"prior": "some"}, "--prior some: it is one of none, annealed, full"),
        ({"prior": "full"}, "--prior full without --prior-network"),
        ({"prior_network": Path("x")}, "--prior none with --prior-network"),
        ({"without": ("scale",)}, "--without scale: it is one of photometric, reconstruction, smoothness"),
    ],
)
def test_what_training_cannot_take_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, order: dict[str, object], message: str
) -> None:
    monkeypatch.setattr("foveacam_pipeline.learn.pairs.load_datasets", lambda _folders: ())
    given = TrainingOrder(
        datasets=(tmp_path / "a",),
        held_out=(tmp_path / "b",),
        out=tmp_path / "run",
        size="nano",
        steps=1,
        batch=1,
        crop_px=(96, 64),
        seed=0,
    )
    with pytest.raises(InvalidInput, match=message):
        run_training(replace(given, **order), as_json=True)  # type: ignore[arg-type]  # of one field each
