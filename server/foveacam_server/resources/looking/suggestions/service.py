"""Finds good targets in the newest wide picture, and verifies them by looking."""

import threading
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import NotConnected
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.suggest import Suggestion, suggest_targets
from foveacam_pipeline.verge.verify_suggestions import verified_targets
from foveacam_server.foundation.quantities import deg
from foveacam_server.resources.looking.suggestions.schema import SuggestionDocument
from foveacam_server.rig.encoder import eight_bit
from foveacam_server.rig.frame_hub import FrameHub
from foveacam_server.rig.hardware import HardwareThread

MOST = 10
"""Number of suggestions computed, however few a request wants."""
KEPT_S = 10.0
"""Time for which a result is cached, so that several pages opened together cost as much as one."""
VERIFIED_S = 60.0
"""Time for which verified targets are cached: what stands there may move."""
VERIFYING_S = 8.0
"""Longest time spent on looks that verify."""
HOLDER = "the check of suggested targets"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Found:
    t_ns: int
    calibration: Calibration
    targets: tuple[Suggestion, ...]
    verified: bool = False

    def holds(self, calibration: Calibration, *, now_ns: int) -> bool:
        age_s = 1e-9 * (now_ns - self.t_ns)
        return self.calibration is calibration and age_s <= (VERIFIED_S if self.verified else KEPT_S)


class SuggestionService:
    """Suggestions of the live wide picture, computed once for all requests within `KEPT_S`.

    One request verifies at a time, and others wait for it.
    """

    def __init__(self, hub: FrameHub) -> None:
        self._hub = hub
        self._lock = threading.Lock()
        self._found: _Found | None = None

    def newest(self, calibration: Calibration, *, count: int) -> list[SuggestionDocument]:
        """Return at most `count` good targets, best first: verified ones while they are held."""
        with self._lock:
            found = self._present(calibration)
        return [_document(each, found) for each in found.targets[:count]]

    def verify(
        self, calibration: Calibration, hardware: HardwareThread, *, count: int
    ) -> list[SuggestionDocument]:
        """Look at the suggestions; return at most `count` on which both foveae verge, best first.

        A check that a click or a job interrupts is not kept. Raise `Busy` while another has the rig, and a
        device's error.
        """
        with self._lock:
            found = self._present(calibration)
            if not found.verified or len(found.targets) < count:
                candidates = suggest_targets(_newest_wide(self._hub), calibration, count=MOST)
                targets = self._look(candidates, calibration, hardware, count=count)
                found = replace(found, t_ns=self._hub.clock.now_ns(), targets=targets, verified=True)
                if not hardware.use.wanted:
                    self._found = found
        return [_document(each, found) for each in found.targets[:count]]

    def _look(
        self,
        candidates: tuple[Suggestion, ...],
        calibration: Calibration,
        hardware: HardwareThread,
        *,
        count: int,
    ) -> tuple[Suggestion, ...]:
        clock = self._hub.clock
        with hardware.session(HOLDER, cancelled=lambda: hardware.use.wanted, gives_way=True) as head:
            return verified_targets(
                head,
                calibration,
                candidates,
                clock=clock,
                count=count,
                until_ns=clock.now_ns() + round(1e9 * VERIFYING_S),
                cancelled=lambda: hardware.use.wanted,
            )

    def _present(self, calibration: Calibration) -> _Found:
        now_ns = self._hub.clock.now_ns()
        if self._found is None or not self._found.holds(calibration, now_ns=now_ns):
            targets = suggest_targets(_newest_wide(self._hub), calibration, count=MOST)
            self._found = _Found(t_ns=now_ns, calibration=calibration, targets=targets)
        return self._found


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


def _document(suggestion: Suggestion, found: _Found) -> SuggestionDocument:
    ax_rad, ay_rad = found.calibration.wide.angles_rad([(suggestion.x_px, suggestion.y_px)])[0].tolist()
    return SuggestionDocument(
        x_px=suggestion.x_px,
        y_px=suggestion.y_px,
        ax_deg=deg(ax_rad),
        ay_deg=deg(ay_rad),
        score=round(suggestion.score, 3),
        verified=found.verified,
    )
