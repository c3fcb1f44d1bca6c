"""Pairs to train on in tests: a wall and a box of random texture, at signed disparities drawn by seed."""

from dataclasses import replace

import numpy as np

from foveacam_pipeline.learn.pair_folder import PairSample, PairTruth
from foveacam_pipeline.learn.pairs import LoadedDataset
from foveacam_pipeline.networks.known_pair import known_pair
from foveacam_pipeline.stereo.values import RectifiedPair


def varied_pair(seed: int, width: int = 160, height: int = 96) -> RectifiedPair:
    """Return a window of the known pair, elsewhere for each seed."""
    return varied_sample(seed, width, height).pair


def varied_sample(seed: int, width: int = 160, height: int = 96) -> PairSample:
    """Return such a window with its truth."""
    rng = np.random.default_rng(seed)
    known = known_pair(384, 256)
    pair = known.pair
    y, x = int(rng.integers(256 - height)), int(rng.integers(384 - width))
    window = np.s_[y : y + height, x : x + width]
    window_pair = replace(
        pair,
        left=pair.left[window],
        right=pair.right[window],
        valid_left=pair.valid_left[window],
        valid_right=pair.valid_right[window],
    )
    columns = np.arange(width) - known.residual_px[window]
    both = known.seen[window] & (columns >= 0) & (columns <= width - 1)
    truth = PairTruth(disparity_px=known.residual_px[window], both=both, occluded=~both)
    return PairSample(pair=window_pair, truth=truth)


def scene(name: str, *, seed: int, pairs: int = 4, labelled: bool = False) -> LoadedDataset:
    """Return a dataset of such pairs, with their truth or without."""
    samples = [varied_sample(seed + number) for number in range(pairs)]
    return LoadedDataset(
        name=name,
        digest=f"{seed:064x}",
        pairs=tuple(samples if labelled else [PairSample(pair=sample.pair) for sample in samples]),
        labelled=labelled,
    )
