"""Where viewers of the 3D scene stand: before what was found last, over all of it, or at the rig.

A viewer is led to each new shape with a short motion. Once somebody has moved a viewer's camera, it stays
there until a view is asked for.
"""

import asyncio
import logging
import time
from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import dataclass

import numpy as np
import viser
from numpy.typing import NDArray

from foveacam_web.scene_values import UP, Point, RigShape

_log = logging.getLogger(__name__)

START_FOV_RAD = 0.9
_ON_THE_WAY = 0.1
"""Where a viewer stands on the way from the rig to what was found: near the rig the backdrop looks as the
wide view does; farther on, what was interpolated between near and far is stretched."""
_ASIDE = (0.025, -0.02)
"""Offset to the right and up (y down), in units of the distance: seen straight on, a surface looks flat."""
_SHAPE_FILLS = 0.42
"""Share of the view's height that a shape fills."""
_LEAST_FOV_RAD, _MOST_FOV_RAD = 0.02, 0.26
_FOVEA_HEIGHT = 0.0375
"""Height of a fovea's view, in units of the distance (2.15 deg): that of a target without a shape."""
_EDGE_QUANTILE = 0.03
_ABOVE = (0.14, -0.1, 0.0)
"""Where a viewer stands to see everything, in units of the least distance."""
_FILLED = 0.8
"""Share of the view that everything may fill."""
FOV_OVER_ALL_RAD = (0.35, START_FOV_RAD)
"""Least and most field of that view; the least is that of the wide camera, whose picture lies behind."""
_RIG_MARGIN = 1.12
"""Field of the view from the rig, in units of the wide camera's."""
STEPS, STEP_S = 5, 0.08
"""Poses of one motion, and the time between two; a browser that draws in software shows some of them."""
_MOVED = 0.02
"""Share of the distance looked at by which a camera must differ from its given pose to count as moved."""
PLACED_S = 0.5
"""Time after a viewer's first message by which its page has placed its camera, if it does so at all."""
_AT_ORIGIN_M = 1e-3
"""A camera that looks at a point nearer to the origin than this has not been placed."""
_SETTLING_S = 1.5
"""Time after a viewer's first message in which its page still places its camera."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pose:
    """A viewer's camera: where it stands, what it looks at, (3,) each, m, rig frame; its vertical field."""

    position_m: NDArray[np.float64]
    look_at_m: NDArray[np.float64]
    fov_rad: float = START_FOV_RAD

    def near(self, other: "Pose") -> bool:
        """Return whether two poses differ by less than `_MOVED` of the distance looked at."""
        reach_m = float(np.linalg.norm(self.look_at_m - self.position_m))
        apart_m = max(
            float(np.linalg.norm(self.position_m - other.position_m)),
            float(np.linalg.norm(self.look_at_m - other.look_at_m)),
        )
        return apart_m <= _MOVED * reach_m

    def towards(self, other: "Pose", share: float) -> "Pose":
        """Return the pose after a share of the way to another."""
        return Pose(
            position_m=self.position_m + share * (other.position_m - self.position_m),
            look_at_m=self.look_at_m + share * (other.look_at_m - self.look_at_m),
            fov_rad=self.fov_rad + share * (other.fov_rad - self.fov_rad),
        )


def pose_before(point_rig_m: Point, shape_rig_m: NDArray[np.float32] | None = None) -> Pose:
    """Return the pose that frames a shape, (n, 3) m, rig frame, or the surroundings of a point without one.

    Slightly above and to the right of the line of sight.
    """
    point_m = np.asarray(point_rig_m, dtype=np.float64)
    distance_m = max(float(np.linalg.norm(point_m)), 1e-3)
    middle_m, height_m = point_m, _FOVEA_HEIGHT * distance_m
    if shape_rig_m is not None and len(shape_rig_m) > 0:
        low_m, high_m = np.quantile(shape_rig_m, (_EDGE_QUANTILE, 1.0 - _EDGE_QUANTILE), axis=0)
        middle_m, height_m = (low_m + high_m) / 2.0, float(high_m[1] - low_m[1])
    position_m = _ON_THE_WAY * middle_m + distance_m * np.array([*_ASIDE, 0.0])
    away_m = float(np.linalg.norm(middle_m - position_m))
    fov_rad = 2.0 * np.arctan(height_m / 2.0 / away_m / _SHAPE_FILLS)
    return Pose(
        position_m=position_m,
        look_at_m=middle_m,
        fov_rad=float(np.clip(fov_rad, _LEAST_FOV_RAD, _MOST_FOV_RAD)),
    )


def pose_over(points_rig_m: Sequence[Point], *, aspect: float = 1.5) -> Pose:
    """Return a pose beside and above the rig from which all points are seen, with no more field than needed.

    `points_rig_m`: at least one, m, rig frame. `aspect`: width over height of the view.
    """
    points_m = np.asarray(points_rig_m, dtype=np.float64)
    middle_m = (points_m.min(axis=0) + points_m.max(axis=0)) / 2.0
    position_m = float(np.linalg.norm(points_m, axis=1).min()) * np.asarray(_ABOVE)
    ahead = (middle_m - position_m) / max(float(np.linalg.norm(middle_m - position_m)), 1e-9)
    right = np.cross(-np.asarray(UP), ahead)
    right /= max(float(np.linalg.norm(right)), 1e-9)
    seen_m = points_m - position_m
    across, down = np.abs(seen_m @ right) / aspect, np.abs(seen_m @ np.cross(ahead, right))
    half = float(np.max(np.maximum(across, down) / np.maximum(seen_m @ ahead, 1e-3)))
    fov_rad = 2.0 * float(np.arctan(half / _FILLED))
    return Pose(position_m=position_m, look_at_m=middle_m, fov_rad=float(np.clip(fov_rad, *FOV_OVER_ALL_RAD)))


def pose_at_rig(shape: RigShape | None) -> Pose:
    """Return the pose of the wide camera, with its field."""
    fov_rad = START_FOV_RAD if shape is None else _RIG_MARGIN * shape.wide_fov_rad[1]
    return Pose(position_m=np.zeros(3), look_at_m=np.array([0.0, 0.0, 3.0]), fov_rad=fov_rad)


class Viewpoints:
    """Moves viewers' cameras, and remembers where each was put; all but `lead_all` runs on viser's loop."""

    def __init__(self) -> None:
        self._server: viser.ViserServer | None = None
        self._given: dict[int, list[Pose]] = {}
        self._joined_s: dict[int, float] = {}
        self._motions: dict[int, int] = {}

    def open(self, server: viser.ViserServer) -> None:
        """Watch the viewers of a server."""
        self._server = server

        @server.on_client_connect
        async def _joined(viewer: viser.ClientHandle) -> None:
            self.join(viewer)
            await self.place_if_missed(viewer)

        @server.on_client_disconnect
        async def _left(viewer: viser.ClientHandle) -> None:
            self.leave(viewer)

    def lead_all(self, pose: Pose, *, asked: bool = False) -> None:
        """Move viewers to a pose: those whose camera nobody has moved, or all of them if `asked`.

        From any thread, without waiting for the motion.
        """
        if self._server is None:
            return
        move = self.place if asked else self.lead
        for viewer in self._server.get_clients().values():
            moving = asyncio.run_coroutine_threadsafe(move(viewer, pose), self._server.get_event_loop())
            moving.add_done_callback(_report)

    def join(self, viewer: viser.ClientHandle) -> None:
        """Remember where a new viewer begins, and where its page places it, if need be much later."""
        self._joined_s[viewer.client_id] = time.monotonic()
        self._given[viewer.client_id] = [pose_of(viewer)]
        if self._server is not None:
            self._given[viewer.client_id].append(_pose_of(self._server.initial_camera))

        async def updated(_event: object) -> None:
            if time.monotonic() - self._joined_s.get(viewer.client_id, 0.0) < _SETTLING_S:
                self._given.setdefault(viewer.client_id, []).append(pose_of(viewer))

        viewer.camera.on_update(updated)

    async def place_if_missed(self, viewer: viser.ClientHandle) -> None:
        """Place a viewer's camera where its page did not: one that is busy with many shapes misses it.

        It then looks at the origin, as viser's page does before it is placed.
        """
        if self._server is None:
            return
        await asyncio.sleep(PLACED_S)
        missed = float(np.linalg.norm(viewer.camera.look_at)) < _AT_ORIGIN_M
        if missed and viewer.client_id in self._joined_s:
            set_pose(viewer, _pose_of(self._server.initial_camera))

    def leave(self, viewer: viser.ClientHandle) -> None:
        """Forget a viewer that has gone."""
        for each in (self._given, self._joined_s, self._motions):
            each.pop(viewer.client_id, None)

    def has_moved(self, viewer: viser.ClientHandle) -> bool:
        """Return whether the person has moved the camera from where it was put."""
        now = pose_of(viewer)
        return not any(given.near(now) for given in self._given.get(viewer.client_id, ()))

    async def lead(self, viewer: viser.ClientHandle, pose: Pose) -> None:
        """Move a viewer to a pose, unless somebody has moved its camera."""
        if not self.has_moved(viewer):
            await self.place(viewer, pose)

    async def place(self, viewer: viser.ClientHandle, pose: Pose) -> None:
        """Move a viewer to a pose in a short motion, which a later one replaces."""
        name = viewer.client_id
        number = self._motions[name] = self._motions.get(name, 0) + 1
        begun = pose_of(viewer)
        way = [begun.towards(pose, _eased(step / STEPS)) for step in range(1, STEPS + 1)]
        self._given[name] = [begun, *way]  # the page reports each of them, some of them late
        for each in way:
            if self._motions.get(name) != number:
                return
            set_pose(viewer, each)
            await asyncio.sleep(STEP_S)
        self._given[name] = way


def _report(done: "Future[None]") -> None:
    if not done.cancelled() and done.exception() is not None:
        _log.error("a viewer of the 3D scene was not moved", exc_info=done.exception())


def _eased(share: float) -> float:
    """Return the share of the way after a share of the time: slow at both ends."""
    return share * share * (3.0 - 2.0 * share)


def pose_of(viewer: viser.ClientHandle) -> Pose:
    """Return where a viewer's camera is, as its page reported last."""
    return _pose_of(viewer.camera)


def _pose_of(camera: viser.CameraHandle | viser.InitialCameraConfig) -> Pose:
    return Pose(
        position_m=np.array(camera.position), look_at_m=np.array(camera.look_at), fov_rad=float(camera.fov)
    )


def set_pose(viewer: viser.ClientHandle, pose: Pose) -> None:
    """Put a viewer's camera somewhere at once."""
    with viewer.atomic():
        viewer.camera.up_direction = UP
        viewer.camera.position = pose.position_m
        viewer.camera.look_at = pose.look_at_m
        viewer.camera.fov = pose.fov_rad
