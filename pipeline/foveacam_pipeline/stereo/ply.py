"""A point cloud as PLY: binary little endian, one vertex a point, units and frame in comments."""

import numpy as np

from foveacam_pipeline.stereo.values import Cloud

VERTEX = np.dtype(
    [
        ("x", "<f4"),
        ("y", "<f4"),
        ("z", "<f4"),
        ("red", "u1"),
        ("green", "u1"),
        ("blue", "u1"),
        ("sigma", "<f4"),
    ]
)
TYPES = {"<f4": "float", "|u1": "uchar"}


def ply_bytes(cloud: Cloud) -> bytes:
    """Return the content of the PLY file."""
    vertices = np.empty(len(cloud), dtype=VERTEX)
    vertices["x"], vertices["y"], vertices["z"] = cloud.points_rig_m.T
    vertices["red"], vertices["green"], vertices["blue"] = cloud.colors.T
    vertices["sigma"] = cloud.sigma_m
    fields = (VERTEX.fields or {}).items()
    header = [
        "ply",
        "format binary_little_endian 1.0",
        "comment FoveaCam Duo point cloud",
        "comment frame: rig (= wide camera), x right, y down, z forward, origin at the wide camera's centre",
        "comment units: metres; sigma is the standard error along z, metres",
        f"element vertex {len(cloud)}",
        *(f"property {TYPES[kind.str]} {name}" for name, (kind, *_) in fields),
        "end_header\n",
    ]
    return "\n".join(header).encode("ascii") + vertices.tobytes()
