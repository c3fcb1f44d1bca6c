"""The materials of a scene file, and the value types of all its tables."""

import re
from typing import Annotated, Literal, TypeAlias

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, Strict, model_validator

HEX_COLOR = re.compile(r"#[0-9a-fA-F]{6}")


def _color(value: object) -> object:
    """Convert "#rrggbb" into three numbers; leave anything else to the field's own validation."""
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
"""A number, not a string that looks like one."""
Position: TypeAlias = tuple[Real, Real, Real]


class StrictTable(BaseModel):
    """A TOML table; unknown keys, infinities and NaN are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class NoiseMaterial(StrictTable):
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
    """Stretch of the pattern sideways, as in wood."""
    seed: int = Field(strict=True, default=0, ge=0)

    @model_validator(mode="after")
    def _check_sizes(self) -> "NoiseMaterial":
        if self.finest_m >= self.coarsest_m:
            raise ValueError(f"finest_m {self.finest_m} must be below coarsest_m {self.coarsest_m}")
        return self


class PlainMaterial(StrictTable):
    """One colour without texture: no vergence is possible on it."""

    kind: Literal["plain"]
    color: Color


class CheckerboardMaterial(StrictTable):
    """Squares of two colours."""

    kind: Literal["checkerboard"]
    columns: int = Field(strict=True, ge=2, le=64)
    rows: int = Field(strict=True, ge=2, le=64)
    square_m: Metres
    color: Color = (0.92, 0.92, 0.9)
    accent: Color = (0.06, 0.06, 0.07)


class CharucoMaterial(StrictTable):
    """A ChArUco board: a checkerboard with markers of the dictionary 4X4_50 in its light squares."""

    kind: Literal["charuco"]
    columns: int = Field(strict=True, ge=2, le=16)
    """Squares, not corners."""
    rows: int = Field(strict=True, ge=2, le=16)
    square_m: Metres
    """A marker's black square is three quarters of it."""
    color: Color = (0.92, 0.92, 0.9)
    accent: Color = (0.06, 0.06, 0.07)

    @model_validator(mode="after")
    def _check_marker_count(self) -> "CharucoMaterial":
        if self.columns * self.rows // 2 > 50:
            raise ValueError(
                f"{self.columns} x {self.rows} squares take more than the dictionary's 50 markers;"
                " use fewer squares"
            )
        return self


class MarkerMaterial(StrictTable):
    """An ArUco marker of the dictionary 4X4_50 with its white border."""

    kind: Literal["aruco"]
    id: int = Field(strict=True, ge=0, le=49)
    side_m: Metres = 0.06
    """Side of the black square."""
    color: Color = (0.92, 0.92, 0.9)
    accent: Color = (0.06, 0.06, 0.07)


class PrintMaterial(StrictTable):
    """Lines of text on coloured paper, stretched over the face: signs, book spines, posters."""

    kind: Literal["print"]
    text: str = Field(max_length=120)
    """Lines are separated by a line feed."""
    width_m: Metres
    height_m: Metres
    color: Color
    accent: Color
    upright: bool = False
    """Text runs from top to bottom, as on a book's spine."""


class PictureMaterial(StrictTable):
    """An image file beside the scene file (PNG or JPEG)."""

    kind: Literal["picture"]
    file: str
    width_m: Metres


Material: TypeAlias = Annotated[
    NoiseMaterial
    | PlainMaterial
    | CheckerboardMaterial
    | CharucoMaterial
    | MarkerMaterial
    | PrintMaterial
    | PictureMaterial,
    Field(discriminator="kind"),
]
