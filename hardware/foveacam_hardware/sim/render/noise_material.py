"""The tile of band-limited noise of which all noise materials consist, with its mip levels.

One periodic tile holds the wavelengths from 5 to 80 texels, equal power in every octave (1/f). Layers of
it, each 16 times finer than the last, rotated and offset, add up to 1/f over any range of scales.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

F32 = NDArray[np.float32]

TILE_BITS = 10
TILE = 1 << TILE_BITS
"""Texels along a side of level 0."""
LEVELS = 4
"""Mip levels with content: the next would begin at the tile's longest wavelength."""
SHORTEST = 5.0
"""Shortest wavelength of a level, in its own texels, so long that bilinear fetches do not show texels."""
RATIO = 16.0
"""Longest over shortest wavelength of the tile, and the step in scale from a layer to the next."""
LONGEST = SHORTEST * RATIO
_EDGE_OCTAVES = 0.35
"""Half width of the spectrum's soft edges."""


def _above(octave: NDArray[np.float64], edge: float) -> NDArray[np.float64]:
    """Rise smoothly from 0 to 1 about `edge`; neighbouring bands' powers add up to 1."""
    t = np.clip((octave - edge) / (2 * _EDGE_OCTAVES) + 0.5, 0.0, 1.0)
    rise: NDArray[np.float64] = np.sin(t * np.pi / 2)
    return rise


def _spectrum(seed: int) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:
    """Return the tile's spectrum, standard deviation 1 an octave, and log2 of its wavelengths in texels."""
    rng = np.random.default_rng(seed)
    white = np.fft.rfft2(rng.standard_normal((TILE, TILE)))
    f = np.hypot(np.fft.fftfreq(TILE)[:, None], np.fft.rfftfreq(TILE)[None, :])
    f[0, 0] = 1.0
    wavelength = -np.log2(f)
    # White noise has the variance 2 pi f df in a ring: 1/f over it gives 2 pi ln 2 an octave.
    pink = white / (f * np.sqrt(2 * np.pi * np.log(2.0)))
    band = _above(wavelength, np.log2(SHORTEST)) * _above(-wavelength, -np.log2(LONGEST))
    pink *= band
    pink[0, 0] = 0.0
    return pink, wavelength


@lru_cache(maxsize=2)
def noise_levels(seed: int = 20) -> F32:
    """Return the levels one after another, each (n·n,) row by row, n = TILE, TILE/2, …; read-only."""
    pink, wavelength = _spectrum(seed)
    levels = []
    for level in range(LEVELS):
        n = TILE >> level
        kept = pink * _above(wavelength, np.log2(SHORTEST) + level) if level else pink
        half = n // 2
        rows = np.concatenate([kept[:half], kept[TILE - half :]])[:, : half + 1].copy()
        rows[half] = 0.0
        rows[:, half] = 0.0
        levels.append(np.fft.irfft2(rows, s=(n, n)).ravel() / 4.0**level)
    flat: F32 = np.concatenate(levels).astype(np.float32)
    flat.flags.writeable = False
    return flat
