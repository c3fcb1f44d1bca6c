"""Raster captures: take a plan point by point into a dataset, on any rig behind the contract."""

from foveacam_pipeline.capture.run.access import CaptureRig, CaptureWatcher, RigAccess, trigger_head
from foveacam_pipeline.capture.run.capture import run_capture
from foveacam_pipeline.capture.run.describe import conditions_document, rig_document
from foveacam_pipeline.capture.run.pace_meter import PaceMeter
from foveacam_pipeline.capture.run.shots import image_size, writer_settings
from foveacam_pipeline.capture.run.survey import (
    check_exposures,
    known_directions,
    measure_distances_m,
    prepare_plan,
)
from foveacam_pipeline.capture.run.values import CapturePhase, CaptureReport, RunSettings

__all__ = [
    "CapturePhase",
    "CaptureReport",
    "CaptureRig",
    "CaptureWatcher",
    "PaceMeter",
    "RigAccess",
    "RunSettings",
    "check_exposures",
    "conditions_document",
    "image_size",
    "known_directions",
    "measure_distances_m",
    "prepare_plan",
    "rig_document",
    "run_capture",
    "trigger_head",
    "writer_settings",
]
