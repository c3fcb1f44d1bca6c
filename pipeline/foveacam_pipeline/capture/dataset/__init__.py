"""Datasets on disk: crash-safe writer, reader, check, labels. `pipeline/DATASETS.md` describes the format."""

from foveacam_pipeline.capture.dataset.checking import DatasetInfo, check_dataset, dataset_info
from foveacam_pipeline.capture.dataset.document import DatasetDocument, DatasetHeader
from foveacam_pipeline.capture.dataset.images import ImageCodec
from foveacam_pipeline.capture.dataset.labels import change_labels, dataset_name
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
    "change_labels",
    "check_dataset",
    "dataset_info",
    "dataset_name",
    "rectify_dataset",
]
