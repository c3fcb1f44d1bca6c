"""One exposure for both foveae, found by looking: the brighter picture decides, both are exposed alike.

It works with any camera that takes exposures, and ends by itself; nothing changes afterwards, whoever looks.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from foveacam_hardware.contract import FoveaError, Frame, Sighting, StereoVolts, ValueRange

MEAN = 0.5
"""Of full scale: where the mean of the brighter picture is brought to."""
HIGHLIGHT, HIGHLIGHT_PERCENT = 0.92, 98.0
"""Unless so many of its values would then be brighter than this: what is clipped cannot be matched."""
CLIPPED, CLIPPED_STOPS = 0.995, 0.5
"""What is at its end may be any amount brighter: at least half a stop down."""
GOOD_STOPS = 0.1
"""7 %: nearer is good enough."""
STEP_STOPS = 2.0
"""Of one look."""
LOOKS = 8
LONGEST_NS = 33_000_000
"""It goes no further, as looks would get slow: raise the gain, or set a longer exposure by hand."""
STRIDE = 8
"""Every so many pixels of every so many rows are measured."""


class PairHead(Protocol):
    """What it needs of a rig."""

    def look(self, volts: StereoVolts, *, settle_us: int | None = None) -> Sighting:
        """Expose both foveae by one pulse."""
        ...

    def expose_foveae(self, *, exposure_ns: int, gain_db: float) -> None:
        """Set both foveae's exposure and gain."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class PairSettings:
    """What both foveae run with, and the exposures that both can take."""

    exposure_ns: int
    gain_db: float
    span_ns: ValueRange


@dataclass(frozen=True, slots=True, kw_only=True)
class PairExposure:
    """What was found: `too_bright_stops` is how far the brighter picture is still off, < 0: too dark."""

    exposure_ns: int
    looks: int
    too_bright_stops: float

    @property
    def good(self) -> bool:
        """Whether the pictures are exposed well; if not, no exposure does that here."""
        return abs(self.too_bright_stops) <= GOOD_STOPS

    @property
    def told(self) -> str:
        """It in words, with what to do where it is not good."""
        words = f"both foveae expose {self.exposure_ns / 1e6:.3g} ms, found in {self.looks} looks"
        if self.good:
            return words
        off, remedy = (
            ("dark", "raise the gain") if self.too_bright_stops < 0.0 else ("bright", "lower the gain")
        )
        return f"{words}; still {abs(self.too_bright_stops):.1f} stops too {off}: {remedy}"


def find_exposure(head: PairHead, before: PairSettings, *, gaze: StereoVolts) -> PairExposure:
    """Look, step and look again until both foveae are exposed well; on any error leave them as they were."""
    try:
        return _find(head, before, gaze)
    except FoveaError:
        head.expose_foveae(exposure_ns=before.exposure_ns, gain_db=before.gain_db)
        raise


def too_bright_stops(frame: Frame) -> float:
    """Return by how many stops a frame is too bright."""
    values = frame.image[::STRIDE, ::STRIDE].astype(np.float64) / (2**frame.bits - 1)
    bright = float(np.percentile(values, HIGHLIGHT_PERCENT))
    stops = math.log2(max(float(values.mean()) / MEAN, bright / HIGHLIGHT, 1e-3))
    return max(stops, CLIPPED_STOPS) if bright >= CLIPPED else stops


def _find(head: PairHead, before: PairSettings, gaze: StereoVolts) -> PairExposure:
    low_ns, high_ns = round(before.span_ns.low), round(min(before.span_ns.high, LONGEST_NS))
    exposure_ns = min(max(before.exposure_ns, low_ns), high_ns)
    for looks in range(1, LOOKS + 1):
        head.expose_foveae(exposure_ns=exposure_ns, gain_db=before.gain_db)
        sighting = head.look(gaze)
        stops = max(too_bright_stops(sighting.left), too_bright_stops(sighting.right))
        found = PairExposure(exposure_ns=exposure_ns, looks=looks, too_bright_stops=stops)
        at_end = exposure_ns == (high_ns if stops < 0.0 else low_ns)
        if found.good or at_end:
            return found
        step = min(max(-stops, -STEP_STOPS), STEP_STOPS)
        exposure_ns = min(max(round(exposure_ns * 2.0**step), low_ns), high_ns)
    return found
