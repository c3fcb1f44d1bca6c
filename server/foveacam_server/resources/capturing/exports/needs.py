"""Checks whether an export is possible and fits on the disk, and identifies what it depends on."""

from dataclasses import replace
from pathlib import Path
from typing import get_args

from foveacam_pipeline.capture.dataset import Dataset
from foveacam_pipeline.storage.free_space import RESERVE_BYTES, RESERVE_TEXT, free_bytes, free_space_error
from foveacam_server.datasets.export_format import ExportFormat

EXPORT_FORMATS: tuple[ExportFormat, ...] = get_args(ExportFormat)


def export_keys(folder: Path) -> dict[ExportFormat, str]:
    """Return for each format the hash of the dataset's content and of the program that exports it."""
    # imports OpenCV and the products, so it is loaded on demand
    from foveacam_pipeline.products.task import ProductKind, ProductSettings, plan_products

    (task,) = plan_products(folder, ProductSettings(kind=ProductKind.EXPORT))
    return {kind: replace(task, settings=replace(task.settings, to=kind)).key for kind in EXPORT_FORMATS}


def bytes_needed(dataset: Dataset, kind: ExportFormat, *, folder: Path) -> int:
    """Return the largest size of an export on the disk of `folder`.

    Raise `InvalidInput` or `NotCalibrated` where it is impossible, `OutOfRange` or `StorageFull` where it
    might not fit.
    """
    from foveacam_pipeline.capture.dataset.export import check_export, largest_bytes

    check_export(dataset, kind)
    largest, free = largest_bytes(dataset, kind), free_bytes(folder)
    wanted_bytes = largest + RESERVE_BYTES
    if wanted_bytes > free:
        raise free_space_error(
            f"an export of {len(dataset)} points to {kind} needs up to {wanted_bytes / 1e6:.0f} MB, with the "
            f"{RESERVE_TEXT}; {free / 1e6:.0f} MB are free on the disk",
            needed_bytes=wanted_bytes,
            free_bytes=free,
            remedy="free some space",
        )
    return largest
