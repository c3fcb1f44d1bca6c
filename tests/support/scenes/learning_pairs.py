"""Pairs to train on in tests: a wall and a box of random texture, at signed disparities drawn by seed."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from foveacam_pipeline.learn.pair_folder import (
    PairDocument,
    PairEntry,
    PairFolderWriter,
    PairSample,
    PairTruth,
    Split,
    arrays_sha256,
    pair_arrays,
)
from foveacam_pipeline.learn.pairs import LoadedDataset
from foveacam_pipeline.learn.training import TrainingWatcher
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


def stored(folder: Path, samples: list[PairSample]) -> Path:
    """Write samples as a folder of pairs."""
    plan = PairDocument(
        seed=0,
        split=Split.TRAIN,
        rig_preset="none",
        calibration_id="none",
        width=samples[0].pair.left.shape[1] if samples else 160,
        height=samples[0].pair.left.shape[0] if samples else 96,
        scale=0.25,
        f_px=14_000.0,
        baseline_m=0.2,
    )
    writer = PairFolderWriter(folder, plan)
    for sample in samples:
        assert sample.truth is not None
        arrays = pair_arrays(sample.pair, sample.truth)
        entry = PairEntry(
            scene_seed=0,
            sha256=arrays_sha256(arrays),
            verged_z_m=sample.pair.verged_z_m,
            u0_left_px=sample.pair.u0_left_px,
            u0_right_px=sample.pair.u0_right_px,
            v0_px=sample.pair.v0_px,
            pose_sigma_px=sample.pair.pose_sigma_px,
            row_error_px=0.0,
        )
        writer.add(entry, arrays)
    writer.flush()
    return folder


def watcher(*, stop_after: int | None = None) -> TrainingWatcher:
    """Return a watcher that stops a training after so many steps."""
    done = [0]

    def count(step: int, _steps: int, _loss: float) -> None:
        done[0] = step

    return TrainingWatcher(on_step=count, stopped=lambda: stop_after is not None and done[0] >= stop_after)
