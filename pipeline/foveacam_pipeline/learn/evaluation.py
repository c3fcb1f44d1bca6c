"""Judges a trained network on pairs that it was not trained on, beside semi-global matching."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch.nn import functional

from foveacam_hardware.contract import Cancelled
from foveacam_pipeline.learn.losses import photometric_error, warped
from foveacam_pipeline.learn.network.correlation import consistent
from foveacam_pipeline.learn.network.network import DIVISOR, FoveatedStereo
from foveacam_pipeline.learn.network.refinement import CELL_PX
from foveacam_pipeline.learn.pairs import LoadedDataset, picture_planes
from foveacam_pipeline.stereo.match import match
from foveacam_pipeline.stereo.values import RectifiedPair


@dataclass(frozen=True, slots=True, kw_only=True)
class MethodFigures:
    """Mean photometric errors of one method, over all pairs; without truth they alone can be told.

    They rank by how alike the pictures are, not by depth: a matcher that copies noise may beat the true
    disparity.
    """

    method: str
    photometric: float
    """0.85 (1 - SSIM) / 2 + 0.15 L1 over all pixels that both windows show."""
    photometric_seen: float
    """The same where both eyes see the surface, by the network's own check of left and right."""
    absolute: float
    """L1 alone."""


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
) -> Evaluation:
    """Return the figures of a dataset; raise Cancelled when stopped before the first pair."""
    rows: dict[str, list[tuple[float, float, float]]] = {"zero": [], "sgbm, filled": [], "network": []}
    for number, pair in enumerate(dataset.pairs):
        if stopped():
            break
        found, seen = network_disparity(network, pair)
        candidates = {
            "zero": np.zeros_like(found),
            "sgbm, filled": filled(match(pair).residual_px),
            "network": found,
        }
        for method, disparity in candidates.items():
            rows[method].append(_errors(pair, disparity, seen))
        on_pair(number + 1, len(dataset.pairs))
    if not rows["zero"]:
        raise Cancelled("the evaluation was stopped before its first pair")
    return Evaluation(
        dataset=dataset.name,
        pairs=len(rows["zero"]),
        methods=tuple(_figures(method, found) for method, found in rows.items()),
    )


def network_disparity(
    network: FoveatedStereo, pair: RectifiedPair
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return the disparity (h, w) of a pair, px, and where left and right agree, (h, w) bool."""
    height, width = pair.left.shape[:2]
    tensors = [torch.from_numpy(picture_planes(picture))[None] for picture in (pair.left, pair.right)]
    right, below = -width % DIVISOR, -height % DIVISOR
    padded = [functional.pad(tensor, (0, right, 0, below), mode="replicate") for tensor in tensors]
    with torch.no_grad():
        prediction = network(*padded)
        cells = consistent(prediction.matches.disparity, prediction.matches.scores)
        seen = functional.interpolate(cells.float(), scale_factor=float(CELL_PX), mode="nearest") > 0.5
    disparity = prediction.disparity[0, 0, :height, :width].numpy()
    return np.ascontiguousarray(disparity), seen[0, 0, :height, :width].numpy()


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


def _errors(
    pair: RectifiedPair, disparity: NDArray[np.float32], seen: NDArray[np.bool_]
) -> tuple[float, float, float]:
    left, right = (torch.from_numpy(picture_planes(picture))[None] for picture in (pair.left, pair.right))
    rebuilt, inside = warped(right, torch.from_numpy(disparity)[None, None])
    shown = inside & torch.from_numpy(pair.valid_left)[None, None]
    error = photometric_error(left, rebuilt)
    absolute = (left - rebuilt).abs().mean(dim=1, keepdim=True)
    both = shown & torch.from_numpy(seen)[None, None]
    return float(error[shown].mean()), float(error[both].mean()), float(absolute[shown].mean())


def _figures(method: str, rows: Sequence[tuple[float, float, float]]) -> MethodFigures:
    photometric, seen, absolute = (float(np.nanmean(column)) for column in zip(*rows, strict=True))
    return MethodFigures(method=method, photometric=photometric, photometric_seen=seen, absolute=absolute)
