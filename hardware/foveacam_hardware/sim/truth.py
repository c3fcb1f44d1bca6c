"""The simulated world's truth, which a real rig cannot offer; read by tests and benches alone."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import MirrorVolts, Role
from foveacam_hardware.sim.far_ends.board_loopback import BoardLoopback
from foveacam_hardware.sim.far_ends.board_process import BoardProcess
from foveacam_hardware.sim.far_ends.controller_far_end import ControllerFarEnd
from foveacam_hardware.sim.far_ends.controller_process import ControllerProcess
from foveacam_hardware.sim.far_ends.grbl_far_end import GrblFarEnd
from foveacam_hardware.sim.optics import FOVEA_FOCAL_PX, EyeProjection
from foveacam_hardware.sim.render.projection import Projection
from foveacam_hardware.sim.render.renderer import Radiance
from foveacam_hardware.sim.world import World

PROBE_PX = 9
CONTRAST_PX = 65
PROBE_FOCAL_PX = 1e5  # 0.01 mm per pixel at a metre: the probe's middle pixel is a point


@dataclass(frozen=True, slots=True, kw_only=True)
class TrueSurfacePoint:
    """The surface at a wide pixel; `range_m`: distance from the wide camera's centre along the ray."""

    range_m: float
    point_rig_m: tuple[float, float, float]
    name: str
    textured: bool
    """False for a material without texture."""
    contrast: float
    """Standard deviation of the noiseless radiance over its mean, within 65 fovea px about the point."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrueSurroundings:
    """The surfaces around a wide pixel: nearest and farthest range, names."""

    nearest_m: float
    farthest_m: float
    names: tuple[str, ...]


class Truth:
    """Read access to the world's truth, and the far ends, whose faults can be set."""

    def __init__(
        self,
        world: World,
        controller: ControllerFarEnd | ControllerProcess,
        pan_tilt: BoardLoopback[GrblFarEnd] | BoardProcess,
    ) -> None:
        self.world = world
        self.pan_tilt = pan_tilt
        """The far end of the pan-tilt and rail; faults are methods."""
        self.controller = controller
        """The controller's far end; faults are attributes (in this process) or methods (in its own)."""

    def static_projection(self, role: Role, volts: MirrorVolts, *, t_ns: int | None = None) -> EyeProjection:
        """Return a fovea's projection, its mirror at rest under `volts`, with the drift at `t_ns` or none.

        It follows the mirror's static law; a disturbance of the mirrors is in `projection` alone.
        """
        return self.world.static_view(role, volts, t_ns=t_ns)

    def projection(self, role: Role, t_ns: int) -> Projection:
        """Return a camera's projection at a time, for the renderer."""
        return self.world.projection(role, t_ns)

    def pivot(self, role: Role) -> NDArray[np.float64]:
        """Return the centre of a mirror, (3,) metres, rig frame."""
        return self.world.eyes[role].pivot_m.copy()

    def rig_from_world(self, t_ns: int) -> NDArray[np.float64]:
        """Return rig_from_world (4, 4) at a time: the identity with every axis at zero."""
        return self.world.rig_from_world(t_ns)

    def wide_rays(self, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the unit rays (n, 3) of raw wide pixels (n, 2), rig frame."""
        straight = self.world.lens.undistorted_px(np.asarray(pixels, dtype=np.float64))
        rays = np.column_stack([straight, np.ones(len(straight))]) @ np.linalg.inv(self.world.lens.matrix()).T
        return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True), dtype=np.float64)

    def wide_pixels(self, points_rig_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the raw wide pixels (n, 2) of points (n, 3) of the rig frame."""
        straight = self.world.projection(Role.WIDE, 0).project(points_rig_m)
        return self.world.lens.distorted_px(straight)

    def depth_at(self, x_px: float, y_px: float, t_ns: int) -> TrueSurfacePoint | None:
        """Return the surface at a raw wide pixel (subpixel) at a time; None for the background."""
        ray = self.wide_rays(np.array([[x_px, y_px]]))[0]
        rendered, probe = self._probe(ray, t_ns, focal_px=PROBE_FOCAL_PX, side_px=PROBE_PX)
        middle = PROBE_PX // 2
        number = int(rendered.ids[middle, middle])
        if number < 0:
            return None
        depth_m = float(rendered.depth_m[middle, middle])
        point = probe.points(np.array([[middle, middle]]), np.array([depth_m]))[0]
        x_m, y_m, z_m = point.tolist()
        return TrueSurfacePoint(
            range_m=float(np.linalg.norm(point)),
            point_rig_m=(x_m, y_m, z_m),
            name=self.world.animated_scene.scene.names[number],
            textured=self.world.animated_scene.textured(number),
            contrast=self._contrast(ray, t_ns),
        )

    def surroundings(self, x_px: float, y_px: float, t_ns: int, *, half_px: int) -> TrueSurroundings:
        """Return the surfaces within `half_px` of a wide pixel at a time; the background is at infinity."""
        wide = self.world.projection(Role.WIDE, t_ns)
        x0, y0 = max(0, round(x_px) - half_px), max(0, round(y_px) - half_px)
        x1, y1 = min(wide.width, round(x_px) + half_px + 1), min(wide.height, round(y_px) + half_px + 1)
        rendered = self.world.animated_scene.probe(
            wide, self.world.scene_s(t_ns), roi=(x0, y0, x1 - x0, y1 - y0)
        )
        hit = rendered.ids >= 0
        y, x = np.nonzero(hit)
        ranges_m = wide.range_m(np.column_stack([x + x0, y + y0]), rendered.depth_m[hit])
        names = self.world.animated_scene.scene.names
        return TrueSurroundings(
            nearest_m=float(ranges_m.min()) if len(ranges_m) else np.inf,
            farthest_m=float(ranges_m.max()) if hit.all() else np.inf,
            names=tuple(names[int(k)] for k in np.unique(rendered.ids) if k >= 0),
        )

    def _contrast(self, ray: NDArray[np.float64], t_ns: int) -> float:
        rendered, _ = self._probe(ray, t_ns, focal_px=FOVEA_FOCAL_PX, side_px=CONTRAST_PX)
        return float(rendered.radiance.std() / max(float(rendered.radiance.mean()), 1e-6))

    def _probe(
        self, ray: NDArray[np.float64], t_ns: int, *, focal_px: float, side_px: int
    ) -> tuple[Radiance, Projection]:
        """Render a few pixels around one ray from the wide camera's centre."""
        side = np.cross(ray, np.array([0.0, 1.0, 0.0]))
        side = -side / np.linalg.norm(side)
        camera_from_rig = np.stack([side, np.cross(ray, side), ray])
        middle = side_px // 2
        k = np.array([[focal_px, 0.0, middle], [0.0, focal_px, middle], [0.0, 0.0, 1.0]])
        probe = Projection(M=k @ camera_from_rig, C=np.zeros(3), width=side_px, height=side_px, axis=ray)
        return self.world.animated_scene.probe(probe, self.world.scene_s(t_ns)), probe
