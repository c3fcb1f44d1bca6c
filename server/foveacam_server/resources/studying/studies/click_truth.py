"""The simulation's truth of a click: material, surface point, and residual of a fixation."""

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import DeviceFault, Role, Sighting
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.optics import FOVEA_FOCAL_PX
from foveacam_hardware.sim.render.materials import CellSurface, PlainSurface
from foveacam_hardware.sim.render.projection import Projection
from foveacam_hardware.sim.render.renderer import Radiance
from foveacam_hardware.sim.scenes.motion import pose
from foveacam_hardware.sim.truth import Truth
from foveacam_pipeline.models import Calibration
from foveacam_pipeline.verge.aim import aim_at, reaches

EYES = (Role.LEFT, Role.RIGHT)
CLEAR_WIDE_PX = 4
"""Half side of the neighbourhood of a click that must show one surface, wide px."""
PROBE_PX = 9
WIDE_FOCAL_PX = 3155.0
DEPTH_SPREAD = 0.06
"""Largest range of distances of one surface in the neighbourhood, as a share of its distance."""
HIDDEN_SHARE = 3e-3
"""Largest distance of a ray's end from the point, as a share of the distance; the probe's pixels need it."""


class ClickKind(StrEnum):
    """Kind of a clicked surface."""

    TEXTURED = "textured"
    """Textured material, visible to both eyes at the moment of the click, in the calibrated field of both
    mirrors, no edge within 4 wide px."""
    PLAIN = "plain"
    """A material without texture."""
    AWKWARD = "awkward"
    """Any other: occluded in an eye, beside an edge, out of reach, or uniform cells of a printed pattern."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Click:
    """One wide pixel and its surface point at the moment of the click, rig frame."""

    scene: str
    x_px: float
    y_px: float
    t_ns: int
    kind: ClickKind
    name: str
    range_m: float
    point_rig_m: tuple[float, float, float]


def truth_of(rig: Rig) -> Truth:
    """Return the truth of a simulated rig; raise `DeviceFault` for a rig without one."""
    if rig.truth is None:
        raise DeviceFault(f"rig {rig.rig_id} has no truth; open a simulated rig with open_simulated")
    return rig.truth


def classify_click(
    truth: Truth, calibration: Calibration, *, scene: str, pixel: tuple[float, float], t_ns: int
) -> Click | None:
    """Return the click at a wide pixel with its kind and true point; None for the background."""
    seen = truth.depth_at(*pixel, t_ns)
    if seen is None:
        return None
    number = truth.world.animated_scene.scene.names.index(seen.name)
    material = truth.world.animated_scene.scene.material(number)
    if isinstance(material, PlainSurface):
        kind = ClickKind.PLAIN
    else:
        kind = ClickKind.AWKWARD if isinstance(material, CellSurface) else ClickKind.TEXTURED
    click = Click(
        scene=scene,
        x_px=pixel[0],
        y_px=pixel[1],
        t_ns=t_ns,
        kind=kind,
        name=seen.name,
        range_m=seen.range_m,
        point_rig_m=seen.point_rig_m,
    )
    if kind is ClickKind.TEXTURED and not _clear(
        truth, calibration, np.array(seen.point_rig_m), number, t_ns
    ):
        return replace(click, kind=ClickKind.AWKWARD)
    return click


def clicked_point_at(truth: Truth, click: Click, t_ns: int) -> NDArray[np.float64]:
    """Return the position of the clicked surface point at `t_ns`, (3,) m, rig frame; objects move."""
    point = np.array([*click.point_rig_m, 1.0])
    stage = truth.world.animated_scene
    placed = stage.file.objects[stage.scene.names.index(click.name)]
    if placed.motion is None:
        return point[:3]
    before = pose(placed, truth.world.scene_s(click.t_ns))
    now = pose(placed, truth.world.scene_s(t_ns))
    return np.asarray((now @ np.linalg.inv(before) @ point)[:3], dtype=np.float64)


def residual_px(truth: Truth, sighting: Sighting, point_rig_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (2,) the true residual of the eyes on a point: left minus right position, fovea px.

    Each position is on the virtual pinhole plane, so that image roll has no effect.
    """
    left, right = beside_centres(truth, sighting, point_rig_m)
    return np.asarray((left - right) * FOVEA_FOCAL_PX, dtype=np.float64)


def beside_centres(truth: Truth, sighting: Sighting, point_rig_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (2, 2) tangents, a row an eye: a point's direction from the pupil minus the image centre's."""
    positions = []
    for role, frame in zip(EYES, (sighting.left, sighting.right), strict=True):
        view = truth.projection(role, frame.t_ns)
        ray = np.linalg.solve(view.M, np.array([(view.width - 1) / 2, (view.height - 1) / 2, 1.0]))
        way = point_rig_m - view.C
        positions.append(way[:2] / way[2] - ray[:2] / ray[2])
    return np.array(positions)


def visible_from(truth: Truth, role: Role, click: Click, *, t_ns: int | None = None) -> bool:
    """Return whether an eye has a line of sight to the clicked point, at the moment of the click or later."""
    number = truth.world.animated_scene.scene.names.index(click.name)
    moment_ns = click.t_ns if t_ns is None else t_ns
    point = clicked_point_at(truth, click, moment_ns)
    return _free_ray(truth, truth.pivot(role), point, number, moment_ns)


def _clear(
    truth: Truth,
    calibration: Calibration,
    point_rig_m: NDArray[np.float64],
    number: int,
    t_ns: int,
) -> bool:
    """Return whether both eyes reach the point and all three views show one surface about it."""
    z_m = float(point_rig_m[2])
    gazes = aim_at(calibration, point_rig_m[:2] / z_m, 1.0 / z_m)
    if not reaches(calibration, gazes):
        return False
    x_px, y_px = truth.wide_pixels(point_rig_m[None])[0].tolist()
    around = truth.surroundings(x_px, y_px, t_ns, half_px=CLEAR_WIDE_PX)
    range_m = float(np.linalg.norm(point_rig_m))
    if len(around.names) != 1 or around.farthest_m - around.nearest_m > DEPTH_SPREAD * range_m:
        return False
    return all(_seen_from(truth, truth.pivot(role), point_rig_m, number, t_ns) for role in EYES)


def _seen_from(
    truth: Truth, eye_rig_m: NDArray[np.float64], point_rig_m: NDArray[np.float64], number: int, t_ns: int
) -> bool:
    """Return whether an eye sees the point and only its object about it."""
    drawn, _ = _probe_towards(truth, eye_rig_m, point_rig_m, t_ns)
    return bool((drawn.ids == number).all()) and _free_ray(truth, eye_rig_m, point_rig_m, number, t_ns)


def _free_ray(
    truth: Truth, eye_rig_m: NDArray[np.float64], point_rig_m: NDArray[np.float64], number: int, t_ns: int
) -> bool:
    """Return whether the ray from an eye to the point ends on it."""
    drawn, probe = _probe_towards(truth, eye_rig_m, point_rig_m, t_ns)
    middle = PROBE_PX // 2
    if drawn.ids[middle, middle] != number:
        return False
    hit = probe.points(np.array([[middle, middle]]), np.array([float(drawn.depth_m[middle, middle])]))[0]
    distance_m = float(np.linalg.norm(point_rig_m - eye_rig_m))
    return float(np.linalg.norm(hit - point_rig_m)) < HIDDEN_SHARE * distance_m


def _probe_towards(
    truth: Truth, eye_rig_m: NDArray[np.float64], point_rig_m: NDArray[np.float64], t_ns: int
) -> tuple[Radiance, Projection]:
    """Render a few pixels about the ray from an eye to a point, at the wide camera's resolution."""
    way = point_rig_m - eye_rig_m
    ray = way / float(np.linalg.norm(way))
    side = -np.cross(ray, np.array([0.0, 1.0, 0.0]))
    side /= np.linalg.norm(side)
    middle = PROBE_PX // 2
    focal_px = WIDE_FOCAL_PX * middle / CLEAR_WIDE_PX
    k = np.array([[focal_px, 0.0, middle], [0.0, focal_px, middle], [0.0, 0.0, 1.0]])
    probe = Projection(
        M=k @ np.stack([side, np.cross(ray, side), ray]),
        C=eye_rig_m,
        width=PROBE_PX,
        height=PROBE_PX,
        axis=ray,
    )
    return truth.world.animated_scene.probe(probe, truth.world.scene_s(t_ns)), probe
