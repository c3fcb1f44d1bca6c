"""Conversion of radiance to counts: diffraction blur, exposure, shot and read noise, full well, quantisation.

The noise comes from a table of unit normals, read from a hashed position for every row: it depends on
(seed, camera, frame number, row) alone, and costs only the read.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract.errors import InvalidInput
from foveacam_hardware.contract.values import Binning
from foveacam_hardware.jit import kernel, part

F32 = NDArray[np.float32]
Gains = tuple[float, float, float, float, float]

TABLE_BITS = 20
MAX_ROW = 1 << 16
"""Longest row, in values: the table repeats as many at its end."""
MAX_RADIUS = 16
NARROW_PX = 0.5


@dataclass(frozen=True, kw_only=True, slots=True)
class SensorExposure:
    """Parameters of the conversion of radiance into counts.

    Attributes:
        exposure_s: exposure time.
        reference_s: exposure time in which radiance 1 fills the well.
        gain: amplification before the converter, 1 = a full well is full scale.
        full_well_e, read_noise_e: electrons (IMX273: 10 700 and 2.5).
        bits: 8, 10 or 12.
        psf_sigma_px: blur of the lens, a Gaussian, pixels of the sensor; 0 = none.
        binning: pixels of the sensor along each side of a pixel, which is their mean: its variance is theirs
            divided by their number, before it is rounded to `bits`.
    """

    exposure_s: float = 0.01
    reference_s: float = 0.01
    gain: float = 1.0
    full_well_e: float = 10_700.0
    read_noise_e: float = 2.5
    bits: int = 8
    psf_sigma_px: float = 0.0
    binning: Binning = 1

    def __post_init__(self) -> None:
        for name in ("exposure_s", "reference_s", "gain", "full_well_e"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise InvalidInput(f"exposure: {name} = {value}; pass a finite number above 0")
        if not (np.isfinite(self.read_noise_e) and self.read_noise_e >= 0):
            raise InvalidInput(
                f"exposure: read_noise_e = {self.read_noise_e}; pass a finite number, 0 or more"
            )
        if self.bits not in (8, 10, 12):
            raise InvalidInput(f"exposure: bits = {self.bits}; pass 8, 10 or 12")
        if not 0 <= self.psf_sigma_px <= MAX_RADIUS / 3:
            raise InvalidInput(
                f"exposure: psf_sigma_px = {self.psf_sigma_px}; pass 0 to {MAX_RADIUS / 3:.1f}"
            )


@lru_cache(maxsize=1)
def _normals() -> F32:
    table = np.random.default_rng(0x5EED).standard_normal(1 << TABLE_BITS, dtype=np.float32)
    table = np.concatenate([table, table[:MAX_ROW]])
    table.flags.writeable = False
    return table


@lru_cache(maxsize=16)
def psf_taps(sigma_px: float) -> F32:
    """Return the Gaussian from its middle outwards, (radius + 1,), both wings adding up to 1.

    Samples of one narrower than `NARROW_PX` would miss its variance; it becomes three taps that have it.
    """
    if 0 < sigma_px < NARROW_PX:
        three: F32 = np.array([1.0 - sigma_px**2, 0.5 * sigma_px**2], np.float32)
        three.flags.writeable = False
        return three
    radius = int(np.ceil(3.2 * sigma_px)) if sigma_px > 0 else 0
    taps = np.exp(-0.5 * (np.arange(radius + 1) / max(sigma_px, 1e-9)) ** 2)
    taps /= taps[0] + 2 * taps[1:].sum()
    narrow: F32 = taps.astype(np.float32)
    narrow.flags.writeable = False
    return narrow


@part
def _mixed(a: np.uint64, b: int) -> np.uint64:
    """Return a hash of two 64-bit numbers (the finaliser of SplitMix64)."""
    h = np.uint64(a) * np.uint64(0x9E3779B97F4A7C15) + np.uint64(b)
    h = (h ^ (h >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    h = (h ^ (h >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return h ^ (h >> np.uint64(31))


@part
def _blur_down(radiance: F32, y: int, taps: F32, row: F32) -> None:
    """Fill row with the vertical blur of image row y, the edge rows repeated."""
    last, n = radiance.shape[0] - 1, row.shape[0]
    middle = radiance[y]
    for i in range(n):
        row[i] = taps[0] * middle[i]
    for k in range(1, taps.shape[0]):
        up, down, w = radiance[max(y - k, 0)], radiance[min(y + k, last)], taps[k]
        for i in range(n):
            row[i] += w * (up[i] + down[i])


@part
def _blur_along(padded: F32, channels: int, taps: F32, row: F32) -> None:
    """Fill row with the horizontal blur of a row padded by MAX_RADIUS pixels on both sides."""
    first, n = MAX_RADIUS * channels, row.shape[0]
    for c in range(channels):
        for k in range(MAX_RADIUS):
            padded[k * channels + c] = padded[first + c]
            padded[first + n + k * channels + c] = padded[first + n - channels + c]
    middle = padded[first : first + n]
    for i in range(n):
        row[i] = taps[0] * middle[i]
    for k in range(1, taps.shape[0]):
        a = padded[first - k * channels : first - k * channels + n]
        b = padded[first + k * channels : first + k * channels + n]
        w = taps[k]
        for i in range(n):
            row[i] += w * (a[i] + b[i])


@part
def _count(row: F32, normals: F32, gains: Gains, top: int, out: NDArray[np.uint16]) -> None:
    """Fill out with counts: electrons with noise, limited by the well and the converter.

    gains: electrons of a full well, per radiance 1, of read noise; counts per electron; noise of a pixel
    relative to that of a sensor pixel.
    """
    well, light = np.float32(gains[0]), np.float32(gains[1])
    read, scale, part = np.float32(gains[2]), np.float32(gains[3]), np.float32(gains[4])
    half, zero, limit = np.float32(0.5), np.float32(0.0), np.float32(top)
    for i in range(row.shape[0]):
        electrons = min(max(row[i] * light, zero), well)
        counts = (electrons + part * np.sqrt(electrons + read * read) * normals[i]) * scale + half
        out[i] = np.uint16(np.int32(min(max(counts, zero), limit)))


@kernel
def expose_rows(
    radiance: F32, channels: int, taps: F32, normals: F32, key: np.uint64,
    gains: Gains, top: int, out: NDArray[np.uint16],
) -> None:  # fmt: skip
    """Expose rows of interleaved channels, (h, w · channels); gains as for _count."""
    n = radiance.shape[1]
    padded = np.empty(n + 2 * MAX_RADIUS * channels, np.float32)
    row = np.empty(n, np.float32)
    first = MAX_RADIUS * channels
    for y in range(radiance.shape[0]):
        _blur_down(radiance, y, taps, padded[first : first + n])
        _blur_along(padded, channels, taps, row)
        start = np.int64(_mixed(key, y) >> np.uint64(64 - TABLE_BITS))
        _count(row, normals[start : start + n], gains, top, out[y])


def _frame_key(key: tuple[int, int, int]) -> int:
    """Hash (seed, camera, frame number) to 64 bits."""
    h = 0x243F6A8885A308D3
    for number in key:
        h ^= number & 0xFFFFFFFFFFFFFFFF
        h = (h ^ (h >> 30)) * 0xBF58476D1CE4E5B9 & 0xFFFFFFFFFFFFFFFF
        h = (h ^ (h >> 27)) * 0x94D049BB133111EB & 0xFFFFFFFFFFFFFFFF
        h ^= h >> 31
    return h


def expose(
    radiance: F32, exposure: SensorExposure, key: tuple[int, int, int]
) -> NDArray[np.uint8] | NDArray[np.uint16]:
    """Return the image of one exposure, (h, w) or (h, w, 3), uint8, or uint16 holding 10 or 12 bits.

    radiance: (h, w) or (h, w, 3) float32; key: (seed, camera, frame number), which alone decides the noise.
    """
    if radiance.ndim not in (2, 3) or radiance.dtype != np.float32:
        raise InvalidInput(f"expose: asked for (h, w[, 3]) float32, found {radiance.shape} {radiance.dtype}")
    channels = 1 if radiance.ndim == 2 else radiance.shape[2]
    rows = np.ascontiguousarray(radiance).reshape(radiance.shape[0], -1)
    rows.flags.writeable = False  # a view of its own; one kernel serves frames and arrays of any origin
    if rows.shape[1] > MAX_ROW:
        raise InvalidInput(f"expose: a row of {rows.shape[1]} values; at most {MAX_ROW} fit the noise table")
    top = (1 << exposure.bits) - 1
    counts = np.empty(rows.shape, np.uint16)
    gains = (
        exposure.full_well_e,
        exposure.full_well_e * exposure.exposure_s / exposure.reference_s,
        exposure.read_noise_e,
        exposure.gain * top / exposure.full_well_e,
        1.0 / exposure.binning,
    )
    key64 = np.uint64(_frame_key(key))
    taps = psf_taps(exposure.psf_sigma_px / exposure.binning)
    expose_rows(rows, channels, taps, _normals(), key64, gains, top, counts)
    image = counts.reshape(radiance.shape)
    return image.astype(np.uint8) if exposure.bits == 8 else image
