"""The bench of the network that ships: what it compares, and the fit of the sigma's factor."""

from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
import pytest
import torch
from tests.support.scenes.learning_pairs import stored, varied_sample
from tests.support.scenes.network_graphs import matcher, write_card
from typer.testing import CliRunner

from foveacam_bench.learned import held_out, ship
from foveacam_bench.learned.accuracy import accuracy_figures, measure_accuracy
from foveacam_bench.learned.invariance import flip_errors, shift_errors, torch_agreement
from foveacam_bench.learned.learning_curve import (
    FIRST_SHARE,
    PowerLaw,
    block_means,
    fit_power_law,
    read_losses,
)
from foveacam_bench.learned.photographs import signed_photographs
from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.learn.checkpoint import Checkpoint, TrainingFacts
from foveacam_pipeline.learn.export import export_network
from foveacam_pipeline.learn.network.config import SIZES
from foveacam_pipeline.learn.network.network import FoveatedStereo
from foveacam_pipeline.learn.pair_folder import PairSample
from foveacam_pipeline.networks.card import load_network
from foveacam_pipeline.networks.estimator import NetworkEstimator
from foveacam_pipeline.stereo.refine import FloatImage
from foveacam_pipeline.stereo.values import RectifiedPair
from foveacam_server.cli import app

pytestmark = pytest.mark.slow
SAMPLES = [varied_sample(seed) for seed in range(3)]


def stating(folder: Path, sigma: float) -> NetworkEstimator:
    """Return whole shifts as a network that states one sigma everywhere."""
    graph = matcher(folder / f"{sigma}.onnx", sigma=sigma)
    return NetworkEstimator.open(load_network(write_card(graph, output={"sigma": "sigma"})))


def test_a_network_is_compared_where_both_eyes_see_at_matchings_density(tmp_path: Path) -> None:
    found = measure_accuracy(stating(tmp_path, 0.5), SAMPLES)
    assert found.network_all.answered == found.sgbm_filled.answered == 1.0
    assert found.surest.answered == pytest.approx(found.sgbm.answered)
    assert found.network_all.bad_1 < 0.2 and found.pairs == 3
    figures = accuracy_figures(found)
    assert figures["foveal_epe_over_sgbm"] == found.network_all.epe_px / found.sgbm_filled.epe_px
    with pytest.raises(ValueError, match="truth"):
        measure_accuracy(stating(tmp_path, 0.5), [PairSample(pair=SAMPLES[0].pair)])


def test_the_curve_is_that_below_which_68_percent_of_the_kept_errors_lie(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    samples = []
    for deviation_px, scale_px in ((0.5, 0.4), (2.0, 0.8)):
        sample, truth = SAMPLES[0], SAMPLES[0].truth
        assert truth is not None
        off_px = rng.laplace(0.0, scale_px, truth.both.shape).astype(np.float32)
        noisy = replace(truth, disparity_px=truth.disparity_px + off_px)
        samples.append((stating(tmp_path, deviation_px), PairSample(pair=sample.pair, truth=noisy)))

    class Both:
        """The one of the two networks whose turn it is."""

        turn = iter([network for network, _ in samples])

        def answer(self, pair: RectifiedPair) -> tuple[FloatImage, FloatImage | None]:
            return next(self.turn).answer(pair)

    curve = ship.fit_sigma_curve(cast(NetworkEstimator, Both()), [sample for _, sample in samples])
    for deviation_px, scale_px in ((0.5, 0.4), (2.0, 0.8)):
        assert curve.factor * deviation_px**curve.power == pytest.approx(
            1.148 * scale_px, rel=0.15
        )  # its own shifts err too


def test_exchanged_eyes_and_shifted_pictures_change_what_they_should(tmp_path: Path) -> None:
    estimator = stating(tmp_path, 0.5)
    assert np.median(flip_errors(estimator, SAMPLES[0])) == 0.0
    assert np.median(shift_errors(estimator, SAMPLES[0], shifts_px=(1, 2))) == 0.0


def test_the_graph_that_was_exported_agrees_with_torch_and_another_says_why_not(tmp_path: Path) -> None:
    torch.manual_seed(2)
    facts = TrainingFacts(network=SIZES["nano"], steps=0, steps_planned=1, seed=0, datasets={}, commit="")
    fresh = FoveatedStereo(SIZES["nano"]).state_dict()  # equal weights would share one name in the graph
    weights = {name: value + 0.01 * torch.randn(value.shape) for name, value in fresh.items()}
    trained = Checkpoint(facts=facts, weights=weights, optimizer={})
    network = load_network(export_network(trained, tmp_path / "out", name="ours", licence="own work"))
    found = torch_agreement(NetworkEstimator.open(network), network, SAMPLES)
    assert float(str(found["torch_onnx_median_px"])) < 0.01
    other = load_network(write_card(matcher(tmp_path / "a.onnx")))
    found = torch_agreement(NetworkEstimator.open(other), other, SAMPLES)
    assert "fit no size" in str(found["torch_onnx_skipped"])


def test_photographs_get_disparities_of_either_sign() -> None:
    [(name, sample, settings)] = signed_photographs(None)
    assert name == "motorcycle" and sample.truth is not None
    disparity_px = sample.truth.disparity_px[sample.truth.both]
    assert np.median(disparity_px) == pytest.approx(0.0, abs=0.5)
    assert disparity_px.min() < -10.0 and disparity_px.max() > 10.0
    assert settings.near_m is not None and not sample.pair.valid_right[:, 0].any()


def test_pairs_are_given_or_rendered_once_into_a_folder_of_their_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(InvalidInput, match="pairs to train on"):
        held_out.held_out_pairs(stored(tmp_path / "train", SAMPLES), count=2)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(held_out, "WORKERS", 1)
    first = held_out.held_out_pairs(None, count=1)
    [folder] = (tmp_path / "foveacam" / "pairs").iterdir()
    written = (folder / "pairs-00000.npz").stat().st_mtime_ns
    assert np.array_equal(held_out.held_out_pairs(None, count=1)[0].pair.left, first[0].pair.left)
    assert (folder / "pairs-00000.npz").stat().st_mtime_ns == written


def test_a_bench_without_pairs_refuses_a_folder_of_them(tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["bench", "serial", "--json", "--pairs", str(tmp_path)])
    assert "reads no pairs with truth" in str(result.exception)


def test_a_power_law_is_found_again_in_its_noisy_losses(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    law = PowerLaw(floor=0.1, scale=2.0, exponent=0.3)
    every = np.arange(1.0, 6001.0)
    noisy = law.at(every) * rng.normal(1.0, 0.1, every.shape)
    for name, part in (("first", noisy[:2000]), ("second", noisy[2000:])):
        (tmp_path / name).mkdir()
        rows = "\n".join(f"{step},{loss}" for step, loss in enumerate(part))
        (tmp_path / name / "curves.csv").write_text(f"step,truth\n{rows}\n")
    steps, means = block_means(read_losses([tmp_path / "first", tmp_path / "second"]))
    settled = steps > FIRST_SHARE * len(every)
    found = fit_power_law(steps[settled], means[settled])
    assert found.at(np.array([6e4])) == pytest.approx(law.at(np.array([6e4])), rel=0.1)
    assert [found.exponent, found.floor] == pytest.approx([0.3, 0.1], abs=0.06)
