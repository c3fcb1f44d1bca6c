"""Pairs to train on: rectified by each dataset's own calibration, in memory, cropped at random by seed."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.capture.dataset.reader import Dataset
from foveacam_pipeline.learn.losses import PairBatch
from foveacam_pipeline.stereo.values import RectifiedPair

SCALE = 0.5
LEAST_VALID = 0.5
"""A crop of which less looks at something is drawn again."""
DRAWS = 20
LARGEST_GAIN, LARGEST_OFFSET = 0.15, 0.05
"""Random change of each eye's brightness: of its gain, and added, of the full scale."""
DOCUMENT = "dataset.json"


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadedDataset:
    """The rectified pairs of one dataset; `digest` is the SHA-256 of its document."""

    name: str
    digest: str
    pairs: tuple[RectifiedPair, ...]


def load_datasets(folders: Sequence[Path]) -> tuple[LoadedDataset, ...]:
    """Return the pairs of datasets; raise InvalidInput for one without, of another size, or given twice."""
    loaded = tuple(_load(folder) for folder in folders)
    names = [dataset.name for dataset in loaded]
    if len(set(names)) < len(names):
        raise InvalidInput(f"datasets {', '.join(names)}: one is named twice; give each once")
    sizes = {dataset.name: dataset.pairs[0].left.shape[:2] for dataset in loaded}
    if len(set(sizes.values())) > 1:
        listed = ", ".join(f"{name} {width} x {height}" for name, (height, width) in sizes.items())
        raise InvalidInput(f"pairs of different sizes, px: {listed}; train on datasets of one rig")
    return loaded


def _load(folder: Path) -> LoadedDataset:
    dataset = Dataset.open(folder)
    if dataset.calibration is None:
        raise InvalidInput(f"{folder} has no calibration: it has no rectified pairs; leave it out")
    pairs = tuple(
        point.rectified(scale=SCALE, bracket=bracket) for point in dataset for bracket in point.brackets
    )
    verged = tuple(pair for pair in pairs if np.isfinite(pair.verged_z_m))
    if not verged:
        raise InvalidInput(
            f"{folder} has no verged pairs ({len(pairs)} of parallel gazes): capture it at a distance, as "
            "with `foveacam capture --distance-m 8`"
        )
    digest = hashlib.sha256((folder / DOCUMENT).read_bytes()).hexdigest()
    return LoadedDataset(name=folder.name, digest=digest, pairs=verged)


class CropSource:
    """Random crops of the pairs of all datasets; the crops of a step depend on seed and step alone."""

    def __init__(
        self, datasets: Sequence[LoadedDataset], *, size: tuple[int, int], batch: int, seed: int
    ) -> None:
        self._pairs = [pair for dataset in datasets for pair in dataset.pairs]
        self._size, self._batch, self._seed = size, batch, seed

    def batch(self, step: int) -> PairBatch:
        """Return the crops of a step."""
        rng = np.random.default_rng((self._seed, step))
        crops = [self._crop(rng) for _ in range(self._batch)]
        left, right, valid = (np.stack(planes) for planes in zip(*crops, strict=True))
        return PairBatch(
            left=torch.from_numpy(left),
            right=torch.from_numpy(right),
            valid_left=torch.from_numpy(valid[:, None]),
        )

    def _crop(
        self, rng: np.random.Generator
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_]]:
        width, height = self._size
        for _ in range(DRAWS):
            pair = self._pairs[rng.integers(len(self._pairs))]
            y = int(rng.integers(pair.left.shape[0] - height + 1))
            x = int(rng.integers(pair.left.shape[1] - width + 1))
            window = np.s_[y : y + height, x : x + width]
            if pair.valid_left[window].mean() >= LEAST_VALID:
                break
        return self._varied(pair, window, rng)

    def _varied(
        self, pair: RectifiedPair, window: tuple[slice, slice], rng: np.random.Generator
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_]]:
        """Return a crop with other brightness in each eye; half of them mirrored, with the eyes exchanged."""
        left, right = (_varied(picture[window], rng) for picture in (pair.left, pair.right))
        valid = pair.valid_left[window]
        if rng.random() < 0.5:
            # Mirrored, the right eye is the left one, and every disparity keeps its sign
            left, right = right[:, :, ::-1], left[:, :, ::-1]
            valid = pair.valid_right[window][:, ::-1]
        if rng.random() < 0.5:
            left, right, valid = left[:, ::-1], right[:, ::-1], valid[::-1]
        return np.ascontiguousarray(left), np.ascontiguousarray(right), np.ascontiguousarray(valid)


def picture_planes(picture: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return (3, h, w) float32 of 0 to 1 of a grey or an RGB picture."""
    planes = np.repeat(picture[None], 3, axis=0) if picture.ndim == 2 else np.moveaxis(picture, 2, 0)
    return planes.astype(np.float32) / np.float32(255.0)


def _varied(picture: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.float32]:
    gain = 1.0 + rng.uniform(-LARGEST_GAIN, LARGEST_GAIN)
    offset = rng.uniform(-LARGEST_OFFSET, LARGEST_OFFSET)
    planes = picture_planes(picture) * np.float32(gain) + np.float32(offset)
    return np.asarray(np.clip(planes, 0.0, 1.0), dtype=np.float32)
