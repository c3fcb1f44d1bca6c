"""Datasets on disk: a writer that survives crashes, a reader, a check. The format: `pipeline/DATASETS.md`."""

from foveacam_pipeline.capture.dataset.checking import DatasetInfo, check, info
from foveacam_pipeline.capture.dataset.description import describe
from foveacam_pipeline.capture.dataset.document import DatasetDocument, Header
from foveacam_pipeline.capture.dataset.images import Codec, largest_bytes
from foveacam_pipeline.capture.dataset.names import dataset_name
from foveacam_pipeline.capture.dataset.reader import Dataset, DatasetPoint, Pose
from foveacam_pipeline.capture.dataset.rectified import RectifyChoice, rectify_dataset
from foveacam_pipeline.capture.dataset.values import Place, Point, Progress, Shot, State
from foveacam_pipeline.capture.dataset.writer import DatasetWriter, WriterSettings

__all__ = [
    "Codec",
    "Dataset",
    "DatasetDocument",
    "DatasetInfo",
    "DatasetPoint",
    "DatasetWriter",
    "Header",
    "Place",
    "Point",
    "Pose",
    "Progress",
    "RectifyChoice",
    "Shot",
    "State",
    "WriterSettings",
    "check",
    "dataset_name",
    "describe",
    "info",
    "largest_bytes",
    "rectify_dataset",
]
