"""Schemas of the screens that show a calibration pattern, of the pattern, and of its print."""

from typing import Annotated, Literal

from pydantic import ConfigDict, Field

from foveacam_pipeline.calibrate.wide.dictionary_names import DictionaryName
from foveacam_server.foundation.quantities import Label
from foveacam_server.foundation.schema import RequestModel, ResponseModel

Corners = Annotated[int, Field(ge=3, le=40)]
SideMm = Annotated[float, Field(gt=0.0, le=1000.0, allow_inf_nan=False)]
ScreenPx = Annotated[int, Field(ge=1, le=100_000)]
PixelsPerMm = Annotated[float, Field(gt=0.0, le=1000.0, allow_inf_nan=False)]
MarkerId = Annotated[int, Field(ge=0, le=49)]
MarginMm = Annotated[float, Field(ge=4.0, le=40.0, allow_inf_nan=False)]
PaperName = Literal["A4", "A3", "Letter"]
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
    id: MarkerId
    side_mm: SideMm


class MarkersPattern(RequestModel):
    """The mirrors' three markers: 0 (wide) between 1 (left) and 2 (right).

    `spacing_mm`: from the middle one to each of the others, as a rule half the baseline.
    """

    kind: Literal["markers"]
    side_mm: SideMm
    spacing_mm: SideMm


class BlankPattern(RequestModel):
    """A blank white screen."""

    kind: Literal["blank"]


ShownPattern = Annotated[
    CharucoPattern | CheckerboardPattern | MarkerPattern | MarkersPattern | BlankPattern,
    Field(discriminator="kind"),
]


class PatternDocument(ResponseModel):
    """The pattern that all screens show; its size includes the white edge, and is null when it is blank."""

    pattern: ShownPattern
    description: str
    width_mm: float | None
    height_mm: float | None


class StoredPattern(RequestModel):
    """The stored pattern, which is restored after a restart."""

    pattern: ShownPattern


class PrintQuery(RequestModel):
    """A print: the numbers of a pattern, or none of them for the pattern of the displays; and the paper.

    `dictionary`: of a ChArUco board, 4X4_50 without. `margin_mm`: white on all sides of the paper.
    """

    model_config = ConfigDict(strict=False)  # query values arrive as text

    kind: Literal["charuco", "checkerboard", "marker", "markers"] | None = None
    columns: Corners | None = None
    rows: Corners | None = None
    square_mm: SideMm | None = None
    marker_mm: SideMm | None = None
    dictionary: DictionaryName | None = None
    id: MarkerId | None = None
    side_mm: SideMm | None = None
    spacing_mm: SideMm | None = None
    paper: PaperName = "A4"
    margin_mm: MarginMm = 8.0


class DisplayRequest(RequestModel):
    """A screen as it describes itself.

    `width_px`, `height_px`: of the page, device pixels. `px_per_mm`: device pixels; null: not calibrated
    there yet.
    """

    name: Label
    width_px: ScreenPx
    height_px: ScreenPx
    px_per_mm: PixelsPerMm | None


class DisplayDocument(ResponseModel):
    """A connected screen; sizes in mm are null until its scale is set there.

    `fits`: whether the pattern fits on it; null when unknown. `silent_s`: time since its last message.
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
