"""Raster datasets for PyTorch: one item for each pair, rectified by the dataset's own calibration on access.

torch is imported when `torch_dataset` is called, not before; `PairIndex` works without it.
"""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from itertools import accumulate
from pathlib import Path
from types import ModuleType
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, install_command
from foveacam_pipeline.capture.dataset.reader import Dataset
from foveacam_pipeline.stereo.rectify import SCALES
from foveacam_pipeline.stereo.values import RectifiedPair


class TorchDataset(Protocol):
    """The interface that `torch.utils.data.DataLoader` needs of a dataset."""

    def __len__(self) -> int:
        """Return the number of items."""

    def __getitem__(self, index: int) -> dict[str, object]:
        """Return one item."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PairPlace:
    """Index of a pair: its dataset, its point (by position in it), and its bracket."""

    dataset: int
    position: int
    bracket: int


class PairIndex:
    """Numbers the pairs of several datasets: each point and bracket is one."""

    def __init__(self, datasets: Sequence[Dataset]) -> None:
        self._places = [
            [(position, bracket) for position, point in enumerate(dataset) for bracket in point.brackets]
            for dataset in datasets
        ]
        self._ends = list(accumulate(len(places) for places in self._places))

    def __len__(self) -> int:
        return self._ends[-1] if self._ends else 0

    def __getitem__(self, index: int) -> PairPlace:
        count = len(self)
        if not -count <= index < count:
            raise IndexError(f"pair {index} was asked for, there are {count}")
        index %= count
        dataset = bisect_right(self._ends, index)
        position, bracket = self._places[dataset][index - (self._ends[dataset - 1] if dataset else 0)]
        return PairPlace(dataset=dataset, position=position, bracket=bracket)


def torch_dataset(paths: Sequence[str | Path], *, scale: float = 0.5) -> TorchDataset:
    """Return a `torch.utils.data.Dataset` of the pairs of all datasets; raise InvalidInput without torch.

    An item: `left`, `right` (c, h, w) float32 in 0..1; `valid_left`, `valid_right` (h, w) bool; `f_px`,
    `baseline_m`, `offset_px` float32 (total disparity = residual + offset); `dataset`, `point` and `bracket`.
    """
    torch = _torch()
    if scale not in SCALES:
        raise InvalidInput(f"pairs at scale {scale!r}: 0.5 or 1.0 is needed")
    datasets = [Dataset.open(path) for path in paths]
    for dataset in datasets:
        if dataset.calibration is None:
            raise InvalidInput(
                f"{dataset.folder} has no calibration: it has no rectified pairs; leave it out"
            )
    index = PairIndex(datasets)

    class RasterPairs(torch.utils.data.Dataset):  # type: ignore[name-defined,misc]  # torch may be missing
        """Items are rectified in the process that asks for them, so that workers share the work."""

        def __reduce__(self) -> tuple[object, ...]:
            """Pickle as the paths, so that a worker that is not forked opens the datasets itself."""
            return _opened, ([dataset.folder for dataset in datasets], scale)

        def __len__(self) -> int:
            return len(index)

        def __getitem__(self, number: int) -> dict[str, object]:
            place = index[number]
            point = datasets[place.dataset][place.position]
            item = pair_arrays(point.rectified(scale=scale, bracket=place.bracket))
            tensors = {name: torch.from_numpy(value) for name, value in item.items()}
            return {**tensors, "dataset": place.dataset, "point": point.index, "bracket": place.bracket}

    return RasterPairs()


def _opened(paths: Sequence[Path], scale: float) -> TorchDataset:
    return torch_dataset(paths, scale=scale)


def pair_arrays(pair: RectifiedPair) -> dict[str, NDArray[np.generic]]:
    """Return the arrays of one item."""
    return {
        "left": _planes(pair.left),
        "right": _planes(pair.right),
        "valid_left": pair.valid_left,
        "valid_right": pair.valid_right,
        "f_px": np.array(pair.f_px, dtype=np.float32),
        "baseline_m": np.array(pair.baseline_m, dtype=np.float32),
        "offset_px": np.array(pair.offset_px, dtype=np.float32),
    }


def _planes(image: NDArray[np.uint8]) -> NDArray[np.float32]:
    planes = image[None] if image.ndim == 2 else np.moveaxis(image, 2, 0)
    return np.ascontiguousarray(planes, dtype=np.float32) / np.float32(255.0)


def _torch() -> ModuleType:
    try:
        import_module("torch.utils.data")
        return import_module("torch")
    except ImportError as error:
        raise InvalidInput(
            f"a dataset for PyTorch needs torch, which is not installed; {install_command('learn')}"
        ) from error
