"""Finds good targets in the newest wide picture."""

import threading
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import NotConnected
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.suggest import Suggestion, suggest_targets
from foveacam_server.foundation.quantities import deg
from foveacam_server.resources.looking.suggestions.schema import SuggestionDocument
from foveacam_server.rig.encoder import eight_bit
from foveacam_server.rig.frame_hub import FrameHub

MOST = 10
"""Number of suggestions computed, however few a request wants."""
KEPT_S = 10.0
"""Time for which a result is cached, so that several pages opened together cost as much as one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Found:
    t_ns: int
    calibration: Calibration
    targets: tuple[Suggestion, ...]


class SuggestionService:
    """Suggestions of the live wide picture, computed once for all requests within `KEPT_S`."""

    def __init__(self, hub: FrameHub) -> None:
        self._hub = hub
        self._lock = threading.Lock()
        self._found: _Found | None = None

    def newest(self, calibration: Calibration, *, count: int) -> list[SuggestionDocument]:
        """Return at most `count` good targets, best first; at most `KEPT_S` old."""
        with self._lock:
            now_ns = self._hub.clock.now_ns()
            found = self._found
            if found is None or found.calibration is not calibration or now_ns - found.t_ns > 1e9 * KEPT_S:
                targets = suggest_targets(_newest_wide(self._hub), calibration, count=MOST)
                found = self._found = _Found(t_ns=now_ns, calibration=calibration, targets=targets)
        return [_document(each, calibration) for each in found.targets[:count]]


def _newest_wide(hub: FrameHub) -> NDArray[np.uint8]:
    """Return the newest wide picture, (h, w, 3) RGB."""
    picture = hub.newest("wide")
    if picture is None:
        raise NotConnected(
            "the wide camera has not delivered a picture yet, so there is nothing to suggest",
            asked="suggestions",
            found="no wide picture",
            remedy="ask again in a moment",
        )
    image = eight_bit(picture.image, bits=picture.bits)
    if image.ndim == 2:
        return np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2RGB), dtype=np.uint8)
    return image


def _document(suggestion: Suggestion, calibration: Calibration) -> SuggestionDocument:
    ax_rad, ay_rad = calibration.wide.angles_rad([(suggestion.x_px, suggestion.y_px)])[0].tolist()
    return SuggestionDocument(
        x_px=suggestion.x_px,
        y_px=suggestion.y_px,
        ax_deg=deg(ax_rad),
        ay_deg=deg(ay_rad),
        score=round(suggestion.score, 3),
    )
