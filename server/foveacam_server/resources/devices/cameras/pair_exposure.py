"""Searches one exposure for both foveae by test exposures; the brighter picture decides.

Works with any camera whose exposure can be set; ends after a few looks with a fixed exposure.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from foveacam_hardware.contract import FoveaError, Frame, Sighting, StereoVolts, ValueRange

MEAN = 0.5
"""Target mean of the brighter picture, share of full scale."""
HIGHLIGHT, HIGHLIGHT_PERCENT = 0.92, 98.0
"""Share of full scale that this percentile must not exceed: clipped pixels cannot be matched."""
CLIPPED, CLIPPED_STOPS = 0.995, 0.5
"""At this share of full scale the true brightness is unknown: step down by at least this many stops."""
GOOD_STOPS = 0.1
"""Tolerance: 7 %."""
STEP_STOPS = 2.0
"""Largest step after one look."""
LOOKS = 8
LONGEST_NS = 33_000_000
"""Longest exposure that the search tries, to keep looks fast; the operator may set a longer one."""
STRIDE = 8
"""Stride of the evaluated pixels along rows and columns."""


class PairHead(Protocol):
    """The part of a rig that the search needs."""

    def look(self, volts: StereoVolts) -> Sighting:
        """Expose both foveae by one pulse."""
        ...

    def expose_foveae(self, *, exposure_ns: int, gain_db: float) -> None:
        """Set both foveae's exposure and gain."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class PairSettings:
    """Exposure and gain of both foveae, and the exposures that both accept."""

    exposure_ns: int
    gain_db: float
    span_ns: ValueRange


@dataclass(frozen=True, slots=True, kw_only=True)
class PairExposure:
    """Result of the search; `too_bright_stops`: residual of the brighter picture, < 0: too dark."""

    exposure_ns: int
    looks: int
    too_bright_stops: float

    @property
    def good(self) -> bool:
        """Whether the exposure is within the tolerance; if not, no allowed exposure is."""
        return abs(self.too_bright_stops) <= GOOD_STOPS

    @property
    def summary(self) -> str:
        """The result in words, with a remedy where it is not good."""
        words = f"both foveae expose {self.exposure_ns / 1e6:.3g} ms, found in {self.looks} looks"
        if self.good:
            return words
        off, remedy = (
            ("dark", "raise the gain") if self.too_bright_stops < 0.0 else ("bright", "lower the gain")
        )
        return f"{words}; still {abs(self.too_bright_stops):.1f} stops too {off}: {remedy}"


def find_exposure(head: PairHead, before: PairSettings, *, gaze: StereoVolts) -> PairExposure:
    """Change the exposure look by look until both foveae are well exposed; restore it on an error."""
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
