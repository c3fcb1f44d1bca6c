"""Whether both foveae run alike: one pulse exposes both, and their pictures are compared. Pure."""

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias

from foveacam_hardware.contract import AutoMode, CameraRanges, CameraSettings, ValueRange, same_exposure

TOLERANCE = 0.005
"""Of a setting's range; further apart, somebody must say which side counts."""


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
    """One setting in which the foveae differ, in its unit, as the operator reads it."""

    setting: Setting
    left: float | str
    right: float | str


def differences(
    left: CameraSettings, right: CameraSettings, *, ranges: CameraRanges
) -> tuple[PairDifference, ...]:
    """Return in what the foveae differ; the frame rate does not count, as the trigger sets it.

    An exposure is compared on the logarithmic scale that its control has, and may be no further apart than
    one pulse can expose. Where both set theirs themselves, each has its own.
    """
    by_hand = AutoMode.OFF in (left.exposure_auto, right.exposure_auto)
    apart = not same_exposure(left.exposure_ns, right.exposure_ns)
    far = {
        "exposure_ms": by_hand
        and (apart or _far_in_log(left.exposure_ns, right.exposure_ns, ranges.exposure_ns)),
        "exposure_auto": left.exposure_auto is not right.exposure_auto,
        "gain_db": _far(left.gain_db, right.gain_db, ranges.gain_db),
        "black_level": _far(left.black_level, right.black_level, ranges.black_level),
        "pixel_format": left.pixel_format is not right.pixel_format,
        "trigger": _mode(left) != _mode(right),
    }
    on_left, on_right = _shown(left), _shown(right)
    return tuple(
        PairDifference(setting=name, left=on_left[name], right=on_right[name])
        for name in SETTINGS
        if far[name]
    )


def _shown(settings: CameraSettings) -> dict[Setting, float | str]:
    return {
        "exposure_ms": settings.exposure_ns / 1e6,
        "exposure_auto": settings.exposure_auto.value,
        "gain_db": settings.gain_db,
        "black_level": settings.black_level,
        "pixel_format": settings.pixel_format.value,
        "trigger": _mode(settings),
    }


def _far(left: float, right: float, span: ValueRange) -> bool:
    return abs(left - right) > TOLERANCE * (span.high - span.low)


def _far_in_log(left: float, right: float, span: ValueRange) -> bool:
    if min(left, right, span.low) <= 0.0 or span.high <= span.low:
        return left != right
    return abs(math.log(left / right)) > TOLERANCE * math.log(span.high / span.low)


def _mode(settings: CameraSettings) -> str:
    return settings.trigger_source.value if settings.triggered else "none"
