"""Pairs to train on in tests: a wall and a box of random texture, at signed disparities drawn by seed."""

from dataclasses import replace

import numpy as np

from foveacam_pipeline.learn.pairs import LoadedDataset
from foveacam_pipeline.networks.known_pair import known_pair
from foveacam_pipeline.stereo.values import RectifiedPair


def varied_pair(seed: int, width: int = 160, height: int = 96) -> RectifiedPair:
    """Return a window of the known pair, elsewhere for each seed."""
    rng = np.random.default_rng(seed)
    pair = known_pair(384, 256).pair
    y, x = int(rng.integers(256 - height)), int(rng.integers(384 - width))
    window = np.s_[y : y + height, x : x + width]
    return replace(
        pair,
        left=pair.left[window],
        right=pair.right[window],
        valid_left=pair.valid_left[window],
        valid_right=pair.valid_right[window],
    )


def scene(name: str, *, seed: int, pairs: int = 4) -> LoadedDataset:
    """Return a dataset of such pairs."""
    return LoadedDataset(
        name=name, digest=f"{seed:064x}", pairs=tuple(varied_pair(seed + number) for number in range(pairs))
    )
