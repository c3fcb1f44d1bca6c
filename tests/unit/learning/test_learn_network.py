"""The foveated stereo network and its losses: signs, shapes, symmetry of the parts, and what they measure."""

from dataclasses import replace

import pytest
import torch
from tests.support.scenes.learning_pairs import varied_pair

from foveacam_pipeline.learn.evaluation import network_answer
from foveacam_pipeline.learn.losses import (
    LossWeights,
    PairBatch,
    laplace_scale,
    photometric_error,
    reconstruction,
    self_supervised,
    smoothness,
    warped,
)
from foveacam_pipeline.learn.network.config import SIZES
from foveacam_pipeline.learn.network.correlation import consistent, match_rows, row_scores, sample_scores
from foveacam_pipeline.learn.network.encoder import standardised
from foveacam_pipeline.learn.network.geometry import (
    mirrored_geometry,
    turned_geometry,
    view_geometry,
)
from foveacam_pipeline.learn.network.network import FoveatedStereo
from foveacam_pipeline.learn.network.refinement import Enlargement, cell_shares, enlarged
from foveacam_pipeline.learn.network.row_attention import AttentionBlock
from foveacam_pipeline.learn.pairs import picture_planes


def features(columns: int = 24, seed: int = 0) -> torch.Tensor:
    """Return distinct features (1, 16, 4, columns)."""
    generator = torch.Generator().manual_seed(seed)
    return torch.nn.functional.normalize(torch.randn(1, 16, 4, columns, generator=generator), dim=1) * 8.0


@pytest.mark.parametrize("shift", [-5, 0, 5])
def test_the_correlation_finds_disparities_of_either_sign(shift: int) -> None:
    left = features()
    right = torch.roll(left, -shift, dims=3)  # a left cell at x lies at x - shift in the right picture
    matches = match_rows(row_scores(left, right, reach=12))
    assert matches.disparity[..., 6:-6] == pytest.approx(torch.full((1, 1, 4, 12), float(shift)), abs=0.05)
    assert matches.share.sum(dim=3) == pytest.approx(torch.ones(1, 4, 24), abs=1e-5)


def test_nothing_is_found_beyond_the_reach() -> None:
    left = features()
    matches = match_rows(row_scores(left, torch.roll(left, -9, dims=3), reach=4))
    assert matches.disparity.abs().max() <= 4.5


def test_cells_that_only_one_eye_sees_are_not_consistent() -> None:
    left, other = features(), features(seed=1)
    right = torch.roll(left, -3, dims=3)
    right[..., 8:12] = other[..., 8:12]  # hides what the left eye sees in columns 11 to 14
    scores = row_scores(left, right, reach=12)
    agree = consistent(match_rows(scores).disparity, scores)[0, 0, 0]
    assert not agree[11:15].any()
    assert agree[15:22].all()


def test_scores_are_sampled_between_columns() -> None:
    scores = torch.arange(6.0).expand(1, 1, 6, 6)  # the score of a right column is its number
    found = sample_scores(scores, torch.full((1, 1, 1, 6), 1.25), torch.tensor([0.0, 0.5]))
    assert found[0, :, 0, 4].tolist() == pytest.approx([2.75, 2.25])


def test_the_right_picture_is_warped_to_the_left_by_positive_disparity_to_the_left() -> None:
    right = torch.arange(16.0).expand(1, 3, 4, 16).clone()
    rebuilt, seen = warped(right, torch.full((1, 1, 4, 16), 3.0))
    assert rebuilt[0, 0, 0, 3:] == pytest.approx(torch.arange(13.0), abs=1e-4)
    assert seen[0, 0, 0].tolist() == [False] * 3 + [True] * 13


def test_the_photometric_error_is_nothing_for_the_same_picture_and_grows_with_the_difference() -> None:
    picture = torch.rand(1, 3, 16, 16)
    assert photometric_error(picture, picture).max() == pytest.approx(0.0, abs=1e-5)
    assert (
        photometric_error(picture, picture + 0.1).mean() < photometric_error(picture, picture.flip(3)).mean()
    )


def test_the_photometric_error_weighs_structure_more_than_brightness() -> None:
    rows, columns = torch.meshgrid(torch.arange(16), torch.arange(16), indexing="ij")
    chequer = (0.1 * ((rows + columns) % 2) - 0.05).expand(1, 3, 16, 16)
    picture = 0.5 + chequer
    brighter, inverted = (
        float(photometric_error(picture, other).mean()) for other in (0.6 + chequer, 0.5 - chequer)
    )
    level = 1.0 - (2.0 * 0.5 * 0.6 + 1e-4) / (0.5**2 + 0.6**2 + 1e-4)  # SSIM without change of contrast
    assert brighter == pytest.approx(0.85 * level / 2.0 + 0.15 * 0.1, rel=0.05)
    assert inverted > 10.0 * brighter  # by as many grey levels


def test_smoothness_asks_for_less_where_the_picture_changes() -> None:
    disparity = torch.zeros(1, 1, 8, 8)
    disparity[..., 4:] = 2.0
    edge = torch.zeros(1, 3, 8, 8)
    edge[..., 4:] = 1.0
    assert smoothness(disparity, edge) < 0.01 * smoothness(disparity, torch.zeros(1, 3, 8, 8))


def test_reconstruction_is_least_at_the_true_match() -> None:
    generator = torch.Generator().manual_seed(3)
    right = torch.rand(1, 3, 16, 96, generator=generator)
    left = torch.roll(right, 8, dims=3)
    seen = torch.ones(1, 1, 16, 96, dtype=torch.bool)
    batch = PairBatch(left=left, right=right, valid_left=seen)
    cells = torch.eye(24)[None, None].expand(1, 4, 24, 24)
    truth, zero = match_rows(torch.roll(cells, -2, dims=3) * 50.0), match_rows(cells * 50.0)
    assert truth.disparity[..., 2:].eq(2.0).all()
    assert reconstruction(truth, batch, seen) < 0.05 * reconstruction(zero, batch, seen)


def test_enlarging_keeps_a_plane() -> None:
    shares = cell_shares(torch.zeros(1, 9 * 16, 3, 5))
    assert enlarged(torch.full((1, 1, 3, 5), 1.5), shares) == pytest.approx(torch.full((1, 1, 12, 20), 1.5))


def test_disparities_of_cells_are_enlarged_to_pixels() -> None:
    torch.manual_seed(0)
    disparity, _ = Enlargement(8)(torch.randn(1, 8, 3, 5), torch.full((1, 1, 3, 5), 2.5))
    assert disparity.detach() == pytest.approx(torch.full((1, 1, 12, 20), 10.0), rel=1e-5)


def test_shares_of_cells_are_a_softmax() -> None:
    weights = 30.0 * torch.randn(2, 9 * 16, 3, 5, generator=torch.Generator().manual_seed(1))
    expected = weights.reshape(2, 9, 16, 3, 5).softmax(dim=1)
    assert torch.allclose(cell_shares(weights), expected, atol=1e-6)


def test_brightness_of_an_eye_makes_no_difference() -> None:
    picture = torch.rand(2, 3, 8, 8)
    assert standardised(0.5 * picture + 0.2) == pytest.approx(standardised(picture), abs=1e-4)


@pytest.mark.parametrize("size", ["nano", "tiny"])
def test_a_prediction_has_the_size_of_the_picture_and_every_weight_gets_a_finite_gradient(size: str) -> None:
    torch.manual_seed(0)
    config = next(config for name, config in SIZES.items() if name == size)
    network = FoveatedStereo(config)
    left, right = torch.rand(2, 1, 3, 64, 96)
    prediction = network(left, right)
    assert [found.shape for found in prediction.disparities] == [(1, 1, 64, 96)] * (config.steps + 1)
    assert prediction.log_scale.shape == (1, 1, 64, 96)
    seen = torch.ones(1, 1, 64, 96, dtype=torch.bool)
    batch = PairBatch(left=left, right=right, valid_left=seen)
    loss, parts = self_supervised(prediction, batch, LossWeights(), masked=False)
    torch.autograd.backward(loss)
    assert set(parts) == {"photometric", "reconstruction", "smoothness", "scale"}
    for name, parameter in network.named_parameters():
        assert parameter.grad is not None and parameter.grad.isfinite().all(), name


@pytest.mark.parametrize("part", ["photometric", "reconstruction", "smoothness", "scale"])
def test_each_part_of_the_loss_without_truth_counts_by_its_weight(part: str) -> None:
    torch.manual_seed(0)
    left, right = torch.rand(2, 1, 3, 64, 96)
    prediction = FoveatedStereo(SIZES["nano"])(left, right)
    batch = PairBatch(left=left, right=right, valid_left=torch.ones(1, 1, 64, 96, dtype=torch.bool))
    weights = LossWeights()
    doubled = replace(weights, **{part: 2.0 * getattr(weights, part)})
    with torch.no_grad():
        loss, parts = self_supervised(prediction, batch, weights, masked=False)
        more, _ = self_supervised(prediction, batch, doubled, masked=False)
    assert float(loss) == pytest.approx(sum(parts.values()))
    assert float(more - loss) == pytest.approx(parts[part], rel=1e-3)
    assert abs(parts[part]) > 1e-4


def test_each_eye_attends_to_the_other_one() -> None:
    torch.manual_seed(0)
    block = AttentionBlock(16, 4)
    left, right, other = torch.randn(3, 1, 16, 4, 12)
    told_left, told_right = block(left, right)
    exchanged = block(right, left)
    assert torch.allclose(exchanged[0], told_right, atol=1e-5)
    assert torch.allclose(exchanged[1], told_left, atol=1e-5)
    assert (block(left, other)[0] - told_left).abs().max() > 0.01
    assert (block(other, right)[1] - told_right).abs().max() > 0.01


def test_the_stated_error_is_the_standard_deviation_of_a_laplace_error() -> None:
    torch.manual_seed(0)
    network, pair = FoveatedStereo(SIZES["nano"]), varied_pair(1)
    answer, _ = network_answer(network, pair)
    left, right = (torch.from_numpy(picture_planes(picture))[None] for picture in (pair.left, pair.right))
    with torch.no_grad():
        prediction = network(left, right)
    errors = torch.distributions.Laplace(prediction.disparity, laplace_scale(prediction))
    assert answer.sigma_px is not None
    assert answer.sigma_px == pytest.approx(errors.stddev[0, 0].numpy(), rel=1e-3)


def test_an_unsigned_network_gives_no_negative_disparity() -> None:
    torch.manual_seed(0)
    left = features()
    matches = match_rows(row_scores(left, torch.roll(left, 5, dims=3), reach=12, signed=False))
    assert matches.disparity.min() >= 0.0  # the true ones are -5
    network = FoveatedStereo(SIZES["nano"].model_copy(update={"signed": False}))
    pictures = torch.rand(2, 1, 3, 64, 96)
    found = network(*pictures)
    assert all(disparity.min() >= 0.0 for disparity in found.disparities)
    assert FoveatedStereo(SIZES["nano"])(*pictures).disparity.min() < 0.0


def test_the_geometry_changes_nothing_at_first_and_something_once_learnt() -> None:
    config = SIZES["nano"].model_copy(update={"geometry": True})
    torch.manual_seed(0)
    plain = FoveatedStereo(SIZES["nano"])
    told = FoveatedStereo(config)
    told.load_state_dict(plain.state_dict(), strict=False)
    left, right = torch.rand(2, 1, 3, 64, 96)
    geometry = view_geometry(varied_pair(1))[None]
    expected = plain(left, right).disparity
    assert torch.equal(told(left, right, geometry).disparity, expected)
    torch.autograd.backward(told(left, right, geometry).disparity.sum())
    for name, parameter in told.films.named_parameters():
        assert parameter.grad is not None and parameter.grad.isfinite().all(), name
    with torch.no_grad():
        torch.nn.init.normal_(told.films[0].get_parameter("terms.2.weight"))
    assert not torch.equal(told(left, right, geometry).disparity, expected)
    with pytest.raises(ValueError, match="give `geometry`"):
        told(left, right)


def test_the_geometry_of_a_window_is_that_of_the_picture_it_is_cut_from() -> None:
    pair = varied_pair(2, width=160, height=96)
    whole = view_geometry(pair)
    assert view_geometry(pair, (slice(0, 96), slice(0, 160))) == pytest.approx(whole)
    aside = view_geometry(pair, (slice(20, 84), slice(64, 160)))
    assert (aside[[0, 2]] > whole[[0, 2]]).all() and aside[1] == aside[3] > whole[1]
    assert aside[4:] == pytest.approx(whole[4:])
    mirrored = mirrored_geometry(whole)
    assert (mirrored[0], mirrored[2]) == (-whole[2], -whole[0])
    assert mirrored_geometry(mirrored) == pytest.approx(whole)
    assert turned_geometry(whole)[[1, 3]] == pytest.approx(-whole[[1, 3]])


def test_a_network_without_the_new_fields_of_its_configuration_is_the_signed_one() -> None:
    old = SIZES["nano"].model_dump(exclude={"signed", "geometry"})
    config = type(SIZES["nano"]).model_validate(old)
    assert config == SIZES["nano"]
    assert not [name for name in FoveatedStereo(config).state_dict() if name.startswith("films")]
