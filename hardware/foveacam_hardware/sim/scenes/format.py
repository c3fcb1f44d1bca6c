"""The scene file format, version 1: what a TOML file may say. Described in `hardware/README.md`.

Axes are the rig's: +x right, +y down, +z forward, metres; the wide camera is the origin.
Reading files and their errors is in `loader`; making renderable objects of it is in `build`.
"""

import re
from typing import Annotated, Literal, TypeAlias

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, Strict, model_validator

HEX_COLOR = re.compile(r"#[0-9a-fA-F]{6}")


def _color(value: object) -> object:
    """Turn "#rrggbb" into three numbers, and leave anything else to the field's own check."""
    if isinstance(value, str):
        if not HEX_COLOR.fullmatch(value):
            raise ValueError(f'colour {value!r} is not "#rrggbb"; write six hexadecimal digits')
        return tuple(int(value[i : i + 2], 16) / 255.0 for i in (1, 3, 5))
    return value


Unit: TypeAlias = Annotated[float, Strict(), Field(ge=0.0, le=1.0)]
Color: TypeAlias = Annotated[tuple[Unit, Unit, Unit], BeforeValidator(_color)]
"""RGB, 0..1, written "#rrggbb" or as three numbers."""
Metres: TypeAlias = Annotated[float, Strict(), Field(gt=0.0, le=1000.0)]
Real: TypeAlias = Annotated[float, Strict()]
"""A number written as one: "1" is none."""
Position: TypeAlias = tuple[Real, Real, Real]


class Table(BaseModel):
    """A TOML table: unknown keys are refused, infinities and NaN too."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class NoiseMaterial(Table):
    """Natural texture: noise of many octaves between two colours, with detail down to `finest_m`."""

    kind: Literal["noise"]
    color: Color
    accent: Color
    contrast: Annotated[float, Strict(), Field(ge=0.05, le=5.0)] = 1.0
    """1 looks like stone or cloth; 0.3 is faint, 2.5 bold."""
    coarsest_m: Metres = 0.5
    """Size of the largest blotches."""
    finest_m: Metres = 0.0001
    stretch: Annotated[float, Strict(), Field(ge=1.0, le=50.0)] = 1.0
    """Draws the pattern out sideways, as in wood."""
    seed: int = Field(strict=True, default=0, ge=0)

    @model_validator(mode="after")
    def _leave_room_between(self) -> "NoiseMaterial":
        if self.finest_m >= self.coarsest_m:
            raise ValueError(f"finest_m {self.finest_m} must be below coarsest_m {self.coarsest_m}")
        return self


class PlainMaterial(Table):
    """One colour and no texture at all: nothing to verge on."""

    kind: Literal["plain"]
    color: Color


class CheckerboardMaterial(Table):
    """Squares of two colours."""

    kind: Literal["checkerboard"]
    columns: int = Field(strict=True, ge=2, le=64)
    rows: int = Field(strict=True, ge=2, le=64)
    square_m: Metres
    color: Color = (0.92, 0.92, 0.9)
    accent: Color = (0.06, 0.06, 0.07)


class MarkerMaterial(Table):
    """An ArUco marker of the dictionary 4X4_50 with its white border."""

    kind: Literal["aruco"]
    id: int = Field(strict=True, ge=0, le=49)
    side_m: Metres = 0.06
    """Side of the black square."""
    color: Color = (0.92, 0.92, 0.9)
    accent: Color = (0.06, 0.06, 0.07)


class PrintMaterial(Table):
    """Lines of text on coloured stock, stretched over the face: signs, book spines, posters."""

    kind: Literal["print"]
    text: str = Field(max_length=120)
    """Lines are separated by a line feed."""
    width_m: Metres
    height_m: Metres
    color: Color
    accent: Color
    upright: bool = False
    """Write from top to bottom, as on a book's spine."""


class PictureMaterial(Table):
    """An image file beside the scene file (PNG or JPEG)."""

    kind: Literal["picture"]
    file: str
    width_m: Metres


Material: TypeAlias = Annotated[
    NoiseMaterial | PlainMaterial | CheckerboardMaterial | MarkerMaterial | PrintMaterial | PictureMaterial,
    Field(discriminator="kind"),
]


class PathMotion(Table):
    """Walk along a line of points at a constant speed, there and back or around."""

    kind: Literal["path"]
    points_m: Annotated[list[Position], Field(min_length=2)]
    speed_m_per_s: Annotated[float, Strict(), Field(gt=0.0, le=60.0)]
    closed: bool = False
    """Around and around; else there and back."""
    start_s: Real = 0.0
    """How far into the walk it is at the beginning."""


class SwayMotion(Table):
    """Swing about the position, along a vector."""

    kind: Literal["sway"]
    amplitude_m: Position
    period_s: Annotated[float, Strict(), Field(gt=0.0)]
    start_s: Real = 0.0


class SpinMotion(Table):
    """Turn about the vertical axis."""

    kind: Literal["spin"]
    period_s: Annotated[float, Strict(), Field(gt=0.0)]
    start_s: Real = 0.0


Motion: TypeAlias = Annotated[PathMotion | SwayMotion | SpinMotion, Field(discriminator="kind")]


class Thing(Table):
    """What all objects have in common; `rotation_deg` turns about x, then y, then z."""

    name: str = Field(min_length=1, max_length=60)
    material: str
    position_m: Position
    rotation_deg: Position = (0.0, 0.0, 0.0)
    motion: Motion | None = None


class QuadThing(Thing):
    """A flat rectangle; unturned, it faces the rig."""

    shape: Literal["quad"]
    size_m: tuple[Metres, Metres]


class BoxThing(Thing):
    """A box of width (x), height (y) and depth (z)."""

    shape: Literal["box"]
    size_m: tuple[Metres, Metres, Metres]


class SphereThing(Thing):
    """A ball of `facets` flats from pole to pole; more are rounder and take longer to draw."""

    shape: Literal["sphere"]
    radius_m: Metres
    facets: int = Field(strict=True, default=10, ge=4, le=64)


class ColumnThing(Thing):
    """An upright cylinder or, with two radii, a cone's stump; its position is its middle."""

    shape: Literal["column"]
    radius_m: Metres
    top_radius_m: Metres | None = None
    height_m: Metres
    sides: int = Field(strict=True, default=20, ge=3, le=128)


class StatueThing(Thing):
    """A figurine of about `triangles` triangles; its position is the middle of its foot."""

    shape: Literal["statue"]
    height_m: Metres
    triangles: int = Field(strict=True, default=8_000, ge=200, le=40_000)


Object: TypeAlias = Annotated[
    QuadThing | BoxThing | SphereThing | ColumnThing | StatueThing, Field(discriminator="shape")
]


class LightTable(Table):
    """A distant lamp and the background where nothing stands; both belong to the scene, not to the rig."""

    towards: Position = (-0.45, -0.8, -0.55)
    """Direction from the scene towards the lamp."""
    ambient: Unit = 0.45
    """Light that reaches a face turned away from the lamp."""
    horizon: Color = (0.62, 0.66, 0.7)
    zenith: Color = (0.28, 0.42, 0.62)


class SceneFile(Table):
    """A whole scene file."""

    format: Literal["foveacam-scene"]
    version: Literal[1]
    title: str = ""
    light: LightTable = LightTable()
    materials: dict[str, Material]
    objects: Annotated[list[Object], Field(min_length=1)]

    @model_validator(mode="after")
    def _refer_to_what_is_there(self) -> "SceneFile":
        seen: set[str] = set()
        for thing in self.objects:
            if thing.material not in self.materials:
                known = ", ".join(sorted(self.materials))
                raise ValueError(
                    f"object {thing.name!r}: material {thing.material!r} is not defined; defined are: {known}"
                )
            if thing.name in seen:
                raise ValueError(f"object {thing.name!r} appears twice; give every object a name of its own")
            seen.add(thing.name)
        return self
