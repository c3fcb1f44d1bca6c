"""Exact disparity between two projections, from depth: what matchers are measured against."""

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract.errors import InvalidInput
from foveacam_hardware.sim.render.projection import Projection

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]
I32 = NDArray[np.int32]

SAME = 2e-3
"""Two depths within this part of each other are the same surface."""


def _seen(xy: F64, depth_m: F64, object_ids: I32, right_depth_m: F32, right_ids: I32) -> NDArray[np.bool_]:
    """Whether one of the four pixels about xy (n, 2) of the right image shows the same object as deep."""
    height, width = right_ids.shape
    seen = np.zeros(len(xy), bool)
    finite: NDArray[np.bool_] = np.isfinite(xy[:, 0]) & np.isfinite(xy[:, 1])
    corner = np.floor(np.where(finite[:, None], xy, -9.0)).astype(np.int64)
    for dx in (0, 1):
        for dy in (0, 1):
            j, i = corner[:, 0] + dx, corner[:, 1] + dy
            inside = finite & (j >= 0) & (i >= 0) & (j < width) & (i < height)
            j, i = np.where(inside, j, 0), np.where(inside, i, 0)
            close = np.abs(right_depth_m[i, j] - depth_m) < SAME * depth_m
            seen |= inside & close & (right_ids[i, j] == object_ids)
    return seen


def disparity_of(
    left: Projection, left_depth_m: F32, left_ids: I32, right: Projection, right_depth_m: F32, right_ids: I32
) -> tuple[F32, NDArray[np.bool_]]:
    """Return x_left − x_right (h, w), NaN where nothing is hit, and the mask of points seen by both."""
    if right.rays is not None:
        raise InvalidInput(
            "disparity: the right projection has a ray table; pass one without lens distortion"
        )
    y, x = np.divmod(np.arange(left.height * left.width), left.width)
    hit = np.flatnonzero(np.isfinite(left_depth_m.ravel()))
    pixels = np.column_stack([x[hit], y[hit]]).astype(np.float64)
    points = left.points(pixels, left_depth_m.ravel()[hit])
    xy = right.project(points)
    disparity = np.full(left.height * left.width, np.nan, np.float32)
    disparity[hit] = pixels[:, 0] - xy[:, 0]
    mask = np.zeros(left.height * left.width, bool)
    depth = (points - right.C) @ right.axis
    mask[hit] = _seen(xy, depth, left_ids.ravel()[hit], right_depth_m, right_ids)
    shape = (left.height, left.width)
    return disparity.reshape(shape), mask.reshape(shape)
