"""From the samples of a sweep to calibrated models."""

from foveacam_pipeline.calibrate.fit import fit_calibration, fit_mirror
from foveacam_pipeline.calibrate.fit_homography import fit_homography
from foveacam_pipeline.calibrate.samples import EyeSweep, RigSweep

__all__ = ["EyeSweep", "RigSweep", "fit_calibration", "fit_homography", "fit_mirror"]
