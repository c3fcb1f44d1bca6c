"""Viewing geometry of a pair, and conditioning on it: scale and offset of the network's tokens (FiLM)."""

import math

import torch
from torch import Tensor, nn

from foveacam_pipeline.stereo.values import RectifiedPair

NUMBERS = 8
LARGEST_ANGLE_RAD = math.radians(10.0)
HIDDEN = 64
USUAL_F_PX = 7000.0


class GeometryFilm(nn.Module):
    """Scales and shifts each channel of tokens by the geometry; initially the identity."""

    def __init__(self, width: int) -> None:
        super().__init__()
        last = nn.Linear(HIDDEN, 2 * width)
        nn.init.zeros_(last.weight)
        nn.init.zeros_(last.bias)
        self.terms = nn.Sequential(nn.Linear(NUMBERS, HIDDEN), nn.GELU(), last)

    def forward(self, tokens: Tensor, geometry: Tensor) -> Tensor:
        """Return tokens (n, c, h, w) for geometries (n, 8)."""
        scale, offset = self.terms(geometry)[:, :, None, None].chunk(2, dim=1)
        changed: Tensor = tokens * (1.0 + scale) + offset
        return changed


def view_geometry(pair: RectifiedPair, window: tuple[slice, slice] | None = None) -> Tensor:
    """Return (8,): gazes of both eyes, 1/Z, log f, baseline, offset; of a pair, or of a window of it.

    `window`: rows and columns. Angles in units of 10 degrees, 1/Z of the vergence in 1/10 m, the baseline in
    0.2 m, the offset in widths of the pair.
    """
    height, width = pair.left.shape[:2]
    rows, columns = window or (slice(0, height), slice(0, width))
    x_px, y_px = ((part.start + part.stop - 1) / 2.0 for part in (columns, rows))
    middles = [
        middle
        for u0_px in (pair.u0_left_px, pair.u0_right_px)
        for middle in (u0_px + x_px, pair.v0_px + y_px)
    ]
    angles = [math.atan(middle / pair.f_px) / LARGEST_ANGLE_RAD for middle in middles]
    others = [
        10.0 / pair.verged_z_m,
        math.log(pair.f_px / USUAL_F_PX),
        pair.baseline_m / 0.2,
        pair.offset_px / width,
    ]
    return torch.tensor(angles + others, dtype=torch.float32)


def mirrored_geometry(geometry: Tensor) -> Tensor:
    """Return the geometry (8,) of pictures mirrored left to right, which exchanges the eyes."""
    changed = geometry.clone()
    changed[[0, 2]] = -geometry[[2, 0]]
    return changed


def turned_geometry(geometry: Tensor) -> Tensor:
    """Return the geometry (8,) of pictures mirrored top to bottom."""
    changed = geometry.clone()
    changed[[1, 3]] = -geometry[[1, 3]]
    return changed
