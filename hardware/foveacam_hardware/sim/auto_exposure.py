"""The automatic exposure of the simulated cameras: measures pictures that are delivered, steps towards grey.

Pure and deterministic. It works on the logarithm of the exposure, as light does on pictures.
"""

import math
from dataclasses import dataclass

import numpy as np

from foveacam_hardware.contract import Image

MEAN = 0.5
"""Of full scale: where the mean of a picture is brought to."""
HIGHLIGHT, HIGHLIGHT_PERCENT = 0.92, 98.0
"""Unless so many of its values would then be brighter than this."""
CLIPPED = 0.995
CLIPPED_STEP_LOG2 = -0.5
"""What is at its end may be any amount brighter: at least half a stop down."""
STEP_LOG2 = (-2.0, 1.0)
"""Of one picture, stops."""
GOOD_LOG2 = 0.07
"""5 %: nearer is left alone, or noise would move it for ever."""
STRIDE = 8
"""Every so many pixels of every so many rows are measured."""
LIMITS_NS = (30_000, 100_000_000)
"""It goes no further; slower, it would smear what moves."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ExposureStep:
    """What one picture says: the exposure for the next, and whether this one was as good as it gets."""

    exposure_ns: int
    settled: bool


def too_bright_log2(image: Image, *, bits: int, black_level: float) -> float:
    """Return by how many stops a picture is too bright.

    `image`: (h, w) or (h, w, 3) of `bits`; `black_level`: what was added to it, grey levels of 8 bits.
    """
    white = float(2**bits - 1)
    black = black_level * 2.0 ** (bits - 8)
    values = image[::STRIDE, ::STRIDE].astype(np.float64)
    mean = max(float(values.mean()) - black, 1.0) / (white - black)
    bright = float(np.percentile(values, HIGHLIGHT_PERCENT))
    excess = max(mean / MEAN, (bright - black) / (white - black) / HIGHLIGHT)
    stops = math.log2(excess)
    return max(stops, -CLIPPED_STEP_LOG2) if bright >= CLIPPED * white else stops


def aim(exposure_ns: int, stops: float, *, longest_ns: int) -> ExposureStep:
    """Return the next exposure after a picture that was `stops` too bright; `longest_ns`: of its rate."""
    low_ns, high_ns = LIMITS_NS[0], min(LIMITS_NS[1], longest_ns)
    if abs(stops) <= GOOD_LOG2:
        return ExposureStep(exposure_ns=exposure_ns, settled=True)
    step = min(max(-stops, STEP_LOG2[0]), STEP_LOG2[1])
    next_ns = round(min(max(exposure_ns * 2.0**step, low_ns), high_ns))
    at_end = abs(next_ns - exposure_ns) < GOOD_LOG2 * exposure_ns and next_ns in (low_ns, high_ns)
    return ExposureStep(exposure_ns=next_ns, settled=at_end)
