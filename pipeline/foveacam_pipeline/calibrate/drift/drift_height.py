"""How far apart the eyes look in height: known several times as well as where each of them looks.

Both eyes see the same thing, so that what the wide camera and its lens lack falls out. A pixel, as mounts
drift in minutes, is within the error of each eye's own correction and far beyond that of their difference;
it is the difference that rows and the health of a calibration feel.
"""

import math

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.calibrate.drift.drift_fit import DriftFit

SURE_SIGMAS = 3.0
HEIGHT = np.array([1, 0, 0, 0, 0, 0, -1, 0, 0, 0, 0, 0]) / 2.0
"""What of the twelve terms it is: half the difference of the turns about x."""


def height_alone(fit: DriftFit) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """Return (12,) terms that bring both eyes to one height and do nothing else, and their covariance.

    None where they are within its error.
    """
    half = float(HEIGHT @ fit.terms)
    sigma = math.sqrt(float(HEIGHT @ fit.covariance @ HEIGHT))
    if abs(half) <= SURE_SIGMAS * sigma:
        return None
    each = 2.0 * HEIGHT
    return half * each, sigma**2 * np.outer(each, each)
