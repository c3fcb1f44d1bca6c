"""Build a textured mesh from a depth map: a grid of triangles, without those across jumps of depth."""

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.stereo.depth import disparity_px, edge_mask, points_rig_m, rgb
from foveacam_pipeline.stereo.values import DepthMap, DepthMesh, RectifiedPair

TEAR_PX = 1.5
"""A triangle is left out if its corners differ by more in disparity, beyond the slope of a steep surface."""
SLOPE_PX = 0.25
"""Disparity that a steep surface may gain in one pixel: 0.2 m of baseline at 1.5 m, 60 degrees off."""


def depth_mesh(pair: RectifiedPair, depth: DepthMap, step_px: int = 4) -> DepthMesh:
    """Return the surface with a vertex every `step_px` pixels of the left window, textured by that window."""
    if step_px < 1:
        raise InvalidInput(f"depth mesh with a step of {step_px} px: at least 1 is needed")
    disparity = _smoothed(pair, depth, step_px)
    height, width = disparity.shape
    rows, columns = np.meshgrid(
        np.arange(step_px // 2, height, step_px), np.arange(step_px // 2, width, step_px), indexing="ij"
    )
    corners = disparity[rows, columns]
    faces = _faces(corners, TEAR_PX + SLOPE_PX * step_px)
    used, faces = np.unique(faces, return_inverse=True)
    ys, xs = rows.ravel()[used], columns.ravel()[used]
    f_b = pair.f_px * pair.baseline_m
    z_m = (f_b / corners.ravel()[used]).astype(np.float32)
    return DepthMesh(
        vertices_rig_m=points_rig_m(pair, xs, ys, z_m),
        faces=faces.reshape(-1, 3).astype(np.uint32),
        uv=np.column_stack([(xs + 0.5) / width, (ys + 0.5) / height]).astype(np.float32),
        texture=np.ascontiguousarray(rgb(pair.left)),
    )


def _smoothed(pair: RectifiedPair, depth: DepthMap, step_px: int) -> NDArray[np.float32]:
    """Return total disparity averaged over one grid cell, from known pixels off the edges; NaN elsewhere."""
    disparity = disparity_px(pair, depth)
    usable = np.isfinite(disparity) & ~edge_mask(pair, depth)
    side = max(3, step_px | 1)
    weight = usable.astype(np.float32)
    total = cv2.blur(np.where(usable, disparity, np.float32(0.0)), (side, side))
    share = np.asarray(cv2.blur(weight, (side, side)), dtype=np.float32)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.asarray(total / share, dtype=np.float32)
    mean[share < 0.5] = np.nan
    return mean


def _faces(corners_px: NDArray[np.float32], tear_px: float) -> NDArray[np.int64]:
    """Return (m, 3) indices into the flattened grid; counter-clockwise as seen from the rig."""
    faces = grid_faces(*corners_px.shape)
    spread = np.ptp(corners_px.ravel()[faces], axis=1)
    whole: NDArray[np.int64] = faces[spread <= tear_px]  # a triangle with an unknown corner compares false
    return whole


def grid_faces(rows: int, columns: int) -> NDArray[np.int64]:
    """Return (m, 3) indices of all faces of a grid of vertices; counter-clockwise as seen from the rig."""
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b = index[:-1, :-1].ravel(), index[:-1, 1:].ravel()
    c, d = index[1:, :-1].ravel(), index[1:, 1:].ravel()
    return np.concatenate([np.column_stack([a, c, b]), np.column_stack([b, c, d])])
