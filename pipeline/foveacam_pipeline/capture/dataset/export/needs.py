"""What an export needs before it begins: whether it is possible, and the disk space that it takes at most."""

from collections.abc import Callable

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.capture.dataset.export.hugging_face import pyarrow_modules
from foveacam_pipeline.capture.dataset.export.views import pose_calibration
from foveacam_pipeline.capture.dataset.reader import Dataset

LEVELS = 4.0 / 3.0
"""Size of all levels of a picture, each with a quarter of the pixels, relative to the first."""
RECORD_BYTES = 4096
"""Size of the texts about one picture: a row, a pose, its pixels of seeds."""
AUTHORS_BYTES = 7
"""Bytes per fovea pixel: three pictures of 16 bits, and a part of the wide view."""


def check_export(dataset: Dataset, to: str) -> None:
    """Raise `InvalidInput` or `NotCalibrated` where a dataset cannot be exported to a known format."""
    if len(dataset) == 0:
        raise InvalidInput(f"dataset {dataset.folder.name} has no points yet: nothing to export")
    _NEEDS[to](dataset)


def largest_bytes(dataset: Dataset, to: str) -> int:
    """Return the largest size of an export to a known format: as if no picture could be compressed."""
    pictures = sum(len(point.frames) for point in dataset)
    return round(_SIZES[to](dataset)) + RECORD_BYTES * pictures


def _no_needs(_dataset: Dataset) -> None:
    """Need nothing."""


def _raw_bytes(dataset: Dataset) -> float:
    """Return the size of all pictures, not compressed."""
    return sum(
        frame.width * frame.height * frame.channels * (1 if frame.bits <= 8 else 2)
        for point in dataset
        for frame in point.frames
    )


def _fovea_samples(dataset: Dataset) -> float:
    """Return the samples of one warped picture of each point, over all points."""
    calibration = pose_calibration(dataset)
    pixels = calibration.fovea_width * calibration.fovea_height
    return sum(pixels * max(frame.channels for frame in point.frames) for point in dataset)


def _wide_samples(dataset: Dataset) -> float:
    return sum(
        frame.width * frame.height * frame.channels
        for point in dataset
        for frame in point.frames
        if frame.role is Role.WIDE
    )


_NEEDS: dict[str, Callable[[Dataset], object]] = {
    "hugging-face": lambda _: pyarrow_modules(),
    "colmap": pose_calibration,
    "nerfstudio": pose_calibration,
    "ome-zarr": _no_needs,
    "authors": pose_calibration,
}
_SIZES: dict[str, Callable[[Dataset], float]] = {
    "hugging-face": _raw_bytes,
    "colmap": lambda dataset: 2.0 * _fovea_samples(dataset) + _wide_samples(dataset),
    "nerfstudio": lambda dataset: 2.0 * _fovea_samples(dataset),
    "ome-zarr": lambda dataset: LEVELS * _raw_bytes(dataset),
    "authors": lambda dataset: AUTHORS_BYTES * _fovea_samples(dataset) + _wide_samples(dataset),
}
