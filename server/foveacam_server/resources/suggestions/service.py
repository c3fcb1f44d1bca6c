"""Finds good targets in the newest wide picture."""

import cv2
import numpy as np

from foveacam_hardware.contract import NotConnected
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.suggest import suggest_targets
from foveacam_server.resources.suggestions.schema import SuggestionDocument
from foveacam_server.runtime.documents import deg
from foveacam_server.runtime.encoder import eight_bit
from foveacam_server.runtime.frame_hub import FrameHub


def suggestions(hub: FrameHub, calibration: Calibration, *, count: int) -> list[SuggestionDocument]:
    """Return at most `count` good targets of the newest wide picture, best first."""
    picture = hub.newest("wide")
    if picture is None:
        raise NotConnected(
            "the wide camera has not delivered a picture yet, so there is nothing to suggest; ask again when it has",
            asked="suggestions",
            found="no wide picture",
            remedy="ask again in a moment",
        )
    image = eight_bit(picture.image, bits=picture.bits)
    if image.ndim == 2:
        image = np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2RGB), dtype=np.uint8)
    found = suggest_targets(image, calibration, count=count)
    angles_rad = calibration.wide.angles_rad([(each.x_px, each.y_px) for each in found]) if found else []
    return [
        SuggestionDocument(
            x_px=each.x_px,
            y_px=each.y_px,
            ax_deg=deg(float(ax_rad)),
            ay_deg=deg(float(ay_rad)),
            score=round(each.score, 3),
        )
        for each, (ax_rad, ay_rad) in zip(found, angles_rad, strict=True)
    ]
