"""Synthetic pair of known disparities: a textured wall and a box, behind and before the vergence point."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.stereo.values import RectifiedPair

WALL_PX, BOX_PX = -6.0, 9.0
"""Residual disparities of the wall and of the box before it."""
_OFFSET_PX = 280.0
_F_PX, _BASELINE_M = 14_000.0, 0.2


@dataclass(frozen=True, slots=True, kw_only=True)
class KnownPair:
    """A pair, its residual disparities (h, w), px, and where both eyes see the same surface, (h, w) bool."""

    pair: RectifiedPair
    residual_px: NDArray[np.float32]
    seen: NDArray[np.bool_]


def known_pair(width: int = 384, height: int = 256) -> KnownPair:
    """Return the pair at a size, px: always the same pictures, RGB, with texture of several widths."""
    wall, box = (_texture(height, width + 64, seed) for seed in (1, 2))
    inside = slice(height // 4, 3 * height // 4), slice(width // 3, 2 * width // 3)
    columns = np.arange(width, dtype=np.float32)
    residual = np.full((height, width), WALL_PX, dtype=np.float32)
    residual[inside] = BOX_PX
    left = _seen(wall, columns)
    left[inside] = _seen(box, columns)[inside]
    right = _seen(wall, columns + WALL_PX)
    rows, places = inside
    moved = slice(places.start - round(BOX_PX), places.stop - round(BOX_PX))
    right[rows, moved] = _seen(box, columns + BOX_PX)[rows, moved]
    valid = np.ones((height, width), dtype=np.bool_)
    pair = RectifiedPair(
        left=left,
        right=right,
        valid_left=valid,
        valid_right=valid,
        f_px=_F_PX,
        baseline_m=_BASELINE_M,
        u0_left_px=_OFFSET_PX / 2,
        u0_right_px=-_OFFSET_PX / 2,
        v0_px=0.0,
        pose_sigma_px=0.05,
        t_ns=0,
    )
    return KnownPair(pair=pair, residual_px=residual, seen=_both(residual, inside))


def _both(residual_px: NDArray[np.float32], inside: tuple[slice, slice]) -> NDArray[np.bool_]:
    """Return where the surface of a left pixel lies in the right picture and is not behind the box there."""
    seen = np.ones(residual_px.shape, dtype=np.bool_)
    hidden = round(BOX_PX - WALL_PX)
    rows, places = inside
    seen[rows, places.start - hidden : places.start] = False
    seen[:, residual_px.shape[1] + round(WALL_PX) :] = False
    return seen


def _texture(height: int, width: int, seed: int) -> NDArray[np.float32]:
    rng = np.random.default_rng(seed)
    total = np.zeros((height, width, 3), dtype=np.float32)
    for sigma_px in (1.0, 3.0, 9.0):
        noise = rng.standard_normal((height, width, 3)).astype(np.float32)
        smooth = np.asarray(cv2.GaussianBlur(noise, (0, 0), sigma_px), dtype=np.float32)
        total += smooth / smooth.std()
    return 128.0 + 28.0 * total


def _seen(texture: NDArray[np.float32], columns: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return (h, w, 3) uint8: the texture at these columns, rounded, 16 px beyond its left border."""
    taken = texture[:, np.rint(columns).astype(np.intp) + 16]
    return np.clip(np.rint(taken), 0, 255).astype(np.uint8)
