"""Settings of an OpenCV source: which can be set, writing them and reading them back. Zero: leave as is."""

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
"""Unit of a UVC camera's exposure. OpenCV does not report the camera's limits."""
LONGEST_UVC_EXPOSURE_NS = 1_000_000_000
PLAYBACK_RATES_HZ = ValueRange(low=0.1, high=240.0)
"""Rates at which a file can be played."""
NOMINAL_HZ = 30.0
"""Rate of a source that does not report one."""
MANUAL_EXPOSURE = 1.0
AUTOMATIC_EXPOSURE = (3.0, 0.0)
"""V4L2's exposure modes: nearly every UVC camera has the first, which keeps the aperture fixed."""
FORMATS = (PixelFormat.MONO8, PixelFormat.RGB8)
NOTHING = ValueRange(low=0.0, high=0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class SourceCapabilities:
    """Capabilities of an opened source; `own_rate_hz`: its rate unless another is requested.

    The rate of a network stream is what OpenCV reports: 25 Hz for MJPEG, whatever is sent.
    """

    kind: SourceKind
    own_rate_hz: float
    sets_exposure: bool
    has_auto_exposure: bool = False

    @property
    def has_selectable_rate(self) -> bool:
        """Whether its rate can be chosen."""
        return self.kind is not SourceKind.STREAM


def read_capabilities(capture: OpenCvCapture, kind: SourceKind) -> SourceCapabilities:
    """Return the capabilities of an opened source."""
    reported_hz = capture.get(cv2.CAP_PROP_FPS)
    known = math.isfinite(reported_hz) and PLAYBACK_RATES_HZ.low <= reported_hz <= PLAYBACK_RATES_HZ.high
    sets_exposure = kind is SourceKind.DEVICE and capture.get(cv2.CAP_PROP_EXPOSURE) > 0.0
    return SourceCapabilities(
        kind=kind,
        own_rate_hz=reported_hz if known else NOMINAL_HZ,
        sets_exposure=sets_exposure,
        has_auto_exposure=sets_exposure and capture.get(cv2.CAP_PROP_AUTO_EXPOSURE) >= 0.0,
    )


def ranges_of(can: SourceCapabilities) -> CameraRanges:
    """Return the accepted values of every setting; one that cannot be set has a single value."""
    exposure_ns = ValueRange(low=float(UVC_EXPOSURE_NS), high=float(LONGEST_UVC_EXPOSURE_NS))
    own = ValueRange(low=can.own_rate_hz, high=can.own_rate_hz)
    return CameraRanges(
        exposure_ns=exposure_ns if can.sets_exposure else NOTHING,
        gain_db=NOTHING,
        frame_rate_hz=PLAYBACK_RATES_HZ if can.has_selectable_rate else own,
        black_level=NOTHING,
        pixel_formats=FORMATS,
        exposure_autos=(AutoMode.OFF, AutoMode.CONTINUOUS) if can.has_auto_exposure else (AutoMode.OFF,),
        frame_rate_auto=can.has_selectable_rate,
    )


def check_settings(asked: CameraSettings, can: SourceCapabilities, *, label: str) -> None:
    """Raise `OutOfRange` for settings that the source does not accept, before anything is changed."""
    if asked.triggered and asked.trigger_source is TriggerSource.HARDWARE:
        raise OutOfRange(
            f"{label}: asked to wait for a pulse, and no {can.kind} has a trigger input; trigger it by"
            " software, let it run freely, or use another camera"
        )
    ranges = ranges_of(can)
    requested = (
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
    for what, value, low, high, unit in requested:
        if value == 0.0 or low <= value <= high or (what == "frame rate" and asked.frame_rate_auto):
            continue
        found = f"it is {low:g} {unit} to {high:g} {unit}" if low < high else f"this {can.kind} cannot set it"
        raise OutOfRange(
            f"{label}: {what} {value:g} {unit}: {found}; choose one that it takes, or leave it out"
        )
    if asked.pixel_format not in FORMATS:
        raise OutOfRange(
            f"{label}: pixel format {asked.pixel_format} is not one of its own; use {', '.join(FORMATS)}"
        )
    try:
        refuse_modes(asked, ranges, first=True)
    except OutOfRange as refused:
        raise OutOfRange(f"{label}: {refused}") from None


def write_settings(capture: OpenCvCapture, asked: CameraSettings, can: SourceCapabilities) -> CameraSettings:
    """Write checked settings; return those in force."""
    rate_hz = can.own_rate_hz if asked.frame_rate_auto else asked.frame_rate_hz
    if can.kind is SourceKind.DEVICE and rate_hz:
        capture.set(cv2.CAP_PROP_FPS, rate_hz)
    if can.sets_exposure:
        _write_exposure(capture, asked, can)
    return read_back(capture, asked, can)


def read_back(capture: OpenCvCapture, asked: CameraSettings, can: SourceCapabilities) -> CameraSettings:
    """Return the settings in force, for a request `asked`."""
    rate_hz = can.own_rate_hz if asked.frame_rate_auto else asked.frame_rate_hz or can.own_rate_hz
    if can.kind is SourceKind.DEVICE:
        rate_hz = read_capabilities(capture, can.kind).own_rate_hz
    exposure_units = capture.get(cv2.CAP_PROP_EXPOSURE) if can.sets_exposure else 0.0
    return CameraSettings(
        exposure_ns=round(exposure_units * UVC_EXPOSURE_NS),
        exposure_auto=_exposure_mode(capture, can),
        gain_db=0.0,
        frame_rate_hz=rate_hz,
        frame_rate_auto=asked.frame_rate_auto and can.has_selectable_rate,
        pixel_format=asked.pixel_format,
        triggered=asked.triggered,
        trigger_source=asked.trigger_source,
        black_level=0.0,
        binning=asked.binning,
    )


def _write_exposure(capture: OpenCvCapture, asked: CameraSettings, can: SourceCapabilities) -> None:
    """Set the exposure, or switch automatic exposure on; a start value cannot be given."""
    if asked.exposure_auto is not AutoMode.OFF:
        any(capture.set(cv2.CAP_PROP_AUTO_EXPOSURE, mode) for mode in AUTOMATIC_EXPOSURE)
        return
    if can.has_auto_exposure:
        capture.set(cv2.CAP_PROP_AUTO_EXPOSURE, MANUAL_EXPOSURE)
    if asked.exposure_ns:
        capture.set(cv2.CAP_PROP_EXPOSURE, round(asked.exposure_ns / UVC_EXPOSURE_NS))


def _exposure_mode(capture: OpenCvCapture, can: SourceCapabilities) -> AutoMode:
    automatic = can.has_auto_exposure and capture.get(cv2.CAP_PROP_AUTO_EXPOSURE) in AUTOMATIC_EXPOSURE
    return AutoMode.CONTINUOUS if automatic else AutoMode.OFF
