"""Export to nerfstudio: fovea views with poses in OpenGL axes (world z up), and seed points as PLY."""

import json
from pathlib import Path

import numpy as np

from foveacam_pipeline.capture.dataset.export.target import ExportChoice, write_png
from foveacam_pipeline.capture.dataset.export.views import (
    ExportView,
    fovea_camera,
    fovea_views,
    pose_calibration,
    seeds_of,
)
from foveacam_pipeline.capture.dataset.reader import Dataset

NERF_FROM_RIG = np.array(
    [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
)
"""The rig's z becomes y, its y (down) becomes -z."""
OPENCV_FROM_OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])
TRANSFORMS = "transforms.json"
SEEDS = "seeds.ply"


def export_nerfstudio(dataset: Dataset, folder: Path, choice: ExportChoice) -> None:
    """Write images/, transforms.json and seeds.ply into an empty folder."""
    calibration = pose_calibration(dataset)
    camera = fovea_camera(calibration, scale=choice.scale)
    frames, points, colours = [], [], []
    for point in dataset:
        for view in fovea_views(point, calibration, scale=choice.scale):
            write_png(folder / "images" / view.name, view.image)
            frames.append(_frame(view))
        seeds = seeds_of(point, max_points=choice.seeds_per_pair)
        points.append(seeds.points_world_m @ NERF_FROM_RIG[:3, :3].T)
        colours.append(seeds.colors)
        choice.report_point(point.index)
    document = {
        "camera_model": "OPENCV",
        "w": camera.width,
        "h": camera.height,
        "fl_x": camera.f_px,
        "fl_y": camera.f_px,
        "cx": camera.cx_px + 0.5,
        "cy": camera.cy_px + 0.5,
        **dict.fromkeys(("k1", "k2", "p1", "p2"), 0.0),
        "applied_transform": NERF_FROM_RIG[:3].tolist(),
        "ply_file_path": SEEDS,
        "frames": frames,
    }
    (folder / TRANSFORMS).write_text(json.dumps(document, indent=1), encoding="utf-8")
    (folder / SEEDS).write_bytes(ply_of(np.concatenate(points), np.concatenate(colours)))


def ply_of(points_m: np.ndarray, colours: np.ndarray) -> bytes:
    """Return a binary PLY of (n, 3) points, m, and (n, 3) uint8 RGB colours."""
    kind = [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("red", "u1"), ("green", "u1"), ("blue", "u1")]
    vertices = np.empty(len(points_m), dtype=kind)
    for column, name in enumerate("xyz"):
        vertices[name] = points_m[:, column]
    for column, name in enumerate(("red", "green", "blue")):
        vertices[name] = colours[:, column]
    properties = [f"property {'uchar' if form == 'u1' else 'float'} {name}" for name, form in kind]
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(points_m)}", *properties]
    return "\n".join([*header, "end_header\n"]).encode("ascii") + vertices.tobytes()


def _frame(view: ExportView) -> dict[str, object]:
    pose = NERF_FROM_RIG @ view.world_from_camera @ OPENCV_FROM_OPENGL
    return {"file_path": f"images/{view.name}", "transform_matrix": pose.tolist()}
