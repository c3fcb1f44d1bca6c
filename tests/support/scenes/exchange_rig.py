"""A rig of plain geometry before three markers: what a sweep of it measures, without noise."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import PanTiltPose, Role, Station, StationTarget
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout, MarkerView
from foveacam_pipeline.calibrate.sweep.sweep import EyePose, Sweep, SweepHeader, SweepPose
from foveacam_pipeline.calibrate.sweep.sweep_plan import NodeSpacing, SweepPlan, base_pose
from foveacam_pipeline.geometry.angles import angles_from_rays, ray
from foveacam_pipeline.geometry.verging import eye_angles
from foveacam_pipeline.models import Intrinsics

F_PX = 28_760.0
SIZE = (1440, 1080)
CENTRE = np.array([719.5, 539.5])
WIDE = Intrinsics(
    width=1440,
    height=1080,
    fx_px=3155.0,
    fy_px=3156.0,
    cx_px=722.0,
    cy_px=541.0,
    distortion=(-0.1, 0.05, 1e-4, -2e-4, 0.0),
)
LAYOUT = MarkerLayout()
PLAN = SweepPlan(half_width_rad=math.radians(9), half_height_rad=math.radians(8), spacing=NodeSpacing.EVEN)
GAIN = np.deg2rad([0.058, 0.051])
CORNERS = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5], [-1 / 6, 1 / 6], [1 / 3, 0.0]])
"""In sides of the marker: the outer four, and two cell corners."""
AHEAD = PanTiltPose(pan_rad=0.0, tilt_rad=0.0)


@dataclass(frozen=True, kw_only=True)
class Bench:
    """Where the markers stand, and of which rig it is."""

    distance_m: float = 5.0
    rig_id: str = "lab-1"
    name: str = "markers"
    plan: SweepPlan = PLAN

    def sweep(self) -> Sweep:
        header = SweepHeader(
            rig_id=self.rig_id,
            created_utc="2026-02-01T10:00:00+00:00",
            station=Station(
                name=self.name, target=StationTarget.MARKERS, pose=AHEAD, distance_m=self.distance_m
            ),
            layout=LAYOUT,
            plan=self.plan,
            wide_size=SIZE,
            fovea_size=SIZE,
            max_v=170.0,
        )
        return Sweep(header=header, poses=tuple(self.pose(k) for k in range(len(self.plan.nodes_rad()))))

    def pose(self, index: int) -> SweepPose:
        node = self.plan.nodes_rad()[index]
        base = base_pose(node, AHEAD)
        turn = rig_from_world(base.pan_rad, base.tilt_rad)
        middle = self.distance_m * ray(float(node[0]), float(node[1]))
        wide = {LAYOUT.id_of(role): self._wide_view(role, middle, turn) for role in Role}
        return SweepPose(
            index=index,
            node_rad=(float(node[0]), float(node[1])),
            pan_tilt=base,
            t_ns=index,
            wide=wide,
            left=_eye(Role.LEFT, middle, turn),
            right=_eye(Role.RIGHT, middle, turn),
        )

    def _wide_view(self, role: Role, middle: NDArray[np.float64], turn: NDArray[np.float64]) -> MarkerView:
        points = marker_m(role, middle, turn)
        return _view(LAYOUT.id_of(role), WIDE.pixels(angles_from_rays(points)))


def rig_from_world(pan_rad: float, tilt_rad: float) -> NDArray[np.float64]:
    """Return the turn that brings the world's axes into the rig's, by the meaning of pan and tilt."""
    right = np.array([math.cos(pan_rad), 0.0, -math.sin(pan_rad)])  # the tilt axis stays level
    ahead = np.array(
        [
            math.cos(tilt_rad) * math.sin(pan_rad),
            math.sin(tilt_rad),
            math.cos(tilt_rad) * math.cos(pan_rad),
        ]
    )
    return np.array([right, np.cross(ahead, right), ahead])


def marker_m(role: Role, middle: NDArray[np.float64], turn: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the corners of a camera's marker, (n, 3) m, rig frame."""
    on_target = LAYOUT.side_m * CORNERS + LAYOUT.middle_m(role)
    return middle + np.column_stack([on_target, np.zeros(len(on_target))]) @ turn.T


def pivot_m(role: Role) -> NDArray[np.float64]:
    return np.array([{Role.LEFT: -0.1, Role.RIGHT: 0.1}[role], 0.0, 0.0])


def gaze_rad(volts_v: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return where both eyes look under volts (n, 2): straight lines, so that nothing is lost in a fit."""
    return volts_v * GAIN


def _eye(role: Role, middle: NDArray[np.float64], turn: NDArray[np.float64]) -> EyePose:
    corners = marker_m(role, middle, turn)
    own = middle + turn @ np.array([*LAYOUT.middle_m(role), 0.0])
    gaze = np.array(eye_angles(own, pivot_m(role)))
    seen = corners - pivot_m(role)
    plane = F_PX * (seen[:, :2] / seen[:, 2:] - np.tan(gaze))
    roll = 0.7 * gaze[0]
    raw = CENTRE + plane @ np.array([[math.cos(roll), math.sin(roll)], [-math.sin(roll), math.cos(roll)]])
    volts = gaze / GAIN
    return EyePose(
        volts_v=(float(volts[0]), float(volts[1])),
        corners=_view(LAYOUT.id_of(role), raw),
        centred=True,
        rim=False,
        looks=3,
    )


def _view(marker_id: int, px: NDArray[np.float64]) -> MarkerView:
    return MarkerView(
        id=marker_id, corners_px=px, places_m=LAYOUT.side_m * CORNERS, sharpness=1.0, complete=True
    )
