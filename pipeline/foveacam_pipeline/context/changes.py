"""Which parts of the wide view look different from when their depth was measured.

Each cell of the grid is kept as the mean brightness of 2 x 2 blocks. A block has changed when its brightness
differs by more than noise, quantisation and a common change of the light explain.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.verge.texture import LEAST_VARIANCE, noise_level

BLOCKS = 2
"""Blocks along each side of a cell."""
LEAST_CHANGE = 6.0
"""Smallest change of a block's mean, in standard deviations of its noise."""
LEAST_SHARE = 0.04
"""Smallest change of a block's mean as a share of its brightness: exposure and shading vary."""
CLIPPED = (4.0, 250.0)
"""Means outside these grey levels say nothing of the light as a whole."""


def block_means(gray: NDArray[np.uint8], *, cell_px: int) -> NDArray[np.float32]:
    """Return (2 rows, 2 columns) float32, the mean grey level of each block of the grid's cells.

    A last row or column of cells that the image fills in part is filled with the image's rim.
    """
    height, width = gray.shape
    rows, columns = -(-height // cell_px), -(-width // cell_px)
    below, beside = rows * cell_px - height, columns * cell_px - width
    whole = cv2.copyMakeBorder(gray, 0, below, 0, beside, cv2.BORDER_REPLICATE) if below or beside else gray
    size = (BLOCKS * columns, BLOCKS * rows)
    means = cv2.resize(whole.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    return np.asarray(means, dtype=np.float32)


def noise_per_level(gray: NDArray[np.uint8]) -> float:
    """Return the variance of the brightness noise per grey level of brightness."""
    height, width = gray.shape
    around = np.array([width / 2, height / 2])
    level = max(
        1.0, float(gray[height // 2 - 16 : height // 2 + 17, width // 2 - 16 : width // 2 + 17].mean())
    )
    return max(0.0, (noise_level(gray, at_px=around) ** 2 - LEAST_VARIANCE) / level)


def changed_cells(
    reference: NDArray[np.float32], now: NDArray[np.float32], *, noise: float, cell_px: int
) -> NDArray[np.bool_]:
    """Return (rows, columns) bool: cells with a block that has changed. NaN in `reference` has not.

    `noise`: variance per grey level of one px. A common factor of all brightness is no change.
    """
    clear = np.isfinite(reference) & (reference > CLIPPED[0]) & (reference < CLIPPED[1]) & (now < CLIPPED[1])
    gain = float(np.median(now[clear] / reference[clear])) if clear.any() else 1.0
    expected = np.minimum(gain * reference, 255.0)
    pixels = (cell_px / BLOCKS) ** 2
    variance = 2.0 * (LEAST_VARIANCE + noise * np.maximum(expected, 1.0)) / pixels
    limit = np.hypot(LEAST_CHANGE * np.sqrt(variance), LEAST_SHARE * expected)
    changed = np.abs(now - expected) > limit  # NaN compares as unchanged
    rows, columns = changed.shape
    cells = changed.reshape(rows // BLOCKS, BLOCKS, columns // BLOCKS, BLOCKS).any(axis=(1, 3))
    return np.asarray(cells, dtype=np.bool_)
