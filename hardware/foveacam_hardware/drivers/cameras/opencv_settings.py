"""Settings of an OpenCV source: what can be set at all, and what it took. Zero means: as it is."""

import math
from dataclasses import dataclass

import cv2

from foveacam_hardware.contract import (
    CameraRanges,
    CameraSettings,
    OutOfRange,
    PixelFormat,
    Span,
    TriggerSource,
)
from foveacam_hardware.drivers.cameras.opencv_source import Capture, SourceKind

UVC_EXPOSURE_NS = 100_000
"""Unit of a UVC camera's exposure; OpenCV does not tell the camera's own limits."""
LONGEST_UVC_EXPOSURE_NS = 1_000_000_000
PACES_HZ = Span(low=0.1, high=240.0)
"""A file is played as fast as asked."""
NOMINAL_HZ = 30.0
"""Of what does not tell its rate."""
BY_HAND, BY_ITSELF = 1.0, 3.0
"""V4L2's exposure modes."""
FORMATS = (PixelFormat.MONO8, PixelFormat.RGB8)
NOTHING = Span(low=0.0, high=0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Abilities:
    """What one opened source can do; `own_rate_hz`: its rate when nobody asks for another.

    A network stream's is what OpenCV tells: of MJPEG it takes 25 Hz, whatever the sender does.
    """

    kind: SourceKind
    own_rate_hz: float
    sets_exposure: bool


def abilities_of(capture: Capture, kind: SourceKind) -> Abilities:
    """Find out what a source can do."""
    told_hz = capture.get(cv2.CAP_PROP_FPS)
    known = math.isfinite(told_hz) and PACES_HZ.low <= told_hz <= PACES_HZ.high
    return Abilities(
        kind=kind,
        own_rate_hz=told_hz if known else NOMINAL_HZ,
        sets_exposure=kind is SourceKind.DEVICE and capture.get(cv2.CAP_PROP_EXPOSURE) > 0.0,
    )


def ranges_of(can: Abilities) -> CameraRanges:
    """Return what a source accepts; what cannot be set has one value."""
    exposure_ns = Span(low=float(UVC_EXPOSURE_NS), high=float(LONGEST_UVC_EXPOSURE_NS))
    own = Span(low=can.own_rate_hz, high=can.own_rate_hz)
    return CameraRanges(
        exposure_ns=exposure_ns if can.sets_exposure else NOTHING,
        gain_db=NOTHING,
        frame_rate_hz=own if can.kind is SourceKind.STREAM else PACES_HZ,
        black_level=NOTHING,
        pixel_formats=FORMATS,
    )


def check(asked: CameraSettings, can: Abilities, *, who: str) -> None:
    """Refuse what the source cannot do, before anything has changed."""
    if asked.triggered and asked.trigger_source is TriggerSource.HARDWARE:
        raise OutOfRange(
            f"{who}: asked to wait for a pulse, and no {can.kind} hears one; trigger it by software, let it"
            " run freely, or use a camera with a trigger input"
        )
    ranges = ranges_of(can)
    wished = (
        (
            "exposure",
            asked.exposure_ns / 1e6,
            ranges.exposure_ns.low / 1e6,
            ranges.exposure_ns.high / 1e6,
            "ms",
        ),
        ("gain", asked.gain_db, ranges.gain_db.low, ranges.gain_db.high, "dB"),
        ("frame rate", asked.frame_rate_hz, ranges.frame_rate_hz.low, ranges.frame_rate_hz.high, "Hz"),
        ("black level", asked.black_level, ranges.black_level.low, ranges.black_level.high, ""),
    )
    for what, value, low, high, unit in wished:
        if value == 0.0 or low <= value <= high:
            continue
        found = f"it is {low:g} {unit} to {high:g} {unit}" if low < high else f"this {can.kind} cannot set it"
        raise OutOfRange(
            f"{who}: {what} {value:g} {unit}: {found}; choose one that it takes, or leave it out"
        )
    if asked.pixel_format not in FORMATS:
        raise OutOfRange(
            f"{who}: pixel format {asked.pixel_format} is not one of its own; use {', '.join(FORMATS)}"
        )


def write(capture: Capture, asked: CameraSettings, can: Abilities) -> CameraSettings:
    """Write settings that were checked; return what the source took."""
    rate_hz = asked.frame_rate_hz or can.own_rate_hz
    if can.kind is SourceKind.DEVICE and asked.frame_rate_hz:
        capture.set(cv2.CAP_PROP_FPS, asked.frame_rate_hz)
        rate_hz = abilities_of(capture, can.kind).own_rate_hz
    return CameraSettings(
        exposure_ns=_expose(capture, asked.exposure_ns) if can.sets_exposure else 0,
        gain_db=0.0,
        frame_rate_hz=rate_hz,
        pixel_format=asked.pixel_format,
        triggered=asked.triggered,
        trigger_source=asked.trigger_source,
        black_level=0.0,
    )


def _expose(capture: Capture, exposure_ns: int) -> int:
    if exposure_ns == 0:
        capture.set(cv2.CAP_PROP_AUTO_EXPOSURE, BY_ITSELF)
    else:
        capture.set(cv2.CAP_PROP_AUTO_EXPOSURE, BY_HAND)
        capture.set(cv2.CAP_PROP_EXPOSURE, round(exposure_ns / UVC_EXPOSURE_NS))
    return round(capture.get(cv2.CAP_PROP_EXPOSURE) * UVC_EXPOSURE_NS)
