"""Networks of anybody as depth backends: cards, what is wrong with one, and disparities with their errors."""

import hashlib
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import onnx
import pytest
from tests.support.scenes.network_graphs import constant, matcher, quarter_size, write_card

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.networks import session
from foveacam_pipeline.networks.card import NetworkInputs, example_card, load_network
from foveacam_pipeline.networks.check import NetworkCheck, check_network
from foveacam_pipeline.networks.estimator import NetworkEstimator
from foveacam_pipeline.networks.external_weights import external_files
from foveacam_pipeline.networks.feeding import padded_size, shifted_left, tiles, to_tensor
from foveacam_pipeline.networks.known_pair import known_pair
from foveacam_pipeline.networks.session import NetworkFault
from foveacam_pipeline.stereo.match import match
from foveacam_server.resources.looking.depth_backends.networks import NetworkFolder

pytestmark = pytest.mark.slow


def checked(graph: Path, **changes: object) -> NetworkCheck:
    return check_network(load_network(write_card(graph, **changes)))


def remedy(check: NetworkCheck) -> str:
    assert not check.passed
    return check.findings[-1].remedy or check.findings[-1].found


def test_a_network_that_fits_its_card_passes_and_is_timed_beside_semi_global_matching(tmp_path: Path) -> None:
    check = checked(matcher(tmp_path / "a.onnx"))
    assert check.passed and check.error_median_px == 0.0
    assert check.compute_ms is not None and check.sgbm_ms is not None


@pytest.mark.parametrize(
    ("write", "words", "output"),
    [
        (partial(matcher, sign=-1.0), "output.sign", {"sign": -1}),
        (partial(matcher, first_px=0, last_px=44), "positive_only to true", {"positive_only": True}),
        (partial(matcher, scale=4.0), "multiply output.scale by 4", {"scale": 4.0}),
    ],
)
def test_a_wrong_key_of_the_card_is_named_and_that_key_mends_it(
    tmp_path: Path, write: Callable[[Path], Path], words: str, output: dict[str, object]
) -> None:
    graph = write(tmp_path / "a.onnx")
    assert words in remedy(checked(graph))
    assert checked(graph, output=output).passed


def test_broken_graphs_are_named(tmp_path: Path) -> None:
    assert "no finite number" in remedy(checked(constant(tmp_path / "nan.onnx", float("nan"))))
    assert "(1, 1, 64, 96)" in remedy(checked(quarter_size(tmp_path / "small.onnx")))
    assert "the wall comes out as 1.0 px" in remedy(checked(constant(tmp_path / "one.onnx", 1.0)))
    damaged = tmp_path / "damaged.onnx"
    damaged.write_bytes(b"no graph")
    assert "cannot load damaged.onnx" in remedy(checked(damaged))


def test_ports_and_layouts_that_do_not_fit_are_named(tmp_path: Path) -> None:
    graph = matcher(tmp_path / "a.onnx")
    assert "the graph has left, right" in checked(graph, inputs={"left": "image1"}).findings[-1].found
    assert "the graph has disp" in checked(graph, output={"name": "flow"}).findings[-1].found
    assert "tensor of 1 x 256 x 384 x 3" in checked(graph, inputs={"layout": "NHWC"}).findings[-1].found


def test_weights_beside_the_graph_are_listed_hashed_and_copied(tmp_path: Path) -> None:
    graph = matcher(tmp_path / "a.onnx")
    model = onnx.load(str(graph))
    for tensor in model.graph.initializer:
        if tensor.data_type == onnx.TensorProto.FLOAT:
            onnx.external_data_helper.set_external_data(tensor, location="a.onnx.data")
    onnx.save(model, str(graph))
    weights = tmp_path / "a.onnx.data"
    assert external_files(graph) == (weights.name,)
    with pytest.raises(InvalidInput, match=r"keeps weights in a\.onnx\.data, which its card does not list"):
        NetworkFolder(tmp_path / "added").add(write_card(graph))
    listed = [{"file": weights.name, "sha256": hashlib.sha256(weights.read_bytes()).hexdigest()}]
    card = write_card(graph, weights=listed)
    assert check_network(load_network(card)).passed
    added = NetworkFolder(tmp_path / "added").add(card)
    assert (added.folder / weights.name).read_bytes() == weights.read_bytes()
    assert check_network(added).passed
    (added.folder / weights.name).write_bytes(bytes(len(weights.read_bytes())))
    with pytest.raises(InvalidInput, match=r"SHA-256 of a\.onnx\.data"):
        NetworkEstimator.open(added)


def test_a_file_that_is_not_the_cards_is_refused_before_it_is_loaded(tmp_path: Path) -> None:
    network = load_network(write_card(matcher(tmp_path / "a.onnx")))
    network.graph.write_bytes(network.graph.read_bytes() + b" ")
    with pytest.raises(InvalidInput, match="SHA-256"):
        NetworkEstimator.open(network)
    network.graph.unlink()
    with pytest.raises(InvalidInput, match="put it beside the card"):
        NetworkEstimator.open(network)


def test_without_onnxruntime_one_sentence_says_how_to_get_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def missing(name: str) -> None:
        raise ImportError(name)

    monkeypatch.setattr(session, "import_module", missing)
    with pytest.raises(InvalidInput, match=r"pip install 'foveacam-duo\[onnx\]'"):
        NetworkEstimator.open(load_network(write_card(matcher(tmp_path / "a.onnx"))))


def test_a_picture_that_is_too_large_for_the_memory_is_told_with_the_remedy(tmp_path: Path) -> None:
    network = load_network(write_card(matcher(tmp_path / "a.onnx")))

    class Starved:
        def get_inputs(self) -> list[session.GraphPort]:
            return []

        def get_outputs(self) -> list[session.GraphPort]:
            return []

        def run(self, *_arguments: object) -> list[np.ndarray]:
            raise RuntimeError("bad allocation: Failed to allocate memory for requested buffer of size 9")

    estimator = NetworkEstimator(card=network.card, session=Starved())
    with pytest.raises(NetworkFault, match=r"not enough memory.*size_px"):
        estimator.estimate(known_pair().pair)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("- a list", "a table of keys"),
        ("a: [", "not YAML"),
        (example_card().replace("version: 1", "version: 2"), "version"),
        (example_card().replace("divisor: 32", "divisor: 0"), "inputs.divisor"),
        (example_card() + "weights: model.pkl\n", "weights"),
        (example_card().replace("my-network.onnx ", "../secret.onnx "), "file"),
        (example_card().replace("my-network.onnx ", "model.pt "), "file"),
    ],
)
def test_cards_that_cannot_be_read_are_refused_by_key(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "card.yaml"
    path.write_text(text)
    with pytest.raises(InvalidInput, match=words):
        load_network(path)


def test_the_example_is_a_card_and_a_fixed_size_is_a_list(tmp_path: Path) -> None:
    path = tmp_path / "card.yaml"
    path.write_text(example_card().replace("size_px: null", "size_px: [640, 448]"))
    assert load_network(path).card.inputs.size_px == (640, 448)


def test_disparities_of_a_pair_come_with_errors_and_without_what_only_one_eye_sees(tmp_path: Path) -> None:
    known = known_pair(416, 256)
    found = NetworkEstimator.open(load_network(write_card(matcher(tmp_path / "a.onnx")))).estimate(known.pair)
    answered = np.isfinite(found.residual_px)
    error = np.abs(found.residual_px - known.residual_px)[answered & known.seen]
    assert answered[known.seen].mean() > 0.9 and (error < 0.5).mean() > 0.99
    assert np.array_equal(np.isfinite(found.sigma_px), answered)
    hidden = ~known.seen & (known.residual_px < 0.0)
    assert answered[hidden].mean() < 0.6
    assert found.occluded is not None and found.occluded[64:192, 126:136].mean() > 0.5


def test_the_sigma_tells_a_network_that_is_off_by_less_than_a_pixel(tmp_path: Path) -> None:
    pair = known_pair().pair
    exact = NetworkEstimator.open(load_network(write_card(matcher(tmp_path / "a.onnx"))))
    off = replace(
        exact,
        card=exact.card.model_copy(update={"output": exact.card.output.model_copy(update={"scale": 1.06})}),
    )
    truth, wrong = exact.estimate(pair), off.estimate(pair)
    both = np.isfinite(truth.residual_px) & np.isfinite(wrong.residual_px)
    assert both.mean() > 0.5
    assert np.median(wrong.sigma_px[both]) > 2.0 * np.median(truth.sigma_px[both])


def test_a_sigma_of_the_network_replaces_the_error_model_and_decides_what_is_kept(tmp_path: Path) -> None:
    def stating(sigma: float, factor: float, power: float = 1.0) -> NetworkEstimator:
        graph = matcher(tmp_path / f"{sigma}.onnx", scale=2.0, sigma=sigma)
        output = {"scale": 2.0, "sigma": "sigma", "sigma_factor": factor, "sigma_power": power}
        return NetworkEstimator.open(load_network(write_card(graph, output=output)))

    known = known_pair()
    sure = stating(0.4, 0.5).estimate(known.pair)
    answered = np.isfinite(sure.residual_px)
    assert answered[known.seen].all() and np.unique(sure.sigma_px[answered]) == pytest.approx([0.4])
    curved = stating(0.4, 0.5, power=0.5).estimate(known.pair)
    assert np.unique(curved.sigma_px[answered]) == pytest.approx([0.5 * 0.8**0.5])
    # A Laplace error with a standard deviation of 2.366 px exceeds 1 px with probability 0.55
    assert np.isfinite(stating(1.18, 1.0).estimate(known.pair).residual_px).any()
    assert not np.isfinite(stating(1.19, 1.0).estimate(known.pair).residual_px).any()


@pytest.mark.parametrize(
    ("sigma", "words"),
    [(0.0, "100 % of its output sigma is not above 0"), (float("nan"), "output sigma is no")],
)
def test_a_sigma_that_is_no_error_is_refused_by_name(tmp_path: Path, sigma: float, words: str) -> None:
    found = checked(matcher(tmp_path / "a.onnx", sigma=sigma), output={"sigma": "sigma"})
    assert not found.passed and words in found.findings[-1].found
    found = checked(matcher(tmp_path / "b.onnx", sigma=0.5), output={"sigma": "spread"})
    assert "output.sigma is 'spread', the graph has disp, sigma" in found.findings[-1].found
    assert checked(matcher(tmp_path / "c.onnx", sigma=0.5), output={"sigma": "sigma"}).passed


@pytest.mark.parametrize(("opencv", "expected"), [(1, 1), (2, 0)])  # 0: onnxruntime's own choice
def test_a_process_whose_opencv_has_one_thread_runs_a_graph_with_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, opencv: int, expected: int
) -> None:
    monkeypatch.setattr(cv2, "getNumThreads", lambda: opencv)
    opened: Any = session.open_session(load_network(write_card(matcher(tmp_path / "a.onnx"))))
    assert opened.get_session_options().intra_op_num_threads == expected


def test_tiles_give_the_disparities_of_the_whole(tmp_path: Path) -> None:
    known = known_pair()
    graph = matcher(tmp_path / "a.onnx")
    whole = NetworkEstimator.open(load_network(write_card(graph)))
    tiled = NetworkEstimator.open(load_network(write_card(graph, inputs={"size_px": [160, 96]})))
    found, _ = tiled.answer(known.pair)
    inside = np.s_[20:-20, 20:-20]
    assert np.median(np.abs(found - whole.answer(known.pair)[0])[inside]) == 0.0


@pytest.mark.parametrize(("width", "height"), [(160, 96), (161, 97), (500, 300)])
def test_tiles_cover_every_pixel(width: int, height: int) -> None:
    covered = np.zeros((height, width))
    for tile in tiles(width, height, (160, 96)):
        rows, columns = np.s_[tile.y_px : tile.y_px + 96], np.s_[tile.x_px : tile.x_px + 160]
        assert covered[rows, columns].shape == tile.weight.shape
        covered[rows, columns] += tile.weight
    assert covered.min() > 0.0


def test_pictures_are_fed_as_the_card_says() -> None:
    picture = np.zeros((4, 6, 3), dtype=np.uint8)
    picture[..., 0], picture[..., 2] = 255, 51
    plain = to_tensor(picture, NetworkInputs())
    assert plain.shape == (1, 3, 4, 6) and plain[0, 0, 0, 0] == 255.0
    swapped = to_tensor(picture, NetworkInputs(order="BGR", layout="NHWC", scaling="0..1"))
    assert swapped.shape == (1, 4, 6, 3) and swapped[0, 0, 0].tolist() == pytest.approx([0.2, 0.0, 1.0])
    assert to_tensor(picture, NetworkInputs(scaling="-1..1"))[0, :, 0, 0].tolist() == pytest.approx(
        [1.0, -1.0, -0.6]
    )
    centred = to_tensor(picture, NetworkInputs(scaling="imagenet", order="BGR"))[0, :, 0, 0]
    assert centred.tolist() == pytest.approx(
        [(0.2 - 0.406) / 0.225, -0.456 / 0.224, (1 - 0.485) / 0.229], abs=1e-4
    )
    assert to_tensor(picture[..., 0], NetworkInputs()).shape == (1, 3, 4, 6)
    assert to_tensor(picture, NetworkInputs(channels=1)).shape == (1, 1, 4, 6)


def test_sides_grow_to_multiples_and_shifts_move_to_the_left() -> None:
    assert padded_size(720, 540, 32) == (736, 544)
    row = np.arange(6, dtype=np.uint8)[None]
    assert shifted_left(row, 2).tolist() == [[2, 3, 4, 5, 5, 5]]
    assert shifted_left(row, 0) is row


def test_the_known_pair_is_what_it_says() -> None:
    known = known_pair()
    found = match(known.pair).residual_px
    compared = np.isfinite(found) & known.seen
    assert compared.mean() > 0.8
    assert np.median(np.abs(found - known.residual_px)[compared]) < 0.05
