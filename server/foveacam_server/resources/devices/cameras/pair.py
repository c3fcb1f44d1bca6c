"""Compares the settings of both foveae, which one pulse exposes and whose pictures are matched."""

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias

from foveacam_hardware.contract import AutoMode, CameraRanges, CameraSettings, ValueRange, same_exposure

TOLERANCE = 0.005
"""Share of a setting's range above which the foveae's values count as different."""


Setting: TypeAlias = Literal[
    "exposure_ms", "exposure_auto", "gain_db", "black_level", "pixel_format", "trigger"
]

SETTINGS: tuple[Setting, ...] = (
    "exposure_ms",
    "exposure_auto",
    "gain_db",
    "black_level",
    "pixel_format",
    "trigger",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class PairDifference:
    """One setting in which the foveae differ, with both values in its unit."""

    setting: Setting
    left: float | str
    right: float | str


def differences(
    left: CameraSettings, right: CameraSettings, *, ranges: CameraRanges
) -> tuple[PairDifference, ...]:
    """Return the settings in which the foveae differ, but for the frame rate, which the trigger sets.

    Exposures are compared on a logarithmic scale, like that of their control, and must be close enough for
    one pulse to expose both. They are not compared where both cameras have automatic exposure.
    """
    by_hand = AutoMode.OFF in (left.exposure_auto, right.exposure_auto)
    apart = not same_exposure(left.exposure_ns, right.exposure_ns)
    far = {
        "exposure_ms": by_hand
        and (apart or _differ_in_log(left.exposure_ns, right.exposure_ns, ranges.exposure_ns)),
        "exposure_auto": left.exposure_auto is not right.exposure_auto,
        "gain_db": _differ(left.gain_db, right.gain_db, ranges.gain_db),
        "black_level": _differ(left.black_level, right.black_level, ranges.black_level),
        "pixel_format": left.pixel_format is not right.pixel_format,
        "trigger": _trigger_mode(left) != _trigger_mode(right),
    }
    on_left, on_right = _display_values(left), _display_values(right)
    return tuple(
        PairDifference(setting=name, left=on_left[name], right=on_right[name])
        for name in SETTINGS
        if far[name]
    )


def _display_values(settings: CameraSettings) -> dict[Setting, float | str]:
    return {
        "exposure_ms": settings.exposure_ns / 1e6,
        "exposure_auto": settings.exposure_auto.value,
        "gain_db": settings.gain_db,
        "black_level": settings.black_level,
        "pixel_format": settings.pixel_format.value,
        "trigger": _trigger_mode(settings),
    }


def _differ(left: float, right: float, span: ValueRange) -> bool:
    return abs(left - right) > TOLERANCE * (span.high - span.low)


def _differ_in_log(left: float, right: float, span: ValueRange) -> bool:
    if min(left, right, span.low) <= 0.0 or span.high <= span.low:
        return left != right
    return abs(math.log(left / right)) > TOLERANCE * math.log(span.high / span.low)


def _trigger_mode(settings: CameraSettings) -> str:
    return settings.trigger_source.value if settings.triggered else "none"
