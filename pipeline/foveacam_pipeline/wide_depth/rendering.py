"""Renderings of the wide context: a textured mesh, a point cloud and a picture of the depth."""

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.stereo.mesh import grid_faces
from foveacam_pipeline.stereo.pictures import depth_picture
from foveacam_pipeline.stereo.values import Cloud, DepthMap, DepthMesh
from foveacam_pipeline.wide_depth.values import ContextMap

TEAR_RELATIVE = 0.05
"""Neighbouring cells whose 1/Z differs by a larger share are not joined."""
BEHIND = 1.004
"""Factor by which the mesh is moved away, so that the fine mesh of a fovea is drawn in front of it."""
PICTURE_CELL_PX = 4
"""Side of a cell in the picture, px."""
TEXTURE_WIDTH_PX = 1024
BACKDROP_COLUMNS, BACKDROP_ROWS = 48, 36
BACKDROP_WIDTH_PX = 512
NEARBY_CELLS = 8
"""A fovea covers some twenty cells: the backdrop takes the farthest surface that one shows."""
BACKDROP_BEHIND = 1.01
"""As `BEHIND`, behind the measured surface."""
PALENESS = 0.55
"""Contrast of the backdrop's grey picture, as a share of the picture's."""


def context_mesh(known: ContextMap, picture: NDArray[np.uint8], wide: Intrinsics) -> DepthMesh:
    """Return the primary surfaces as a mesh with one vertex a cell, textured by the wide image (h, w, 3).

    There are no faces across jumps of depth, nor between cells without depth.
    """
    q = known.inverse_z_per_m[0]
    faces = _faces(q)
    used, faces = np.unique(faces, return_inverse=True)
    tangents = known.tangents[0].reshape(-1, 2)[used]
    pixels = wide.pixels(np.arctan(tangents))
    z_m = BEHIND / q.ravel()[used]
    return DepthMesh(
        vertices_rig_m=np.column_stack([tangents * z_m[:, None], z_m]).astype(np.float32).reshape(-1, 3),
        faces=faces.reshape(-1, 3).astype(np.uint32),
        uv=((pixels + 0.5) / (wide.width, wide.height)).astype(np.float32),
        texture=_texture(picture, TEXTURE_WIDTH_PX),
    )


def backdrop_mesh(known: ContextMap, picture: NDArray[np.uint8], wide: Intrinsics) -> DepthMesh | None:
    """Return the whole wide view as a pale surface through what is known of its depth; None without any.

    Between known cells 1/Z is interpolated, beyond them it is continued: the surface shows what stands where
    in the view, not its depth, and is grey so that it is not taken for a measurement.
    """
    whole = filled(_farthest_nearby(known.inverse_z_per_m[0]))
    if whole is None:
        return None
    x_px, y_px = np.meshgrid(
        np.linspace(-0.5, wide.width - 0.5, BACKDROP_COLUMNS + 1),
        np.linspace(-0.5, wide.height - 0.5, BACKDROP_ROWS + 1),
    )
    q = cv2.resize(whole, (BACKDROP_COLUMNS + 1, BACKDROP_ROWS + 1), interpolation=cv2.INTER_AREA)
    tangents = np.tan(wide.angles_rad(np.column_stack([x_px.ravel(), y_px.ravel()])))
    z_m = BACKDROP_BEHIND / q.ravel()
    grey = cv2.cvtColor(_texture(picture, BACKDROP_WIDTH_PX), cv2.COLOR_RGB2GRAY).astype(np.float32)
    pale = np.clip(128.0 + PALENESS * (grey - 128.0), 0.0, 255.0).astype(np.uint8)
    uv = np.column_stack([x_px.ravel() + 0.5, y_px.ravel() + 0.5]) / (wide.width, wide.height)
    return DepthMesh(
        vertices_rig_m=np.column_stack([tangents * z_m[:, None], z_m]).astype(np.float32),
        faces=grid_faces(*x_px.shape).astype(np.uint32),
        uv=uv.astype(np.float32),
        texture=np.repeat(pale[:, :, None], 3, axis=2),
    )


def filled(q: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Return a grid (rows, columns) whose NaN cells are filled smoothly from the known ones; None if all are.

    By pyramids: each level averages the known cells of the finer one, until all are known; on the way back
    unknown cells take the coarser level's value, interpolated.
    """
    known = np.isfinite(q)
    if not known.any():
        return None
    if known.all():
        return q
    weight, value = known.astype(np.float64), np.where(known, q, 0.0)
    size = (max(1, (q.shape[1] + 1) // 2), max(1, (q.shape[0] + 1) // 2))
    coarse_weight = cv2.resize(weight, size, interpolation=cv2.INTER_AREA)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = cv2.resize(value, size, interpolation=cv2.INTER_AREA) / coarse_weight
    coarse = filled(np.where(coarse_weight > 0.0, mean, np.nan))
    if coarse is None:
        return None
    between = cv2.resize(coarse, (q.shape[1], q.shape[0]), interpolation=cv2.INTER_LINEAR)
    return np.where(known, q, between)


def _farthest_nearby(q: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a grid whose known cells have the least 1/Z nearby, so that near surfaces stand before it."""
    kernel = np.ones((2 * NEARBY_CELLS + 1,) * 2, dtype=np.uint8)
    known = np.isfinite(q)
    least = cv2.erode(np.where(known, q, np.inf), kernel, borderType=cv2.BORDER_REPLICATE)
    return np.where(known, least, np.nan)


def context_cloud(known: ContextMap, picture: NDArray[np.uint8] | None, wide: Intrinsics) -> Cloud:
    """Return one point for each surface, coloured by the wide image (h, w, 3), binned or not; or grey."""
    at = known.known
    tangents, q = known.tangents[at], known.inverse_z_per_m[at]
    z_m = 1.0 / q
    colors = np.full((len(q), 3), 128, dtype=np.uint8)
    if picture is not None and len(q):
        own = wide.of_picture(picture.shape)
        x, y = np.rint(own.pixels(np.arctan(tangents)).T).astype(np.intp)
        height, width = picture.shape[:2]
        colors = picture[np.clip(y, 0, height - 1), np.clip(x, 0, width - 1)]
    return Cloud(
        points_rig_m=np.column_stack([tangents * z_m[:, None], z_m]).astype(np.float32).reshape(-1, 3),
        colors=colors,
        sigma_m=(known.sigma_per_m[at] * z_m**2).astype(np.float32),
    )


def context_picture(known: ContextMap) -> NDArray[np.uint8]:
    """Return (h, w, 3) uint8: depth as colours with a scale, 4 px a cell; cells without depth are striped."""
    z_m = (1.0 / known.inverse_z_per_m[0]).astype(np.float32)
    enlarged = np.repeat(np.repeat(z_m, PICTURE_CELL_PX, axis=0), PICTURE_CELL_PX, axis=1)
    return depth_picture(DepthMap(z_m=enlarged, sigma_m=enlarged, pose_sigma_m=enlarged))


def without_specks(known: ContextMap) -> ContextMap:
    """Return the map without primary surfaces that none of the eight neighbours continues (mismatches)."""
    q = known.inverse_z_per_m[0]
    padded = np.pad(q, 1, constant_values=np.nan)
    rows, columns = q.shape
    alone = np.isfinite(q)
    for row in range(3):
        for column in range(3):
            if (row, column) == (1, 1):
                continue
            beside = padded[row : row + rows, column : column + columns]
            alone &= ~(np.abs(beside - q) <= TEAR_RELATIVE * q)
    cleaned = replace(known, inverse_z_per_m=known.inverse_z_per_m.copy())
    cleaned.inverse_z_per_m[0][alone] = np.nan
    return cleaned


def _faces(q: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return (m, 3) indices into the flattened grid; counter-clockwise as seen from the rig."""
    faces = grid_faces(*q.shape)
    corners = q.ravel()[faces]
    whole: NDArray[np.int64] = faces[np.ptp(corners, axis=1) <= TEAR_RELATIVE * corners.max(axis=1)]
    return whole


def _texture(picture: NDArray[np.uint8], width_px: int) -> NDArray[np.uint8]:
    """Return a picture (h, w, 3) of another width."""
    height_px = round(width_px * picture.shape[0] / picture.shape[1])
    resized = cv2.resize(picture, (width_px, height_px), interpolation=cv2.INTER_AREA)
    return np.asarray(resized, dtype=np.uint8)
