"""Calibrated models (immutable) and the versioned calibration file."""

from foveacam_pipeline.models.calibration import Calibration, EyeCalibration, eye_volts
from foveacam_pipeline.models.calibration_file import load_calibration, save_calibration
from foveacam_pipeline.models.footprint import fovea_footprint_px
from foveacam_pipeline.models.homography import HomographyField
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.models.mirror import MirrorModel

__all__ = [
    "Calibration",
    "EyeCalibration",
    "HomographyField",
    "Intrinsics",
    "MirrorModel",
    "eye_volts",
    "fovea_footprint_px",
    "load_calibration",
    "save_calibration",
]
