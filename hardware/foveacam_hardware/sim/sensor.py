"""The simulated sensor (IMX273): its limits, its timing, and the image it makes of radiance."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import (
    AutoMode,
    Binning,
    CameraRanges,
    CameraSettings,
    Image,
    OutOfRange,
    PixelFormat,
    Role,
    TriggerSource,
    ValueRange,
)
from foveacam_hardware.drivers.cameras.ranges import refuse_binning
from foveacam_hardware.sim.render.sensor import SensorExposure, expose

LINE_10_BIT_NS = 290 / 74.25e6 * 1e9
LINE_12_BIT_NS = 396 / 74.25e6 * 1e9
LINES, BLANK_LINES = 1080, 42  # IMX273: the image and its vertical blanking
BINNINGS: tuple[Binning, ...] = (1, 2)
EXPOSURE_NS = (30_000, 1_000_000_000)
GAIN_DB = (0.0, 24.0)
GAIN_STEP_DB = 0.1
FRAME_RATE_HZ = (0.1, 228.0)
BLACK_LEVEL = (0.0, 32.0)
PIXEL_FORMATS = (PixelFormat.MONO8, PixelFormat.MONO12, PixelFormat.RGB8)
RANGES = CameraRanges(
    exposure_ns=ValueRange(low=EXPOSURE_NS[0], high=EXPOSURE_NS[1]),
    gain_db=ValueRange(low=GAIN_DB[0], high=GAIN_DB[1]),
    frame_rate_hz=ValueRange(low=FRAME_RATE_HZ[0], high=FRAME_RATE_HZ[1]),
    black_level=ValueRange(low=BLACK_LEVEL[0], high=BLACK_LEVEL[1]),
    pixel_formats=PIXEL_FORMATS,
    exposure_autos=tuple(AutoMode),
    frame_rate_auto=True,
    binnings=BINNINGS,
)
REFERENCE_S = 0.0076
"""Exposure in which white fills the well: lighting and apertures suit 8 ms, one period of mains flicker."""
PSF_SIGMA_PX = {Role.WIDE: 0.6, Role.LEFT: 1.4, Role.RIGHT: 1.4}
"""At f/21.5 the foveae are limited by diffraction: 0.29 cycles/px, a Gaussian of 1.4 px (deduced)."""


def ranges_at(binning: Binning) -> CameraRanges:
    """Return the accepted values of every setting at a binning; a shorter readout allows a higher rate."""
    highest_hz = FRAME_RATE_HZ[1] * (LINES + BLANK_LINES) / (LINES // binning + BLANK_LINES)
    return replace(RANGES, frame_rate_hz=ValueRange(low=FRAME_RATE_HZ[0], high=float(int(highest_hz))))


def readout_ns(settings: CameraSettings) -> int:
    """Return the readout time of the sensor: 4.38 ms, or 5.98 ms at 12 bit.

    At binning 2 (assumed) it reads half as many lines: 2.27 and 3.10 ms.
    """
    line_ns = LINE_12_BIT_NS if settings.pixel_format is PixelFormat.MONO12 else LINE_10_BIT_NS
    return round(line_ns * (LINES // settings.binning + BLANK_LINES))


def longest_exposure_ns(settings: CameraSettings) -> int:
    """Return the longest exposure that keeps a frame rate set by hand."""
    if settings.triggered or settings.frame_rate_auto:
        return EXPOSURE_NS[1]
    return round(1e9 / settings.frame_rate_hz - LINE_12_BIT_NS)


def supported_settings(role: Role, requested: CameraSettings) -> CameraSettings:
    """Return the settings as the sensor supports them: whole lines, tenths of a decibel, a feasible rate.

    Raise `OutOfRange` for what it does not support.
    """
    _require(role, "exposure", requested.exposure_ns / 1e6, EXPOSURE_NS[0] / 1e6, EXPOSURE_NS[1] / 1e6, "ms")
    _require(role, "gain", requested.gain_db, *GAIN_DB, "dB")
    refuse_binning(f"camera {role}", requested, RANGES)
    rates_hz = ranges_at(requested.binning).frame_rate_hz
    if not requested.frame_rate_auto:
        _require(role, "frame rate", requested.frame_rate_hz, rates_hz.low, rates_hz.high, "Hz")
    _require(role, "black level", requested.black_level, *BLACK_LEVEL, "grey levels")
    if requested.pixel_format not in PIXEL_FORMATS:
        allowed = ", ".join(PIXEL_FORMATS)
        raise OutOfRange(
            f"camera {role}: pixel format {requested.pixel_format} is not one of its own; use {allowed}"
        )
    if requested.triggered and requested.trigger_source is TriggerSource.HARDWARE and role is Role.WIDE:
        raise OutOfRange(
            "camera wide: asked to be triggered, but no trigger cable leads to it; only the foveae have one"
        )
    line_ns = LINE_12_BIT_NS if requested.pixel_format is PixelFormat.MONO12 else LINE_10_BIT_NS
    exposure_ns = round(max(1, round(requested.exposure_ns / line_ns)) * line_ns)
    # The next exposure may overlap the readout, but not end before it.
    shortest_ns = max(exposure_ns, readout_ns(requested))
    wanted_hz = rates_hz.high if requested.frame_rate_auto else requested.frame_rate_hz
    return CameraSettings(
        exposure_ns=exposure_ns,
        exposure_auto=requested.exposure_auto,
        gain_db=round(requested.gain_db / GAIN_STEP_DB) * GAIN_STEP_DB,
        frame_rate_hz=min(wanted_hz, 1e9 / shortest_ns),
        frame_rate_auto=requested.frame_rate_auto,
        pixel_format=requested.pixel_format,
        triggered=requested.triggered,
        trigger_source=requested.trigger_source,
        black_level=float(round(requested.black_level)),
        binning=requested.binning,
    )


def _require(role: Role, name: str, value: float, low: float, high: float, unit: str) -> None:
    if not (math.isfinite(value) and low <= value <= high):
        raise OutOfRange(
            f"camera {role}: {name} {value:g} {unit} is outside {low:g} to {high:g} {unit}; choose one inside"
        )


def image_from_radiance(
    radiance: NDArray[np.float32],
    role: Role,
    settings: CameraSettings,
    *,
    key: tuple[int, int, int],
    defocus_px: float = 0.0,
) -> Image:
    """Return the image of mean radiance (h, w[, 3]), of the settings' binning.

    `key` (seed, camera, frame) alone decides the noise. `defocus_px`: sigma of a blur besides the lens's.
    """
    exposure = SensorExposure(
        exposure_s=settings.exposure_ns * 1e-9,
        reference_s=REFERENCE_S,
        gain=10.0 ** (settings.gain_db / 20.0),
        bits=12 if settings.pixel_format is PixelFormat.MONO12 else 8,
        psf_sigma_px=math.hypot(PSF_SIGMA_PX[role], defocus_px),
        binning=settings.binning,
    )
    image = expose(radiance, exposure, key)
    return (
        image
        if settings.black_level == 0.0
        else _with_black_level(image, settings.black_level, exposure.bits)
    )


def _with_black_level(image: Image, black_level: float, bits: int) -> Image:
    """Return the image with `black_level` added, in grey levels of 8 bits."""
    offset, white = round(black_level * 2 ** (bits - 8)), 2**bits - 1
    raised: NDArray[np.int32] = np.minimum(image.astype(np.int32) + offset, white)
    return raised.astype(np.uint8) if bits == 8 else raised.astype(np.uint16)
