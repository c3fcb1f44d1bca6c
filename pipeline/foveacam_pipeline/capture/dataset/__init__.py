"""Datasets on disk: a writer that survives crashes, a reader, a check. The format: `pipeline/DATASETS.md`."""

from foveacam_pipeline.capture.dataset.checking import DatasetInfo, check, info
from foveacam_pipeline.capture.dataset.description import describe
from foveacam_pipeline.capture.dataset.document import DatasetDocument, DatasetHeader
from foveacam_pipeline.capture.dataset.images import ImageCodec, largest_bytes
from foveacam_pipeline.capture.dataset.names import dataset_name
from foveacam_pipeline.capture.dataset.reader import Dataset, DatasetPoint, PointPose
from foveacam_pipeline.capture.dataset.rectified import RectifyChoice, rectify_dataset
from foveacam_pipeline.capture.dataset.values import (
    CapturedPoint,
    DatasetState,
    PlanPosition,
    Shot,
    WriterProgress,
)
from foveacam_pipeline.capture.dataset.writer import DatasetWriter, WriterSettings

__all__ = [
    "CapturedPoint",
    "Dataset",
    "DatasetDocument",
    "DatasetHeader",
    "DatasetInfo",
    "DatasetPoint",
    "DatasetState",
    "DatasetWriter",
    "ImageCodec",
    "PlanPosition",
    "PointPose",
    "RectifyChoice",
    "Shot",
    "WriterProgress",
    "WriterSettings",
    "check",
    "dataset_name",
    "describe",
    "info",
    "largest_bytes",
    "rectify_dataset",
]
