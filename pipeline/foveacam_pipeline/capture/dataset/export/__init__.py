"""Exports of a dataset: Hugging Face, COLMAP, nerfstudio, OME-Zarr, the authors' application."""

from collections.abc import Callable
from pathlib import Path

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.capture.dataset.export.authors import export_authors
from foveacam_pipeline.capture.dataset.export.colmap import export_colmap
from foveacam_pipeline.capture.dataset.export.hugging_face import export_hugging_face
from foveacam_pipeline.capture.dataset.export.needs import check_export, largest_bytes
from foveacam_pipeline.capture.dataset.export.nerfstudio import export_nerfstudio
from foveacam_pipeline.capture.dataset.export.ome_zarr import export_ome_zarr
from foveacam_pipeline.capture.dataset.export.target import ExportChoice, new_folder
from foveacam_pipeline.capture.dataset.reader import Dataset

__all__ = ["FORMATS", "ExportChoice", "check_export", "export_dataset", "largest_bytes"]

_WRITERS: dict[str, Callable[[Dataset, Path, ExportChoice], None]] = {
    "hugging-face": export_hugging_face,
    "colmap": export_colmap,
    "nerfstudio": export_nerfstudio,
    "ome-zarr": export_ome_zarr,
    "authors": export_authors,
}
FORMATS = tuple(_WRITERS)
DEFAULT = ExportChoice()


def export_dataset(dataset: Dataset, path: Path, *, to: str, choice: ExportChoice = DEFAULT) -> Path:
    """Export a dataset to the format `to`, into a new folder, completely or not at all; return the folder."""
    if to not in _WRITERS:
        raise InvalidInput(f"there is no export to {to!r}; the formats are {', '.join(FORMATS)}")
    check_export(dataset, to)
    with new_folder(path) as folder:
        _WRITERS[to](dataset, folder, choice)
    return path
