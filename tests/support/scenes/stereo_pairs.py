"""Rectified pairs made to order: windows of one texture, moved against each other by a known disparity."""

from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.stereo.values import RectifiedPair
from tests.support.scenes.plane_head import noise_texture

WIDTH, HEIGHT = 480, 270
F_PX = 14_380.0
BASELINE_M = 0.2


def pair_of(
    disparity_px: NDArray[np.float64], *, offset_px: float = 280.0, noise: float = 1.0, gain: float = 1.0
) -> RectifiedPair:
    """Return a pair whose left pixel (x, y) has the residual `disparity_px[y, x]`; it must vary gently."""
    rng = np.random.default_rng(11)
    columns, rows = np.meshgrid(np.arange(WIDTH, dtype=np.float64), np.arange(HEIGHT, dtype=np.float64))
    source = columns.copy()
    for _ in range(60):  # the left column that each right column shows: x_left = x_right + d(x_left)
        at = np.clip(np.rint(source).astype(int), 0, WIDTH - 1)
        source = 0.5 * source + 0.5 * (columns + disparity_px[rows.astype(int), at])
    seen = np.ones((HEIGHT, WIDTH), dtype=np.bool_)
    return RectifiedPair(
        left=_window(columns, rows, rng, noise=noise, gain=1.0),
        right=_window(source, rows, rng, noise=noise, gain=gain),
        valid_left=seen,
        valid_right=seen.copy(),
        f_px=F_PX,
        baseline_m=BASELINE_M,
        u0_left_px=offset_px - WIDTH / 2,
        u0_right_px=-WIDTH / 2,
        v0_px=-HEIGHT / 2,
        pose_sigma_px=0.4,
        t_ns=7,
    )


@cache
def _texture() -> NDArray[np.float32]:
    return np.asarray(cv2.GaussianBlur(noise_texture(5), (0, 0), 0.7), dtype=np.float32)


def flat(disparity_px: float) -> NDArray[np.float64]:
    return np.full((HEIGHT, WIDTH), disparity_px)


def _window(
    columns: NDArray[np.float64],
    rows: NDArray[np.float64],
    rng: np.random.Generator,
    *,
    noise: float,
    gain: float,
) -> NDArray[np.uint8]:
    maps = (columns + 400.0).astype(np.float32), (rows + 400.0).astype(np.float32)
    image = gain * cv2.remap(_texture(), *maps, cv2.INTER_LANCZOS4) + rng.normal(0.0, noise, columns.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)
