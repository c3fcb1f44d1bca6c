"""The shift adapter: right pictures moved so far that disparities are positive, for unsigned networks."""

from dataclasses import replace

import numpy as np

from foveacam_pipeline.learn.pair_folder import PairSample, PairTruth
from foveacam_pipeline.learn.pairs import LoadedDataset
from foveacam_pipeline.networks.feeding import shifted_left
from foveacam_pipeline.stereo.values import RectifiedPair


def shifted_pair(pair: RectifiedPair, shift_px: int) -> RectifiedPair:
    """Return a pair whose right window begins farther right: every residual disparity grows by the shift."""
    valid_right = shifted_left(pair.valid_right.astype(np.uint8), shift_px) > 0
    if shift_px:
        valid_right[:, -shift_px:] = False
    return replace(
        pair,
        right=shifted_left(pair.right, shift_px),
        valid_right=valid_right,
        u0_right_px=pair.u0_right_px + shift_px,
    )


def shifted_dataset(dataset: LoadedDataset, shift_px: int) -> LoadedDataset:
    """Return a dataset with every pair shifted, and its truth."""
    pairs = tuple(_shifted(sample, shift_px) for sample in dataset.pairs)
    return replace(dataset, name=f"{dataset.name}, shifted", pairs=pairs)


def _shifted(sample: PairSample, shift_px: int) -> PairSample:
    pair, truth = shifted_pair(sample.pair, shift_px), sample.truth
    if truth is None:
        return PairSample(pair=pair)
    disparity_px = truth.disparity_px + np.float32(shift_px)
    inside = np.arange(disparity_px.shape[1]) - np.nan_to_num(disparity_px) >= 0.0
    both = truth.both & inside
    seen = truth.both | truth.occluded
    return PairSample(pair=pair, truth=PairTruth(disparity_px=disparity_px, both=both, occluded=seen & ~both))
