"""Schemas of the screens that show a calibration pattern, and of the pattern."""

from typing import Annotated, Literal

from pydantic import Field

from foveacam_server.foundation.quantities import Label
from foveacam_server.foundation.schema import RequestModel, ResponseModel

Corners = Annotated[int, Field(ge=3, le=40)]
SideMm = Annotated[float, Field(gt=0.0, le=1000.0, allow_inf_nan=False)]
ScreenPx = Annotated[int, Field(ge=1, le=100_000)]
PixelsPerMm = Annotated[float, Field(gt=0.0, le=1000.0, allow_inf_nan=False)]
DisplayId = Annotated[str, Field(pattern=r"^[0-9a-f]{8,32}$")]


class CharucoPattern(RequestModel):
    """A ChArUco board: inner corners, sides of a square and of a marker (dictionary 4X4_50)."""

    kind: Literal["charuco"]
    columns: Corners
    rows: Corners
    square_mm: SideMm
    marker_mm: SideMm


class CheckerboardPattern(RequestModel):
    """A plain checkerboard: inner corners, side of a square."""

    kind: Literal["checkerboard"]
    columns: Corners
    rows: Corners
    square_mm: SideMm


class MarkerPattern(RequestModel):
    """One marker of the dictionary 4X4_50: id, side of the black square."""

    kind: Literal["marker"]
    id: Annotated[int, Field(ge=0, le=49)]
    side_mm: SideMm


class MarkersPattern(RequestModel):
    """The mirrors' three markers: 0 (wide) between 1 (left) and 2 (right).

    `spacing_mm`: from the middle one to each of the others, as a rule half the baseline.
    """

    kind: Literal["markers"]
    side_mm: SideMm
    spacing_mm: SideMm


class BlankPattern(RequestModel):
    """White all over."""

    kind: Literal["blank"]


ShownPattern = Annotated[
    CharucoPattern | CheckerboardPattern | MarkerPattern | MarkersPattern | BlankPattern,
    Field(discriminator="kind"),
]


class PatternDocument(ResponseModel):
    """The pattern that all screens show; its size is that with the white edge, null when it is blank."""

    pattern: ShownPattern
    description: str
    width_mm: float | None
    height_mm: float | None


class StoredPattern(RequestModel):
    """The pattern as it is kept over a restart."""

    pattern: ShownPattern


class DisplayRequest(RequestModel):
    """A screen as it describes itself.

    `width_px`, `height_px`: of the page, device pixels. `px_per_mm`: device pixels; null: not set there yet.
    """

    name: Label
    width_px: ScreenPx
    height_px: ScreenPx
    px_per_mm: PixelsPerMm | None


class DisplayDocument(ResponseModel):
    """A connected screen; sizes in mm are null until its scale is set there.

    `fits`: whether the pattern fits on it; null when that is not known. `silent_s`: since it was heard last.
    """

    id: str
    name: str
    width_px: int
    height_px: int
    px_per_mm: float | None
    width_mm: float | None
    height_mm: float | None
    fits: bool | None
    silent_s: float
