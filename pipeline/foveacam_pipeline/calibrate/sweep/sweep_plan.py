"""The gazes of a sweep and their order, and the poses of the base for them."""

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, PanTiltLimits, PanTiltPose

MIN_NODES = 3
MAX_NODES = 41
LARGEST_RAD = math.radians(30.0)


class NodeSpacing(StrEnum):
    """Spacing of the nodes along one axis."""

    EVEN = "even"
    RIM = "rim"
    """Denser towards the rim, where a polynomial has samples on one side alone (Chebyshev-Lobatto nodes)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepPlan:
    """A grid of gazes, 9 x 9 as in Sec. 3.2, in serpentine order.

    `half_width_rad`, `half_height_rad`: the outermost ax and ay.
    """

    columns: int = 9
    rows: int = 9
    half_width_rad: float = math.radians(9.3)
    half_height_rad: float = math.radians(8.2)
    spacing: NodeSpacing = NodeSpacing.RIM

    def __post_init__(self) -> None:
        if not (MIN_NODES <= self.columns <= MAX_NODES and MIN_NODES <= self.rows <= MAX_NODES):
            raise InvalidInput(
                f"sweep of {self.columns} x {self.rows} poses: choose {MIN_NODES} to {MAX_NODES} along each "
                "axis"
            )
        if not all(0.0 < half <= LARGEST_RAD for half in (self.half_width_rad, self.half_height_rad)):
            asked = f"±{math.degrees(self.half_width_rad):g}° x ±{math.degrees(self.half_height_rad):g}°"
            raise InvalidInput(
                f"sweep of {asked}: choose above 0° and up to {math.degrees(LARGEST_RAD):g}° for each axis"
            )

    def __str__(self) -> str:
        """The grid in words: columns x rows over its field."""
        half_deg = (math.degrees(self.half_width_rad), math.degrees(self.half_height_rad))
        field = f"±{half_deg[0]:.3g}° x ±{half_deg[1]:.3g}°"
        return f"{self.columns} x {self.rows} over {field}, spacing {self.spacing.value}"

    def nodes_rad(self) -> NDArray[np.float64]:
        """Return the gazes (ax, ay) in the order for a motorised base, (n, 2) float64, rad."""
        across = _axis(self.columns, self.half_width_rad, self.spacing)
        down = _axis(self.rows, self.half_height_rad, self.spacing)
        rows = [[(x, y) for x in (across if i % 2 == 0 else across[::-1])] for i, y in enumerate(down)]
        return np.array([node for row in rows for node in row])

    def outward_order(self) -> list[int]:
        """Return the numbers of the gazes ring by ring from the middle, so that each predicts the next."""
        x, y = np.meshgrid(
            np.arange(self.columns) - (self.columns - 1) / 2.0, np.arange(self.rows) - (self.rows - 1) / 2.0
        )
        x[1::2] = x[1::2, ::-1]
        ring, around = np.maximum(np.abs(x), np.abs(y)).ravel(), np.arctan2(y, x).ravel()
        return [int(k) for k in np.lexsort((around, ring))]


def _axis(count: int, half_rad: float, spacing: NodeSpacing) -> NDArray[np.float64]:
    if spacing is NodeSpacing.EVEN:
        return np.linspace(-half_rad, half_rad, count)
    nodes: NDArray[np.float64] = -half_rad * np.cos(np.linspace(0.0, np.pi, count))
    return nodes


def base_pose(node_rad: NDArray[np.float64], station: PanTiltPose) -> PanTiltPose:
    """Return the pose of the base at which a station's target appears at the gaze (ax, ay), (2,) rad.

    The base pans about a fixed vertical axis and then tilts about its own horizontal one; the target is
    straight ahead at the station's pose. Pan and tilt follow from the ray of the target.
    """
    ray = np.array([math.tan(float(node_rad[0])), math.tan(float(node_rad[1])), 1.0])
    x, y, z = (ray / np.linalg.norm(ray)).tolist()
    # Ahead at the station: (cos t sin p, sin t, cos t cos p) in the base's vertical frame.
    height = math.sin(station.tilt_rad)
    tilt_rad = _tilt_for(y, z, height)
    forward = z * math.cos(tilt_rad) - y * math.sin(tilt_rad)
    return PanTiltPose(pan_rad=station.pan_rad - math.atan2(x, forward), tilt_rad=tilt_rad)


def _tilt_for(y: float, z: float, height: float) -> float:
    """Return the tilt t for which a ray (., y, z) of the tilted frame has the vertical component `height`.

    Tilting down by t: vertical y = y cos t + z sin t.
    """
    length = math.hypot(y, z)
    if abs(height) > length:
        raise InvalidInput(
            "sweep: no tilt brings the target to such a gaze; move the target to the height of the rig"
        )
    return math.asin(height / length) - math.atan2(y, z)


def check_reach(plan: SweepPlan, station: PanTiltPose, limits: PanTiltLimits) -> None:
    """Raise InvalidInput naming the first pose that the pan-tilt cannot reach."""
    for ax_rad, ay_rad in plan.nodes_rad():
        pose = base_pose(np.array([ax_rad, ay_rad]), station)
        pan_fits = limits.pan_min_rad <= pose.pan_rad <= limits.pan_max_rad
        tilt_fits = limits.tilt_min_rad <= pose.tilt_rad <= limits.tilt_max_rad
        if not (pan_fits and tilt_fits):
            asked = f"({math.degrees(ax_rad):.2f}°, {math.degrees(ay_rad):.2f}°)"
            needed = f"pan {math.degrees(pose.pan_rad):.2f}°, tilt {math.degrees(pose.tilt_rad):.2f}°"
            raise InvalidInput(
                f"sweep: the gaze {asked} needs the base at {needed}, which the pan-tilt cannot reach; "
                "choose a smaller sweep or another station"
            )
