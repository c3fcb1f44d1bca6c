"""Both eyes' answers made one: the means, and a card that asks for them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.network_graphs import matcher, write_card
from tests.support.scenes.stereo_pairs import HEIGHT, WIDTH, flat, pair_of

from foveacam_pipeline.networks.card import load_network
from foveacam_pipeline.networks.estimator import NetworkEstimator, mean_of_eyes, surer_of_eyes
from foveacam_pipeline.networks.session import GraphPort
from foveacam_pipeline.stereo.refine import FloatImage


def rows(*values: float) -> FloatImage:
    return np.tile(np.array(values, dtype=np.float32), (3, 1))


def test_answers_are_averaged_where_they_agree_and_the_left_eyes_stay_where_they_do_not() -> None:
    left_px = rows(1.0, 1.0, 1.0, 1.0, 1.0, 1.0)
    mirrored_px = rows(9.0, 9.0, 2.0, 2.0, 2.0, 2.0)  # of right columns 5 to 0
    found_px = mean_of_eyes(left_px, mirrored_px)
    assert found_px[1].tolist() == [1.0, 1.5, 1.5, 1.5, 1.5, 1.0]  # none at column -1; 9 px beside 1 px


def test_the_surer_eye_counts_more_and_disagreement_widens_the_deviation() -> None:
    left = rows(0.0, 0.0, 0.0), rows(0.3, 0.3, 0.3)
    mirrored = rows(1.0, 5.0, 0.0), rows(0.1, 0.1, 0.1)
    found_px, sigma_px = surer_of_eyes(left, mirrored)
    assert found_px[0] == pytest.approx([0.0, 0.0, 0.9], abs=1e-6)
    assert sigma_px[0, 0] == pytest.approx(np.hypot(0.03, 0.09), rel=1e-5)
    assert sigma_px[0, 1] == pytest.approx(np.hypot(0.3, 2.5), rel=1e-5)
    assert sigma_px[0, 2] == pytest.approx(np.hypot(np.hypot(0.03, 0.09), 0.5), rel=1e-5)


def test_eyes_that_state_no_error_are_not_divided_by_it() -> None:
    none = rows(0.0, 0.0, 0.0)
    found_px, sigma_px = surer_of_eyes((rows(1.0, 1.0, 1.0), none), (rows(2.0, 2.0, 2.0), none))
    assert np.isfinite(found_px).all()
    assert sigma_px[0].tolist() == [0.0, 0.5, 0.5]


def test_where_the_right_window_ends_the_left_eyes_answer_stays() -> None:
    beyond = rows(3.0, 3.0, 3.0), rows(0.2, 0.2, 0.2)
    found_px, sigma_px = surer_of_eyes(beyond, (rows(3.5, 3.5, 3.5), rows(0.1, 0.1, 0.1)))
    assert np.array_equal(found_px, beyond[0]) and np.array_equal(sigma_px, beyond[1])


class Leaning:
    """A network that says 4 px, half a pixel more where the picture grows brighter to the right."""

    def __init__(self) -> None:
        self.runs = 0

    def get_inputs(self) -> list[GraphPort]:
        return []

    def get_outputs(self) -> list[GraphPort]:
        return []

    def run(
        self, _outputs: Sequence[str], inputs: Mapping[str, NDArray[np.float32]]
    ) -> Sequence[NDArray[np.generic]]:
        self.runs += 1
        left = inputs["left"].mean(axis=1, keepdims=True)
        rises = np.sign(left[..., -1:] - left[..., :1])
        return [(4.0 + 0.5 * rises + 0.0 * left).astype(np.float32)]


@pytest.mark.parametrize(("both_ways", "runs", "expected_px"), [(False, 1, 4.5), (True, 2, 4.0)])
def test_a_card_that_asks_for_both_ways_has_no_side(
    tmp_path: Path, both_ways: bool, runs: int, expected_px: float
) -> None:
    network = load_network(write_card(matcher(tmp_path / "a.onnx"), both_ways=both_ways))
    session = Leaning()
    brighter = np.tile((np.arange(WIDTH) // 2).astype(np.uint8), (HEIGHT, 1))
    pair = replace(pair_of(flat(4.0)), left=brighter, right=brighter)
    found_px, sigma_px = NetworkEstimator(card=network.card, session=session).answer(pair)
    assert session.runs == runs and sigma_px is None
    assert np.median(found_px) == expected_px
