"""Datasets for other programs: Hugging Face, COLMAP, nerfstudio, and the authors' own folders."""

from foveacam_pipeline.capture.dataset.export.choice import ExportChoice
from foveacam_pipeline.capture.dataset.export.formats import FORMATS, export_dataset

__all__ = ["FORMATS", "ExportChoice", "export_dataset"]
