"""Judges a trained network on pairs that it was not trained on, beside semi-global matching and the truth."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch.nn import functional

from foveacam_hardware.contract import Cancelled
from foveacam_pipeline.learn.losses import laplace_scale, photometric_error, warped
from foveacam_pipeline.learn.network.correlation import consistent
from foveacam_pipeline.learn.network.geometry import view_geometry
from foveacam_pipeline.learn.network.network import DIVISOR, FoveatedStereo
from foveacam_pipeline.learn.network.refinement import CELL_PX
from foveacam_pipeline.learn.pair_folder import PairSample
from foveacam_pipeline.learn.pairs import LoadedDataset, picture_planes
from foveacam_pipeline.stereo.match import match
from foveacam_pipeline.stereo.values import RectifiedPair

LEAST_TOTAL_PX = 1.0
"""Of a depth: what lies at infinity or beyond counts as this total disparity."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TruthFigures:
    """Errors against the truth where both eyes see the surface, over all pairs."""

    epe_px: float
    """Mean of the absolute errors of what is answered."""
    bad_1: float
    """Share of errors above 1 px."""
    answered: float
    """Share of the pixels with a disparity."""
    within_1_sigma: float | None = None
    """Share of errors within the stated sigma; 0.757 would be right for a Laplace error, 0.683 for a Gaussian
    one. None for a method that states none."""
    abs_rel: float = 0.0
    """Mean of the absolute errors of depth over the true depth."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MethodFigures:
    """Mean photometric errors of one method, over all pairs; without truth they alone can be told.

    They rank by how alike the pictures are, not by depth: a matcher that copies noise may beat the true
    disparity. A method that leaves holes is judged by what it answers.
    """

    method: str
    photometric: float
    """0.85 (1 - SSIM) / 2 + 0.15 L1 over all pixels that both windows show."""
    photometric_seen: float
    """The same where both eyes see the surface, by the truth, or else by the network's own check of left and
    right."""
    absolute: float
    """L1 alone."""
    truth: TruthFigures | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Evaluation:
    """The figures of all methods on one dataset."""

    dataset: str
    pairs: int
    methods: tuple[MethodFigures, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MethodAnswer:
    """Disparity (h, w) of a method, px, and the standard deviation of its error, px; NaN where unknown."""

    disparity_px: NDArray[np.float32]
    sigma_px: NDArray[np.float32] | None = None


def evaluate(
    network: FoveatedStereo,
    dataset: LoadedDataset,
    *,
    on_pair: Callable[[int, int], None],
    stopped: Callable[[], bool],
) -> Evaluation:
    """Return the figures of a dataset; raise Cancelled when stopped before the first pair."""
    rows: dict[str, list[PairErrors]] = {}
    done = 0
    for sample in dataset.pairs:
        if stopped():
            break
        answer, agreed = network_answer(network, sample.pair)
        seen = agreed if sample.truth is None else sample.truth.both
        for method, found in (other_answers(sample) | {"network": answer}).items():
            rows.setdefault(method, []).append(pair_errors(sample, found, seen))
        done += 1
        on_pair(done, len(dataset.pairs))
    if not rows:
        raise Cancelled("the evaluation was stopped before its first pair")
    return Evaluation(
        dataset=dataset.name,
        pairs=done,
        methods=tuple(method_figures(method, found) for method, found in rows.items()),
    )


def network_answer(network: FoveatedStereo, pair: RectifiedPair) -> tuple[MethodAnswer, NDArray[np.bool_]]:
    """Return what the network says of a pair, and where left and right agree, (h, w) bool."""
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
    """Return what the other methods say; raw matching and the truth itself only where there is a truth."""
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


def filled(disparity_px: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return a disparity map (h, w) whose holes have the smaller of the next known ones in their row.

    The smaller one belongs to what is behind, and it is that which is hidden. Rows without any get zero.
    """
    known = np.isfinite(disparity_px)
    before = _carried(disparity_px, known)
    after = _carried(disparity_px[:, ::-1], known[:, ::-1])[:, ::-1]
    behind = np.fmin(before, after)
    return np.nan_to_num(np.where(known, disparity_px, behind)).astype(np.float32)


def _carried(values: NDArray[np.float32], known: NDArray[np.bool_]) -> NDArray[np.float32]:
    place = np.where(known, np.arange(values.shape[1])[None, :], 0)
    np.maximum.accumulate(place, axis=1, out=place)
    return np.take_along_axis(values, place, axis=1)


@dataclass(frozen=True, slots=True, kw_only=True)
class PairErrors:
    """Photometric errors of one pair: all, seen by both eyes, L1; and sums of pixels against the truth."""

    photometric: tuple[float, float, float]
    seen: int = 0
    answered: int = 0
    off_px: float = 0.0
    bad: int = 0
    with_sigma: int = 0
    within: int = 0
    off_rel: float = 0.0


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
    if sample.truth is None:
        return PairErrors(photometric=photometric)
    judged = sample.truth.both & known
    off_px = np.abs(disparity - sample.truth.disparity_px)[judged]
    total_px = np.maximum(disparity[judged] + pair.offset_px, LEAST_TOTAL_PX)
    sigma_px = np.zeros(0, np.float32) if answer.sigma_px is None else answer.sigma_px[judged]
    stated = np.isfinite(sigma_px)
    return PairErrors(
        photometric=photometric,
        seen=int(sample.truth.both.sum()),
        answered=len(off_px),
        off_px=float(off_px.sum(dtype=np.float64)),
        bad=int((off_px > 1.0).sum()),
        with_sigma=int(stated.sum()),
        within=int((off_px[: len(stated)][stated] <= sigma_px[stated]).sum()),
        off_rel=float((off_px / total_px).sum(dtype=np.float64)),
    )


def method_figures(method: str, rows: Sequence[PairErrors]) -> MethodFigures:
    """Return the figures of a method by its errors on all pairs."""
    columns = zip(*(row.photometric for row in rows), strict=True)
    photometric, seen, absolute = (float(np.nanmean(column)) for column in columns)
    pixels, answered = sum(row.seen for row in rows), sum(row.answered for row in rows)
    stated = sum(row.with_sigma for row in rows)
    truth = TruthFigures(
        epe_px=sum(row.off_px for row in rows) / max(1, answered),
        bad_1=sum(row.bad for row in rows) / max(1, answered),
        answered=answered / max(1, pixels),
        within_1_sigma=sum(row.within for row in rows) / stated if stated else None,
        abs_rel=sum(row.off_rel for row in rows) / max(1, answered),
    )
    return MethodFigures(
        method=method,
        photometric=photometric,
        photometric_seen=seen,
        absolute=absolute,
        truth=truth if pixels else None,
    )
