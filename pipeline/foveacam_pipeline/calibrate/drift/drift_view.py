"""The wide view of a drift check: which places it looks at, and which it has."""

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.calibrate.drift.drift_places import DriftPatch
from foveacam_pipeline.models.calibration import Calibration

FOUND = (80, 220, 100)
WANTED = (230, 200, 60)


def drift_view(
    gray: NDArray[np.uint8], calibration: Calibration, queue: list[DriftPatch], done: set[int]
) -> NDArray[np.uint8]:
    """Return the wide view with a frame around the first place of each part, (h, w, 3) uint8 RGB."""
    view = cv2.cvtColor(gray, cv2.COLOR_GRAY2RGB)
    drawn: set[int] = set()
    for spot in queue:
        if spot.part in drawn:
            continue
        drawn.add(spot.part)
        x, y = calibration.wide.pixels(np.arctan(spot.template.target)[None])[0].tolist()
        half_x, half_y = spot.template.half_px
        corners = (round(x - half_x), round(y - half_y)), (round(x + half_x), round(y + half_y))
        cv2.rectangle(view, *corners, FOUND if spot.part in done else WANTED, 2, cv2.LINE_AA)
    return np.asarray(view, dtype=np.uint8)
