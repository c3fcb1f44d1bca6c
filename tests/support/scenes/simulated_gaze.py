"""Where an eye of the simulation looks."""

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.sim.optics import FOVEA_HEIGHT, FOVEA_WIDTH, EyeProjection


def gaze(view: EyeProjection) -> NDArray[np.float64]:
    """Return the unit ray of the fovea's image centre, rig frame."""
    return view.direction((FOVEA_WIDTH - 1) / 2, (FOVEA_HEIGHT - 1) / 2)
