"""Writes the fused depth: depth and error as TIFF, a heat map, a coloured point cloud, a textured mesh."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.capture.dataset.images import ImageCodec, encode
from foveacam_pipeline.capture.dataset.rectified import disparity_bytes
from foveacam_pipeline.capture.mosaic.chart import CELL, Chart
from foveacam_pipeline.capture.mosaic.fuse import FieldDepth
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.depth import cloud, rgb
from foveacam_pipeline.stereo.mesh import depth_mesh
from foveacam_pipeline.stereo.pictures import depth_picture
from foveacam_pipeline.stereo.ply import ply_bytes
from foveacam_pipeline.stereo.values import DepthMap, DepthMesh, RectifiedPair
from foveacam_pipeline.storage.disk import write_file

Picture = NDArray[np.uint8]
MESH_STEP = 3
"""Cells between neighbouring vertices."""
MeshFile = Callable[[DepthMesh], bytes]


def write_depth_files(
    folder: Path,
    chart: Chart,
    depth: FieldDepth,
    texture: Picture,
    *,
    calibration: Calibration,
    eye: Role,
    cloud_points: int,
    mesh_file: MeshFile | None = None,
) -> None:
    """Write depth.tiff, depth_sigma.tiff, depth.png, cloud.ply and, by `mesh_file`, mesh.glb. Raise OSError.

    `texture`: the mosaic at any size.
    """
    whole = DepthMap(z_m=depth.z_m, sigma_m=depth.sigma_m, pose_sigma_m=np.zeros_like(depth.sigma_m))
    write_file(folder / "depth.tiff", disparity_bytes(whole.z_m))
    write_file(folder / "depth_sigma.tiff", disparity_bytes(whole.sigma_m))
    write_file(folder / "depth.png", encode(depth_picture(whole), ImageCodec.PNG))
    seen = cell_pair(chart, texture, calibration)
    if not np.isfinite(whole.z_m).any():
        return
    aside = calibration.reference_rig_m(eye) - calibration.reference_rig_m(Role.LEFT)
    points = cloud(seen, whole, max_points=cloud_points)
    points = replace(points, points_rig_m=(points.points_rig_m + aside).astype(np.float32))
    write_file(folder / "cloud.ply", ply_bytes(points))
    mesh = depth_mesh(seen, whole, step_px=MESH_STEP)
    if mesh_file is not None and len(mesh.faces):
        vertices = (mesh.vertices_rig_m + aside).astype(np.float32)
        write_file(
            folder / "mesh.glb", mesh_file(replace(mesh, vertices_rig_m=vertices, texture=rgb(texture)))
        )


def cell_pair(chart: Chart, texture: Picture, calibration: Calibration) -> RectifiedPair:
    """Return the cells of a chart as the left window of a pair, with a focal length in cells."""
    size = (chart.columns, chart.rows)
    image = np.asarray(cv2.resize(texture, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    seen = np.ones(image.shape[:2], dtype=np.bool_)
    middle = (CELL - 1) / 2
    return RectifiedPair(
        left=image,
        right=image,
        valid_left=seen,
        valid_right=seen,
        f_px=chart.f_px / CELL,
        baseline_m=calibration.baseline_m,
        u0_left_px=(chart.u0_px + middle) / CELL,
        u0_right_px=0.0,
        v0_px=(chart.v0_px + middle) / CELL,
        pose_sigma_px=0.0,
        t_ns=0,
    )
