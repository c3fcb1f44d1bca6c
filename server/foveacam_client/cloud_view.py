"""A point cloud as HTML that needs no server: an iframe whose page has the points and a renderer in it."""

import base64
import html
import json
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING

from foveacam_client.document import JsonObject

if TYPE_CHECKING:
    from foveacam_client.clouds import PointCloud

MAX_POINTS = 5_500
"""A point takes 12 characters; of a larger cloud so many are chosen at random."""
_SEED = 1
HEIGHT_PX = 320
_STEPS = 65_535


def cloud_frame(cloud: "PointCloud") -> str:
    """Return a cloud as an iframe in which it can be turned; a sentence where it has no points."""
    if len(cloud) == 0:
        return "<p>The point cloud has no points.</p>"
    try:
        drawn = _drawn_cloud(cloud)
    except ImportError:
        return "<p>The point cloud is shown where numpy is installed: pip install numpy</p>"
    page = html.escape(_page(drawn, points=len(cloud)), quote=True)
    return (
        '<iframe sandbox="allow-scripts" title="Point cloud"'
        f' style="width:100%;height:{HEIGHT_PX}px;border:0" srcdoc="{page}"></iframe>'
    )


def _page(drawn: JsonObject, *, points: int) -> str:
    count = drawn["count"]
    shown = f"{points} points" if count == points else f"{count} of {points} points"
    caption = f"{shown}; drag to turn, wheel to zoom, double-click to reset"
    content = json.dumps(drawn).replace("<", "\\u003c")
    return _template().replace("CAPTION", caption).replace("CLOUD", content)


def _drawn_cloud(cloud: "PointCloud") -> JsonObject:
    """Return the points, quantised to 16 bits an axis, with their box, centre and radius in metres."""
    import numpy as np

    count = min(len(cloud), MAX_POINTS)
    chosen = np.random.default_rng(_SEED).choice(
        len(cloud), count, replace=False
    )  # a stride would make lines
    points_m, colors = cloud.points_rig_m[chosen], cloud.colors[chosen]
    low_m = points_m.min(axis=0)
    size_m = np.maximum(points_m.max(axis=0) - low_m, 1e-6)
    centre_m = np.median(points_m, axis=0)
    radius_m = float(np.quantile(np.linalg.norm(points_m - centre_m, axis=1), 0.95))
    packed = np.empty(count, dtype=[("place", "<u2", 3), ("color", "u1", 3)])
    packed["place"] = np.rint((points_m - low_m) / size_m * _STEPS)
    packed["color"] = colors
    return {
        "count": count,
        "low_m": low_m.round(6).tolist(),
        "size_m": size_m.round(6).tolist(),
        "centre_m": centre_m.round(6).tolist(),
        "radius_m": max(round(radius_m, 6), 1e-6),
        "data": base64.b64encode(packed.tobytes()).decode("ascii"),
    }


@cache
def _template() -> str:
    return files("foveacam_client").joinpath("cloud_view.html").read_text(encoding="utf-8")
