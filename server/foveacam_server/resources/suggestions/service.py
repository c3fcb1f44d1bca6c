"""Finds good targets in the newest wide picture."""

import cv2
import numpy as np

from foveacam_hardware.contract import NotConnected
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.suggest import Suggestion, suggest_targets
from foveacam_server.resources.suggestions.schema import SuggestionDocument
from foveacam_server.runtime.documents import deg
from foveacam_server.runtime.encoder import eight_bit
from foveacam_server.runtime.frame_hub import FrameHub


def suggestions(hub: FrameHub, calibration: Calibration, *, count: int) -> list[SuggestionDocument]:
    """Return at most `count` good targets of the newest wide picture, best first."""
    picture = hub.newest("wide")
    if picture is None:
        raise NotConnected(
            "the wide camera has not delivered a picture yet, so there is nothing to suggest; "
            "ask again in a moment",
            asked="suggestions",
            found="no wide picture",
            remedy="ask again in a moment",
        )
    image = eight_bit(picture.image, bits=picture.bits)
    if image.ndim == 2:
        image = np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2RGB), dtype=np.uint8)
    return [_document(each, calibration) for each in suggest_targets(image, calibration, count=count)]


def _document(suggestion: Suggestion, calibration: Calibration) -> SuggestionDocument:
    ax_rad, ay_rad = calibration.wide.angles_rad([(suggestion.x_px, suggestion.y_px)])[0].tolist()
    return SuggestionDocument(
        x_px=suggestion.x_px,
        y_px=suggestion.y_px,
        ax_deg=deg(ax_rad),
        ay_deg=deg(ay_rad),
        score=round(suggestion.score, 3),
    )
