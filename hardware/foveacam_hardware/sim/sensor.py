"""Turns radiance into the picture that a camera of a role would deliver with its settings."""

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import CameraSettings, Image, PixelFormat, Role
from foveacam_hardware.sim.render.sensor import SensorExposure, expose

REFERENCE_S = 0.0076
"""White fills the well in this time: lamps and stops are set for 8 ms, one period of mains flicker."""
PSF_SIGMA_PX = {Role.WIDE: 0.6, Role.LEFT: 1.4, Role.RIGHT: 1.4}
"""At f/21.5 the foveae are limited by diffraction: 0.29 cycles/px, a Gaussian of 1.4 px (deduced)."""


def develop(
    radiance: NDArray[np.float32], role: Role, settings: CameraSettings, *, key: tuple[int, int, int]
) -> Image:
    """Return the image of mean radiance (h, w[, 3]); `key` (seed, camera, frame) alone decides the noise."""
    exposure = SensorExposure(
        exposure_s=settings.exposure_ns * 1e-9,
        reference_s=REFERENCE_S,
        gain=10.0 ** (settings.gain_db / 20.0),
        bits=12 if settings.pixel_format is PixelFormat.MONO12 else 8,
        psf_sigma_px=PSF_SIGMA_PX[role],
    )
    image = expose(radiance, exposure, key)
    return image if settings.black_level == 0.0 else _lifted(image, settings.black_level, exposure.bits)


def _lifted(image: Image, black_level: float, bits: int) -> Image:
    """Return the image with its black raised by `black_level`, grey levels of 8 bits."""
    offset, white = round(black_level * 2 ** (bits - 8)), 2**bits - 1
    lifted: NDArray[np.int32] = np.minimum(image.astype(np.int32) + offset, white)
    return lifted.astype(np.uint8) if bits == 8 else lifted.astype(np.uint16)
