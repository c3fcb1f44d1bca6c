"""Mistakes in the assembly of the simulated rig, as they act on drive codes, pictures, frames and mounts.

All are functions of their arguments, so that a frame is the same in every run.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Image, Role
from foveacam_hardware.sim.cables import DacCodes
from foveacam_hardware.simulated_assembly import CameraAssembly, FoveaAssembly, SimulatedAssembly

EYES = (Role.LEFT, Role.RIGHT)
LOOSE_NS = 400_000_000
"""Time for which a loose mount stays where it is."""
BAYER_GAINS = np.array([[0.62, 1.0], [1.0, 0.78]])
"""Response of the pixels of a mosaic (red, green; green, blue) to white paper, relative to green."""


def wired_codes(codes: DacCodes, assembly: SimulatedAssembly) -> DacCodes:
    """Return the codes that reach the electrodes: left x+, x-, y+, y-, then right."""
    left, right = codes[:4], codes[4:]
    if assembly.exchanged_mirrors:
        left, right = right, left
    return *_wired(left, assembly.left), *_wired(right, assembly.right)


def _wired(codes: DacCodes, eye: FoveaAssembly) -> DacCodes:
    x, y = codes[:2], codes[2:]
    if eye.exchanged_axes:
        x, y = y, x
    x = x[::-1] if "x" in eye.reversed_axes else x
    y = y[::-1] if "y" in eye.reversed_axes else y
    return *x, *y


def is_lost(assembly: CameraAssembly, role: Role, seq: int) -> bool:
    """Return whether a frame never arrives."""
    if assembly.lost_frames == 0.0:
        return False
    rng = np.random.default_rng([seq, _number(role), 0x1057])
    return bool(rng.random() < assembly.lost_frames)


def mount_turn_rad(eye: FoveaAssembly, role: Role, t_ns: int) -> NDArray[np.float64]:
    """Return the turn (3,) of a fovea's mount about the rig's x, y and z, rad, at `t_ns`."""
    turn_deg = np.array([0.0, eye.mount_drift_deg_per_min * t_ns / 60e9, 0.0])
    if eye.loose_mount_deg > 0.0:
        rng = np.random.default_rng([t_ns // LOOSE_NS, _number(role), 0x100E])
        turn_deg[:2] += eye.loose_mount_deg * rng.standard_normal(2)
    return np.asarray(np.deg2rad(turn_deg), dtype=np.float64)


def delivered_image(
    image: Image, assembly: CameraAssembly, role: Role, *, bits: int, binning: int, seq: int
) -> Image:
    """Return the image that arrives, (h, w) or (h, w, 3), of the one that a sound camera would send.

    Light that is lost is taken from the picture, so its noise is that of a brighter one.
    """
    if assembly == type(assembly)():
        return image
    grey = 2 ** (bits - 8)
    height, width = image.shape[:2]
    shares = _shading(
        height, width, assembly.transmission, assembly.vignetting, mosaic=assembly.bayer_as_grey
    )
    found = image.astype(np.float32) * (shares if image.ndim == 2 else shares[:, :, None])
    if assembly.noise > 0.0:
        rng = np.random.default_rng([seq, _number(role), 0x2015])
        noise = rng.standard_normal(image.shape, dtype=np.float32)
        found += np.float32(grey * assembly.noise / binning) * noise
    found += np.float32(grey * assembly.black_level)
    counts = np.clip(np.rint(found), 0, 2**bits - 1).astype(image.dtype)
    if assembly.hot_fraction > 0.0:
        counts[_hot_pixels(assembly.hot_fraction, role, image.shape[:2])] = 2**bits - 1
    if assembly.lost_bits > 0:
        counts = np.asarray((counts >> assembly.lost_bits) << assembly.lost_bits, dtype=image.dtype)
    return _oriented(counts, assembly)


def _oriented(image: Image, assembly: CameraAssembly) -> Image:
    image = image[:, ::-1] if assembly.mirrored else image
    image = image[::-1, ::-1] if assembly.upside_down else image
    oriented: Image = np.ascontiguousarray(image)  # type: ignore[assignment]  # the stub forgets the dtype
    return oriented


@lru_cache(maxsize=8)
def _shading(
    height: int, width: int, transmission: float, vignetting: float, *, mosaic: bool
) -> NDArray[np.float32]:
    """Return the share of the light that each pixel receives, (h, w)."""
    y, x = np.mgrid[-1.0 : 1.0 : height * 1j, -1.0 : 1.0 : width * 1j]
    shares = transmission * (1.0 - vignetting * (x**2 + y**2) / 2.0)
    if mosaic:
        shares *= np.tile(BAYER_GAINS, (height // 2 + 1, width // 2 + 1))[:height, :width]
    return np.asarray(shares, dtype=np.float32)


@lru_cache(maxsize=4)
def _hot_pixels(fraction: float, role: Role, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    rng = np.random.default_rng([_number(role), 0x407])
    return np.asarray(rng.random(shape) < fraction)


def _number(role: Role) -> int:
    return {Role.WIDE: 0, Role.LEFT: 1, Role.RIGHT: 2}[role]
