"""Checks of a network without truth: exchanged eyes, shifted pictures, and the same graph run by torch."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from importlib.util import find_spec

import numpy as np
from numpy.typing import NDArray

from foveacam_bench.figures import Figures
from foveacam_pipeline.learn.pair_folder import PairSample
from foveacam_pipeline.networks.card import StereoNetwork
from foveacam_pipeline.networks.estimator import NetworkEstimator
from foveacam_pipeline.networks.feeding import shifted_left
from foveacam_pipeline.stereo.values import RectifiedPair

Floats = NDArray[np.float32]
CELLS_PX, PIXELS_PX = (4, 8, 16), (1, 2, 3, 5)
"""Shifts of the right picture by whole cells of a quarter of the size, and by other numbers of pixels."""


def invariance_figures(
    estimator: NetworkEstimator, network: StereoNetwork, samples: Sequence[PairSample]
) -> Figures:
    """Return medians over the pixels that both eyes see, px, and how far torch and onnxruntime are apart."""
    return {
        "flip_symmetry_px": _median(flip_errors(estimator, sample) for sample in samples),
        "shift_equivariance_cells_px": _median(
            shift_errors(estimator, sample, shifts_px=CELLS_PX) for sample in samples
        ),
        "shift_equivariance_pixels_px": _median(
            shift_errors(estimator, sample, shifts_px=PIXELS_PX) for sample in samples
        ),
        **torch_agreement(estimator, network, samples),
    }


def flip_errors(estimator: NetworkEstimator, sample: PairSample) -> Floats:
    """Return (n,) px: the left eye's disparity against the right eye's of the same point.

    The right eye's comes from the mirrored pictures with the eyes exchanged, which have the same disparities.
    """
    left = estimator.answer(sample.pair)[0]
    right = estimator.answer(sample.pair.mirrored())[0][:, ::-1]
    rows, columns = np.nonzero(_judged(sample))
    at = np.rint(columns - left[rows, columns]).astype(np.intp)
    inside = (at >= 0) & (at < left.shape[1])
    off_px: Floats = left[rows, columns] - right[rows, np.clip(at, 0, left.shape[1] - 1)]
    return np.asarray(np.abs(off_px)[inside], dtype=np.float32)


def shift_errors(estimator: NetworkEstimator, sample: PairSample, *, shifts_px: Sequence[int]) -> Floats:
    """Return (n,) px: deviation of the disparity's change from the shift of the right picture."""
    pair = sample.pair
    before, judged = estimator.answer(pair)[0], _judged(sample)
    columns = np.arange(before.shape[1], dtype=np.float32)[None, :]
    errors = []
    for shift_px in shifts_px:
        moved = replace(pair, right=shifted_left(pair.right, shift_px))
        stays = judged & (columns - before >= shift_px)
        errors.append(np.abs(estimator.answer(moved)[0] - before - np.float32(shift_px))[stays])
    return np.concatenate(errors)


def torch_agreement(
    estimator: NetworkEstimator, network: StereoNetwork, samples: Sequence[PairSample]
) -> Figures:
    """Return the largest and the median difference of both, px, over the first pair, or why there is none."""
    if find_spec("torch") is None or find_spec("onnx") is None:
        return _agreement(skipped="torch and onnx are not installed (the extra `learn`)")
    by_torch = _by_torch(network)
    if by_torch is None:
        return _agreement(skipped=f"the weights of {network.card.file} fit no size of the network")
    pair = samples[0].pair
    off_px = np.abs(by_torch(pair) - estimator.answer_once(pair)[0])
    return _agreement(largest_px=float(off_px.max()), median_px=float(np.median(off_px)))


def _agreement(
    *, largest_px: float | None = None, median_px: float | None = None, skipped: str | None = None
) -> Figures:
    return {
        "torch_onnx_max_px": largest_px,
        "torch_onnx_median_px": median_px,
        "torch_onnx_skipped": skipped,
    }


def _by_torch(network: StereoNetwork) -> Callable[[RectifiedPair], Floats] | None:
    """Return the network of a graph as `learn export` writes it, run by torch; None for any other graph."""
    from foveacam_pipeline.learn.evaluation import network_answer
    from foveacam_pipeline.learn.export import network_of_graph

    model = network_of_graph(network.graph)
    return None if model is None else lambda pair: network_answer(model, pair)[0].disparity_px


def _judged(sample: PairSample) -> NDArray[np.bool_]:
    return sample.pair.valid_left if sample.truth is None else sample.truth.both


def _median(parts: Iterable[Floats]) -> float:
    return float(np.median(np.concatenate(list(parts))))
