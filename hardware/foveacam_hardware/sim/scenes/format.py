"""The scene file format, version 1, described in `hardware/README.md`.

Axes are the rig's: +x right, +y down, +z forward, metres; the wide camera is the origin. Materials are in
`materials`, reading files in `loader`, conversion for the renderer in `build`.
"""

from typing import Annotated, Literal, TypeAlias

from pydantic import Field, Strict, model_validator

from foveacam_hardware.pan_tilt_config import StationTable, check_station_names
from foveacam_hardware.sim.scenes.materials import Color, Material, Metres, Position, Real, StrictTable, Unit


class PathMotion(StrictTable):
    """Walk along a line of points at a constant speed, there and back or in circles."""

    kind: Literal["path"]
    points_m: Annotated[list[Position], Field(min_length=2)]
    speed_m_per_s: Annotated[float, Strict(), Field(gt=0.0, le=60.0)]
    closed: bool = False
    """In circles; else there and back."""
    start_s: Real = 0.0
    """Time already walked at scene time 0."""


class SwayMotion(StrictTable):
    """Swing about the position, along a vector."""

    kind: Literal["sway"]
    amplitude_m: Position
    period_s: Annotated[float, Strict(), Field(gt=0.0)]
    start_s: Real = 0.0


class SpinMotion(StrictTable):
    """Turn about the vertical axis."""

    kind: Literal["spin"]
    period_s: Annotated[float, Strict(), Field(gt=0.0)]
    start_s: Real = 0.0


class ShownPose(StrictTable):
    """A pose in which the object is held, relative to its own position and rotation."""

    at_m: Position
    turn_deg: Position = (0.0, 0.0, 0.0)
    """About x, then y, then z."""


class ShowMotion(StrictTable):
    """Hold the object in a cycle of poses, as one shows a board to a camera.

    The poses are relative to the object's position and rotation, which should be those of the camera.
    """

    kind: Literal["show"]
    poses: Annotated[list[ShownPose], Field(min_length=1)]
    hold_s: Annotated[float, Strict(), Field(gt=0.0, le=600.0)] = 0.6
    move_s: Annotated[float, Strict(), Field(ge=0.0, le=600.0)] = 0.4
    start_s: Real = 0.0


Motion: TypeAlias = Annotated[PathMotion | SwayMotion | SpinMotion | ShowMotion, Field(discriminator="kind")]


class SceneObject(StrictTable):
    """The keys of every object; `rotation_deg` rotates about x, then y, then z."""

    name: str = Field(min_length=1, max_length=60)
    material: str
    position_m: Position
    rotation_deg: Position = (0.0, 0.0, 0.0)
    motion: Motion | None = None


class QuadObject(SceneObject):
    """A flat rectangle; without rotation it faces the rig."""

    shape: Literal["quad"]
    size_m: tuple[Metres, Metres]


class BoxObject(SceneObject):
    """A box of width (x), height (y) and depth (z)."""

    shape: Literal["box"]
    size_m: tuple[Metres, Metres, Metres]


class SphereObject(SceneObject):
    """A sphere of `facets` bands from pole to pole; more are rounder and slower to render."""

    shape: Literal["sphere"]
    radius_m: Metres
    facets: int = Field(strict=True, default=10, ge=4, le=64)


class ColumnObject(SceneObject):
    """An upright cylinder or, with two radii, a truncated cone; its position is its middle."""

    shape: Literal["column"]
    radius_m: Metres
    top_radius_m: Metres | None = None
    height_m: Metres
    sides: int = Field(strict=True, default=20, ge=3, le=128)


class StatueObject(SceneObject):
    """A figurine of about `triangles` triangles; its position is the middle of its base."""

    shape: Literal["statue"]
    height_m: Metres
    triangles: int = Field(strict=True, default=8_000, ge=200, le=40_000)


Object: TypeAlias = Annotated[
    QuadObject | BoxObject | SphereObject | ColumnObject | StatueObject, Field(discriminator="shape")
]


class LightTable(StrictTable):
    """A distant lamp and the background; both are fixed in the scene, not to the rig."""

    towards: Position = (-0.45, -0.8, -0.55)
    """Direction from the scene towards the lamp."""
    ambient: Unit = 0.45
    """Light on a face turned away from the lamp."""
    horizon: Color = (0.62, 0.66, 0.7)
    zenith: Color = (0.28, 0.42, 0.62)


class SceneFile(StrictTable):
    """A whole scene file."""

    format: Literal["foveacam-scene"]
    version: Literal[1]
    title: str = ""
    light: LightTable = LightTable()
    materials: dict[str, Material]
    objects: Annotated[list[Object], Field(min_length=1)]
    stations: tuple[StationTable, ...] = ()
    """Pan-tilt poses for calibration; other scenes have none."""

    @model_validator(mode="after")
    def _check_references(self) -> "SceneFile":
        seen: set[str] = set()
        for entry in self.objects:
            if entry.material not in self.materials:
                known = ", ".join(sorted(self.materials))
                raise ValueError(
                    f"object {entry.name!r}: material {entry.material!r} is not defined; defined are: {known}"
                )
            if entry.name in seen:
                raise ValueError(f"object {entry.name!r} appears twice; give every object a name of its own")
            seen.add(entry.name)
        check_station_names(self.stations)
        return self
