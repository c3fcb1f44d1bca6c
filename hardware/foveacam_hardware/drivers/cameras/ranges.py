"""Checks camera settings against the accepted ranges; values outside raise `OutOfRange`, never clipped."""

import math

from foveacam_hardware.contract import (
    AutoMode,
    CameraRanges,
    CameraSettings,
    InvalidInput,
    OutOfRange,
    ValueRange,
)

SLACK = 1e-9
"""Relative tolerance of a range's ends, which result from unit conversions."""


def refuse_outside(settings: CameraSettings, ranges: CameraRanges, *, first: bool = False) -> None:
    """Raise `OutOfRange` for a setting that the camera does not accept.

    `first`: the settings were made before the camera was known; settings that cannot be changed are skipped,
    and so are zeros, which leave a setting to the camera.
    """
    ms = ValueRange(low=ranges.exposure_ns.low * 1e-6, high=ranges.exposure_ns.high * 1e-6)
    rates_hz = ranges.frame_rate_hz
    if settings.triggered or settings.frame_rate_auto:  # many cameras report no range in these modes
        rates_hz = ValueRange(low=math.ulp(0.0), high=math.inf)
    for what, asked, span, unit in (
        ("exposure", settings.exposure_ns / 1e6, ms, "ms"),
        ("gain", settings.gain_db, ranges.gain_db, "dB"),
        ("frame rate", settings.frame_rate_hz, rates_hz, "Hz"),
        ("black level", settings.black_level, ranges.black_level, "units"),
    ):
        if not (first and (_is_fixed(span) or asked == 0.0)):
            _require(what, asked, span, unit)
    if settings.pixel_format not in ranges.pixel_formats:
        allowed = ", ".join(ranges.pixel_formats) or "none"
        raise OutOfRange(f"pixel format {settings.pixel_format} is not one of its own; use {allowed}")
    refuse_modes(settings, ranges, first=first)


def refuse_binning(label: str, settings: CameraSettings, ranges: CameraRanges) -> None:
    """Raise `InvalidInput` for a binning that neither the camera nor the host can provide."""
    if settings.binning not in ranges.binnings:
        allowed = " or ".join(map(str, ranges.binnings))
        raise InvalidInput(
            f"{label}: asked for binning {settings.binning}, and it has {allowed}",
            asked=f"binning {settings.binning}",
            found=f"binning {allowed}",
            remedy=f"use binning {allowed}",
        )


def refuse_modes(settings: CameraSettings, ranges: CameraRanges, *, first: bool = False) -> None:
    """Raise `OutOfRange` for an automatic mode that the camera does not have.

    `first`: a setting that is zero or cannot be changed is left to the camera, whatever its mode.
    """
    left = settings.exposure_auto is AutoMode.CONTINUOUS and (
        settings.exposure_ns == 0 or _is_fixed(ranges.exposure_ns)
    )
    if settings.exposure_auto not in ranges.exposure_autos and not (first and left):
        raise OutOfRange(
            f"automatic exposure, {settings.exposure_auto}, is not one of its own; {_remedy(ranges)}"
        )
    left = settings.frame_rate_hz == 0.0 or _is_fixed(ranges.frame_rate_hz)
    if settings.frame_rate_auto and not ranges.frame_rate_auto and not (first and left):
        raise OutOfRange("it cannot choose its frame rate itself; give one in Hz")


def _is_fixed(span: ValueRange) -> bool:
    return span.low == span.high


def _remedy(ranges: CameraRanges) -> str:
    if ranges.exposure_autos == (AutoMode.OFF,):
        return "it has none: switch it off, and give an exposure in ms"
    return f"use {', '.join(ranges.exposure_autos)}"


def _require(what: str, asked: float, span: ValueRange, unit: str) -> None:
    slack = SLACK * max(abs(span.low), abs(span.high)) if math.isfinite(span.high) else 0.0
    if not (math.isfinite(asked) and span.low - slack <= asked <= span.high + slack):
        raise OutOfRange(
            f"{what} {asked:g} {unit} is outside {span.low:g} to {span.high:g} {unit}; choose one inside"
        )
