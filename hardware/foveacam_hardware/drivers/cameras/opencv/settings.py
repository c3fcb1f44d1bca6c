"""Settings of an OpenCV source: what can be set at all, and what it took. Zero means: as it stands."""

import math
from dataclasses import dataclass

import cv2

from foveacam_hardware.contract import (
    AutoMode,
    CameraRanges,
    CameraSettings,
    OutOfRange,
    PixelFormat,
    TriggerSource,
    ValueRange,
)
from foveacam_hardware.drivers.cameras.opencv.source import OpenCvCapture, SourceKind
from foveacam_hardware.drivers.cameras.ranges import refuse_modes

UVC_EXPOSURE_NS = 100_000
"""Unit of a UVC camera's exposure; OpenCV does not tell the camera's own limits."""
LONGEST_UVC_EXPOSURE_NS = 1_000_000_000
PACES_HZ = ValueRange(low=0.1, high=240.0)
"""A file is played as fast as asked."""
NOMINAL_HZ = 30.0
"""Of what does not tell its rate."""
BY_HAND = 1.0
BY_ITSELF = (3.0, 0.0)
"""V4L2's exposure modes: nearly every UVC camera has the first, which leaves its aperture alone."""
FORMATS = (PixelFormat.MONO8, PixelFormat.RGB8)
NOTHING = ValueRange(low=0.0, high=0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class SourceCapabilities:
    """What one opened source can do; `own_rate_hz`: its rate when nobody asks for another.

    A network stream's is what OpenCV tells: of MJPEG it takes 25 Hz, whatever the sender does.
    """

    kind: SourceKind
    own_rate_hz: float
    sets_exposure: bool
    exposes_itself: bool = False

    @property
    def paces_itself(self) -> bool:
        """Whether its own rate is one that can be chosen, beside others."""
        return self.kind is not SourceKind.STREAM


def abilities_of(capture: OpenCvCapture, kind: SourceKind) -> SourceCapabilities:
    """Find out what a source can do."""
    told_hz = capture.get(cv2.CAP_PROP_FPS)
    known = math.isfinite(told_hz) and PACES_HZ.low <= told_hz <= PACES_HZ.high
    sets_exposure = kind is SourceKind.DEVICE and capture.get(cv2.CAP_PROP_EXPOSURE) > 0.0
    return SourceCapabilities(
        kind=kind,
        own_rate_hz=told_hz if known else NOMINAL_HZ,
        sets_exposure=sets_exposure,
        exposes_itself=sets_exposure and capture.get(cv2.CAP_PROP_AUTO_EXPOSURE) >= 0.0,
    )


def ranges_of(can: SourceCapabilities) -> CameraRanges:
    """Return what a source accepts; what cannot be set has one value."""
    exposure_ns = ValueRange(low=float(UVC_EXPOSURE_NS), high=float(LONGEST_UVC_EXPOSURE_NS))
    own = ValueRange(low=can.own_rate_hz, high=can.own_rate_hz)
    return CameraRanges(
        exposure_ns=exposure_ns if can.sets_exposure else NOTHING,
        gain_db=NOTHING,
        frame_rate_hz=PACES_HZ if can.paces_itself else own,
        black_level=NOTHING,
        pixel_formats=FORMATS,
        exposure_autos=(AutoMode.OFF, AutoMode.CONTINUOUS) if can.exposes_itself else (AutoMode.OFF,),
        frame_rate_auto=can.paces_itself,
    )


def check(asked: CameraSettings, can: SourceCapabilities, *, who: str) -> None:
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
        if value == 0.0 or low <= value <= high or (what == "frame rate" and asked.frame_rate_auto):
            continue
        found = f"it is {low:g} {unit} to {high:g} {unit}" if low < high else f"this {can.kind} cannot set it"
        raise OutOfRange(
            f"{who}: {what} {value:g} {unit}: {found}; choose one that it takes, or leave it out"
        )
    if asked.pixel_format not in FORMATS:
        raise OutOfRange(
            f"{who}: pixel format {asked.pixel_format} is not one of its own; use {', '.join(FORMATS)}"
        )
    try:
        refuse_modes(asked, ranges, first=True)
    except OutOfRange as refused:
        raise OutOfRange(f"{who}: {refused}") from None


def write(capture: OpenCvCapture, asked: CameraSettings, can: SourceCapabilities) -> CameraSettings:
    """Write settings that were checked; return what the source took."""
    rate_hz = can.own_rate_hz if asked.frame_rate_auto else asked.frame_rate_hz
    if can.kind is SourceKind.DEVICE and rate_hz:
        capture.set(cv2.CAP_PROP_FPS, rate_hz)
    if can.sets_exposure:
        _expose(capture, asked, can)
    return read_back(capture, asked, can)


def read_back(capture: OpenCvCapture, asked: CameraSettings, can: SourceCapabilities) -> CameraSettings:
    """Return what is in force of what was asked for."""
    rate_hz = can.own_rate_hz if asked.frame_rate_auto else asked.frame_rate_hz or can.own_rate_hz
    if can.kind is SourceKind.DEVICE:
        rate_hz = abilities_of(capture, can.kind).own_rate_hz
    exposure_units = capture.get(cv2.CAP_PROP_EXPOSURE) if can.sets_exposure else 0.0
    return CameraSettings(
        exposure_ns=round(exposure_units * UVC_EXPOSURE_NS),
        exposure_auto=_mode(capture, can),
        gain_db=0.0,
        frame_rate_hz=rate_hz,
        frame_rate_auto=asked.frame_rate_auto and can.paces_itself,
        pixel_format=asked.pixel_format,
        triggered=asked.triggered,
        trigger_source=asked.trigger_source,
        black_level=0.0,
    )


def _expose(capture: OpenCvCapture, asked: CameraSettings, can: SourceCapabilities) -> None:
    """Set the exposure, or leave it to the camera, which begins wherever it wants to."""
    if asked.exposure_auto is not AutoMode.OFF:
        any(capture.set(cv2.CAP_PROP_AUTO_EXPOSURE, mode) for mode in BY_ITSELF)
        return
    if can.exposes_itself:
        capture.set(cv2.CAP_PROP_AUTO_EXPOSURE, BY_HAND)
    if asked.exposure_ns:
        capture.set(cv2.CAP_PROP_EXPOSURE, round(asked.exposure_ns / UVC_EXPOSURE_NS))


def _mode(capture: OpenCvCapture, can: SourceCapabilities) -> AutoMode:
    itself = can.exposes_itself and capture.get(cv2.CAP_PROP_AUTO_EXPOSURE) in BY_ITSELF
    return AutoMode.CONTINUOUS if itself else AutoMode.OFF
