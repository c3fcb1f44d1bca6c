"""Refuses settings outside of what a camera accepts, in words; nothing is clipped."""

import math

from foveacam_hardware.contract import AutoMode, CameraRanges, CameraSettings, OutOfRange, ValueRange

SLACK = 1e-9
"""Of a span's ends: they come out of conversions."""


def refuse_outside(settings: CameraSettings, ranges: CameraRanges, *, first: bool = False) -> None:
    """Raise `OutOfRange` for a setting that the camera does not accept.

    `first`: these are settings from before the camera was known; what cannot be set at all is passed over,
    and so is zero, which leaves it to the camera.
    """
    ms = ValueRange(low=ranges.exposure_ns.low * 1e-6, high=ranges.exposure_ns.high * 1e-6)
    rates_hz = ranges.frame_rate_hz
    if settings.triggered or settings.frame_rate_auto:  # its own, or its trigger's: many give no range then
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


def refuse_modes(settings: CameraSettings, ranges: CameraRanges, *, first: bool = False) -> None:
    """Raise `OutOfRange` for an automatic mode that the camera does not have.

    `first`: what is zero is left to the camera, whatever it does; so is what cannot be set at all.
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
