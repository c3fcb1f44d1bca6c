"""Sparse 3D points for programs that start from some: taken from the dataset's own stereo."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import NotCalibrated
from foveacam_pipeline.capture.dataset.reader import DatasetPoint
from foveacam_pipeline.stereo.depth import cloud, depth_map
from foveacam_pipeline.stereo.match import match
from foveacam_pipeline.stereo.values import Cloud

HALF = 0.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Seeds:
    """Points that both foveae of a point of the dataset see; (n, 3) m world, (n, 3) uint8 RGB."""

    points_world_m: NDArray[np.float64]
    colors: NDArray[np.uint8]


def seeds_of(point: DatasetPoint, *, most: int, bracket: int = 0) -> Seeds:
    """Return at most `most` points of the pair's depth; none when `most` is 0 or nothing was matched."""
    found = _cloud(point, most, bracket) if most > 0 else None
    if found is None:
        return Seeds(points_world_m=np.empty((0, 3)), colors=np.empty((0, 3), dtype=np.uint8))
    points = found.points_rig_m.astype(np.float64)
    points[:, 0] += point.place.rail_m or 0.0
    return Seeds(points_world_m=points, colors=found.colors)


def _cloud(point: DatasetPoint, most: int, bracket: int) -> Cloud | None:
    try:
        pair = point.rectified(scale=HALF, bracket=bracket)
    except NotCalibrated:
        return None
    depth = depth_map(pair, match(pair))
    return cloud(pair, depth, max_points=most) if np.isfinite(depth.z_m).any() else None
