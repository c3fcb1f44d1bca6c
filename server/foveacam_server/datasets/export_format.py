"""The formats to which a dataset is exported, as requests name them; `capture.dataset.export` writes them."""

from typing import Literal

ExportFormat = Literal["hugging-face", "colmap", "nerfstudio", "ome-zarr", "authors"]
