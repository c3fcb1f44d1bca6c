"""Training pairs: rectified by each dataset's own calibration, or read from a folder of pairs with truth.

They are cropped at random by seed. The shift adapter (`shifted_dataset`) moves right pictures until
disparities are positive, for unsigned networks.
"""

import hashlib
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import accumulate
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.capture.dataset.reader import Dataset
from foveacam_pipeline.learn.losses import PairBatch
from foveacam_pipeline.learn.network.geometry import mirrored_geometry, turned_geometry, view_geometry
from foveacam_pipeline.learn.pair_folder import DOCUMENT as PAIRS_DOCUMENT
from foveacam_pipeline.learn.pair_folder import PairSample, PairTruth, StoredPairs, is_pair_folder
from foveacam_pipeline.learn.recorded_pairs import is_recording, recorded_pairs, recording_digest
from foveacam_pipeline.networks.feeding import shifted_left
from foveacam_pipeline.stereo.values import RectifiedPair

SCALE = 0.5
LEAST_VALID = 0.5
"""Least valid share of a crop; crops with less are drawn again."""
DRAWS = 20
LARGEST_GAIN, LARGEST_OFFSET = 0.15, 0.05
"""Largest random change of each eye's brightness: of gain, and of offset as a share of full scale."""
DOCUMENT = "dataset.json"


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadedDataset:
    """The rectified pairs of one dataset; `digest` is the SHA-256 of its document.

    `labelled`: whether their truth is known.
    """

    name: str
    digest: str
    pairs: Sequence[PairSample]
    labelled: bool = False

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the pairs, px."""
        height, width = self.pairs[0].pair.left.shape[:2]
        return width, height


def load_datasets(folders: Sequence[Path]) -> tuple[LoadedDataset, ...]:
    """Return the pairs of datasets; raise InvalidInput for one without any, or given twice."""
    loaded = tuple(_load(folder) for folder in folders)
    names = [dataset.name for dataset in loaded]
    if len(set(names)) < len(names):
        raise InvalidInput(f"datasets {', '.join(names)}: one is named twice; give each once")
    return loaded


def _load(folder: Path) -> LoadedDataset:
    if is_recording(folder):
        return _load_recording(folder)
    return _load_labelled(folder) if is_pair_folder(folder) else _load_captured(folder)


def _load_recording(path: Path) -> LoadedDataset:
    verged = recorded_pairs(path, scale=SCALE)
    if not verged:
        raise InvalidInput(
            f"{path} has no verged pairs; record while the rig fixates or follows something nearby"
        )
    return LoadedDataset(name=path.stem, digest=recording_digest(path), pairs=verged)


def _load_labelled(folder: Path) -> LoadedDataset:
    pairs = StoredPairs(folder)
    if not pairs:
        raise InvalidInput(f"{folder} has no pairs yet; make them with `foveacam learn pairs --out {folder}`")
    digest = hashlib.sha256((folder / PAIRS_DOCUMENT).read_bytes()).hexdigest()
    return LoadedDataset(name=folder.name, digest=digest, pairs=pairs, labelled=True)


def _load_captured(folder: Path) -> LoadedDataset:
    dataset = Dataset.open(folder)
    if dataset.calibration is None:
        raise InvalidInput(f"{folder} has no calibration: it has no rectified pairs; leave it out")
    pairs = tuple(
        point.rectified(scale=SCALE, bracket=bracket) for point in dataset for bracket in point.brackets
    )
    verged = tuple(PairSample(pair=pair) for pair in pairs if np.isfinite(pair.verged_z_m))
    if not verged:
        raise InvalidInput(
            f"{folder} has no verged pairs ({len(pairs)} of parallel gazes): capture it at a distance, as "
            "with `foveacam capture --distance-m 8`"
        )
    digest = hashlib.sha256((folder / DOCUMENT).read_bytes()).hexdigest()
    return LoadedDataset(name=folder.name, digest=digest, pairs=verged)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Crop:
    left: NDArray[np.float32]
    right: NDArray[np.float32]
    valid: NDArray[np.bool_]
    disparity_px: NDArray[np.float32]
    """Zero where unknown."""
    known: NDArray[np.bool_]
    """Whether the disparity is known and both eyes see the pixel."""
    labelled: bool
    geometry: torch.Tensor


class CropSource:
    """Random crops of the pairs of all datasets; those of a step depend on seed and step alone."""

    def __init__(
        self, datasets: Sequence[LoadedDataset], *, size: tuple[int, int], batch: int, seed: int
    ) -> None:
        self._datasets = tuple(datasets)
        self._ends = list(accumulate(len(dataset.pairs) for dataset in datasets))
        self._size, self._batch, self._seed = size, batch, seed

    def batch(self, step: int) -> PairBatch:
        """Return the crops of a step."""
        rng = np.random.default_rng((self._seed, step))
        crops = [self._crop(rng) for _ in range(self._batch)]
        return PairBatch(
            left=torch.from_numpy(np.stack([crop.left for crop in crops])),
            right=torch.from_numpy(np.stack([crop.right for crop in crops])),
            valid_left=torch.from_numpy(np.stack([crop.valid for crop in crops])[:, None]),
            disparity_px=torch.from_numpy(np.stack([crop.disparity_px for crop in crops])[:, None]),
            known=torch.from_numpy(np.stack([crop.known for crop in crops])[:, None]),
            labelled=torch.tensor([crop.labelled for crop in crops]),
            geometry=torch.stack([crop.geometry for crop in crops]),
        )

    def _crop(self, rng: np.random.Generator) -> _Crop:
        width, height = self._size
        for _ in range(DRAWS):
            sample = self._sample(int(rng.integers(self._ends[-1])))
            y = int(rng.integers(sample.pair.left.shape[0] - height + 1))
            x = int(rng.integers(sample.pair.left.shape[1] - width + 1))
            window = np.s_[y : y + height, x : x + width]
            if sample.pair.valid_left[window].mean() >= LEAST_VALID:
                break
        return _varied_crop(sample, window, rng)

    def _sample(self, number: int) -> PairSample:
        dataset = bisect_right(self._ends, number)
        return self._datasets[dataset].pairs[number - (self._ends[dataset - 1] if dataset else 0)]


def _varied_crop(sample: PairSample, window: tuple[slice, slice], rng: np.random.Generator) -> _Crop:
    """Return a crop with varied brightness in each eye; half of them mirrored, with the eyes exchanged."""
    pair = sample.pair
    left, right = (_varied(picture[window], rng) for picture in (pair.left, pair.right))
    valid = pair.valid_left[window]
    geometry = view_geometry(pair, window)
    mirrored = rng.random() < 0.5
    if mirrored:  # the right eye is the left one, and every disparity keeps its sign
        left, right = right[:, :, ::-1], left[:, :, ::-1]
        valid = pair.valid_right[window][:, ::-1]
        geometry = mirrored_geometry(geometry)
    disparity_px, known = _known_disparity(sample.truth, window, mirrored=mirrored)
    known = known & valid
    turned = rng.random() < 0.5
    rows = slice(None, None, -1 if turned else 1)
    return _Crop(
        left=np.ascontiguousarray(left[:, rows]),
        right=np.ascontiguousarray(right[:, rows]),
        valid=np.ascontiguousarray(valid[rows]),
        disparity_px=np.ascontiguousarray(np.where(known, disparity_px, np.float32(0.0))[rows]),
        known=np.ascontiguousarray(known[rows]),
        labelled=sample.truth is not None,
        geometry=turned_geometry(geometry) if turned else geometry,
    )


def _known_disparity(
    truth: PairTruth | None, window: tuple[slice, slice], *, mirrored: bool
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return the true disparity, float32, px, of a crop, and where both eyes see it, both (h, w)."""
    if truth is None:
        shape = tuple(part.stop - part.start for part in window)
        return np.zeros(shape, np.float32), np.zeros(shape, np.bool_)
    if not mirrored:
        return truth.disparity_px[window], truth.both[window]
    disparity_px, known = right_truth(truth, window)
    return disparity_px[:, ::-1], known[:, ::-1]


def picture_planes(picture: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return (3, h, w) float32 of 0 to 1 of a grey or an RGB picture."""
    planes = np.repeat(picture[None], 3, axis=0) if picture.ndim == 2 else np.moveaxis(picture, 2, 0)
    return planes.astype(np.float32) / np.float32(255.0)


def _varied(picture: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.float32]:
    gain = 1.0 + rng.uniform(-LARGEST_GAIN, LARGEST_GAIN)
    offset = rng.uniform(-LARGEST_OFFSET, LARGEST_OFFSET)
    planes = picture_planes(picture) * np.float32(gain) + np.float32(offset)
    return np.asarray(np.clip(planes, 0.0, 1.0), dtype=np.float32)


def right_truth(
    truth: PairTruth, window: tuple[slice, slice]
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return the disparity of a window of the right picture, float32, px, and where it is known, both (h, w).

    Each pixel that both eyes see is moved to its column of the right picture, rounded; where several coincide
    the nearest is kept. Other pixels are unknown, and have 0.
    """
    rows, columns = window
    seen = truth.both[rows] & np.isfinite(truth.disparity_px[rows])
    height, width = seen.shape
    drawn_px = np.full((height, width), -np.inf, np.float32)
    y, x = np.nonzero(seen)
    disparity_px = truth.disparity_px[rows][y, x]
    x_right = np.rint(x - disparity_px).astype(np.intp)
    inside = (x_right >= 0) & (x_right < width)
    np.maximum.at(drawn_px, (y[inside], x_right[inside]), disparity_px[inside])
    known = np.isfinite(drawn_px)
    return np.where(known, drawn_px, np.float32(0.0))[:, columns], known[:, columns]


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
    """Return a dataset with every pair and its truth shifted."""
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
