"""Evaluation of a trained network on held-out pairs, beside semi-global matching and the truth."""

import math
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from itertools import takewhile

import numpy as np
import torch
from numpy.typing import NDArray
from torch.nn import functional

from foveacam_hardware.contract import Cancelled
from foveacam_pipeline.learn.device import one_thread
from foveacam_pipeline.learn.losses import laplace_scale, photometric_error, warped
from foveacam_pipeline.learn.network.correlation import consistent
from foveacam_pipeline.learn.network.geometry import view_geometry
from foveacam_pipeline.learn.network.network import DIVISOR, FoveatedStereo
from foveacam_pipeline.learn.network.refinement import CELL_PX
from foveacam_pipeline.learn.pair_folder import PairSample
from foveacam_pipeline.learn.pairs import LoadedDataset, picture_planes
from foveacam_pipeline.learn.truth_figures import (
    MethodAnswer,
    TruthFigures,
    TruthSums,
    filled,
    truth_figures,
    truth_sums,
)
from foveacam_pipeline.stereo.match import match
from foveacam_pipeline.stereo.values import RectifiedPair
from foveacam_pipeline.workers.pool import HereAndNow, WorkPool, results_in_order


@dataclass(frozen=True, slots=True, kw_only=True)
class MethodFigures:
    """Mean photometric errors of one method over all pairs, the only ones available without truth.

    They rank by similarity of the pictures, not by depth: a matcher that copies noise may beat the true
    disparity. A method that leaves holes is evaluated where it has a disparity.
    """

    method: str
    photometric: float
    """0.85 (1 - SSIM) / 2 + 0.15 L1 over all pixels that both windows show."""
    photometric_seen: float
    """The same where both eyes see the surface, by the truth, or else by the network's left-right check."""
    absolute: float
    """L1 alone."""
    truth: TruthFigures | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Evaluation:
    """The figures of all methods on one dataset."""

    dataset: str
    pairs: int
    methods: tuple[MethodFigures, ...]


def evaluate(
    network: FoveatedStereo,
    dataset: LoadedDataset,
    *,
    on_pair: Callable[[int, int], None],
    stopped: Callable[[], bool],
    pool: WorkPool | None = None,
) -> Evaluation:
    """Return the figures of a dataset; `pool` evaluates the pairs, else this process.

    Raise Cancelled when stopped before the first pair, WorkersLost.
    """
    rows: dict[str, list[PairErrors]] = {}
    done = 0
    todo = ((network, sample) for sample in takewhile(lambda _sample: not stopped(), dataset.pairs))
    with closing(results_in_order(pool or HereAndNow(), judge_pair, todo)) as results:
        for errors in results:
            for method, found in errors.items():
                rows.setdefault(method, []).append(found)
            done += 1
            on_pair(done, len(dataset.pairs))
    if not rows:
        raise Cancelled("the evaluation was stopped before its first pair")
    return Evaluation(
        dataset=dataset.name,
        pairs=done,
        methods=tuple(method_figures(method, found) for method, found in rows.items()),
    )


def judge_pair(network: FoveatedStereo, sample: PairSample) -> dict[str, "PairErrors"]:
    """Return the errors of one pair by method, bit-identical for any number of cores."""
    with one_thread():
        answer, agreed = network_answer(network, sample.pair)
        seen = agreed if sample.truth is None else sample.truth.both
        answers = other_answers(sample) | {"network": answer}
        return {method: pair_errors(sample, found, seen) for method, found in answers.items()}


def network_answer(network: FoveatedStereo, pair: RectifiedPair) -> tuple[MethodAnswer, NDArray[np.bool_]]:
    """Return the network's disparities of a pair, and where left and right agree, (h, w) bool."""
    height, width = pair.left.shape[:2]
    tensors = [torch.from_numpy(picture_planes(picture))[None] for picture in (pair.left, pair.right)]
    right, below = -width % DIVISOR, -height % DIVISOR
    padded = [functional.pad(tensor, (0, right, 0, below), mode="replicate") for tensor in tensors]
    with torch.no_grad():
        prediction = network(*padded, view_geometry(pair)[None])
        cells = consistent(prediction.matches.disparity, prediction.matches.scores)
        seen = functional.interpolate(cells.float(), scale_factor=float(CELL_PX), mode="nearest") > 0.5
    planes = (prediction.disparity, math.sqrt(2.0) * laplace_scale(prediction), seen)
    disparity, sigma, agreed = (plane[0, 0, :height, :width].numpy() for plane in planes)
    answer = MethodAnswer(disparity_px=np.ascontiguousarray(disparity), sigma_px=np.ascontiguousarray(sigma))
    return answer, agreed


def other_answers(sample: PairSample) -> dict[str, MethodAnswer]:
    """Return the disparities of other methods; with truth, also of raw matching and of the truth itself."""
    pair, truth = sample.pair, sample.truth
    found = match(pair)
    answers = {
        "zero": MethodAnswer(disparity_px=np.zeros_like(found.residual_px)),
        "sgbm, filled": MethodAnswer(disparity_px=filled(found.residual_px), sigma_px=found.sigma_px),
    }
    if truth is not None:
        answers["sgbm"] = MethodAnswer(disparity_px=found.residual_px, sigma_px=found.sigma_px)
        answers["truth"] = MethodAnswer(disparity_px=truth.disparity_px)
    return answers


@dataclass(frozen=True, slots=True, kw_only=True)
class PairErrors:
    """Photometric errors of one pair: all, seen by both eyes, L1; and sums against the truth, if any."""

    photometric: tuple[float, float, float]
    truth: TruthSums | None


def pair_errors(sample: PairSample, answer: MethodAnswer, seen: NDArray[np.bool_]) -> PairErrors:
    """Return the errors of a method on one pair; `seen`: (h, w), where both eyes see the surface."""
    pair, disparity = sample.pair, answer.disparity_px
    left, right = (torch.from_numpy(picture_planes(picture))[None] for picture in (pair.left, pair.right))
    known = np.isfinite(disparity)
    rebuilt, inside = warped(right, torch.from_numpy(np.nan_to_num(disparity))[None, None])
    shown = inside & torch.from_numpy(pair.valid_left & known)[None, None]
    error = photometric_error(left, rebuilt)
    absolute = (left - rebuilt).abs().mean(dim=1, keepdim=True)
    both = shown & torch.from_numpy(seen)[None, None]
    photometric = float(error[shown].mean()), float(error[both].mean()), float(absolute[shown].mean())
    return PairErrors(
        photometric=photometric,
        truth=None if sample.truth is None else truth_sums(answer, sample.truth, offset_px=pair.offset_px),
    )


def method_figures(method: str, rows: Sequence[PairErrors]) -> MethodFigures:
    """Return the figures of a method by its errors on all pairs."""
    columns = zip(*(row.photometric for row in rows), strict=True)
    photometric, seen, absolute = (float(np.nanmean(column)) for column in columns)
    return MethodFigures(
        method=method,
        photometric=photometric,
        photometric_seen=seen,
        absolute=absolute,
        truth=truth_figures([row.truth for row in rows if row.truth is not None]),
    )
