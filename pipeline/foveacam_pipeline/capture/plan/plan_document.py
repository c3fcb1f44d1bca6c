"""The plan of a raster capture as a frozen, versioned document: degrees, millimetres, milliseconds.

It is the body of a REST request and a part of a dataset's `dataset.json`. An empty document is a valid
plan: 9 x 9 points over the field that the rig can steer, verged at the scene's average distance (Sec. 5.1).
"""

import json
from typing import Annotated, Literal, TypeAlias

from pydantic import BeforeValidator, Field, ValidationError, field_validator, model_validator

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.capture.plan.set_point_commands import MOST_SET_POINTS
from foveacam_pipeline.capture.plan.set_points import (
    LARGEST_DEG,
    AngleDeg,
    Distance,
    PlanModel,
    SetPoint,
    parse_set_points,
)

FORMAT = "foveacam-raster-plan"
VERSION = 1
MOST_POINTS = 20_000
"""Limit over all scans: with three grey images of 1.6 MB each, 93 GB."""
MOST_ALONG_AN_AXIS = 101

HalfDeg: TypeAlias = Annotated[float, Field(gt=0.0, le=45.0)]
ExposureMs: TypeAlias = Annotated[float, Field(gt=0.0, le=10_000.0)]
PlaceMm: TypeAlias = Annotated[float, Field(ge=-2000.0, le=2000.0)]
_SetPointList: TypeAlias = Annotated[tuple[SetPoint, ...], Field(max_length=MOST_SET_POINTS)]


class GridPoints(PlanModel):
    """Points in rows and columns, evenly spaced in angle about a centre; the outermost lie on the rim.

    Without half sizes it is as large as the calibration allows at the distance at which the eyes verge, and
    is filled in before the start.
    """

    kind: Literal["grid"] = "grid"
    columns: Annotated[int, Field(ge=1, le=MOST_ALONG_AN_AXIS)] = 9
    rows: Annotated[int, Field(ge=1, le=MOST_ALONG_AN_AXIS)] = 9
    centre_ax_deg: AngleDeg = 0.0
    centre_ay_deg: AngleDeg = 0.0
    half_width_deg: HalfDeg | None = None
    half_height_deg: HalfDeg | None = None
    order: Literal["serpentine", "rows"] = "serpentine"
    """Rows from the top; every other one backwards, or all from the left."""

    @model_validator(mode="after")
    def _has_a_whole_field(self) -> "GridPoints":
        if (self.half_width_deg is None) != (self.half_height_deg is None):
            raise ValueError(
                "one of half_width_deg and half_height_deg is missing; give both, or neither for all that"
                " the rig can steer"
            )
        for name, centre_deg, half_deg in (
            ("ax_deg", self.centre_ax_deg, self.half_width_deg or 0.0),
            ("ay_deg", self.centre_ay_deg, self.half_height_deg or 0.0),
        ):
            if abs(centre_deg) + half_deg > LARGEST_DEG:
                raise ValueError(
                    f"the grid reaches from {centre_deg - half_deg:g} to {centre_deg + half_deg:g} degrees in"
                    f" {name}, at most {LARGEST_DEG:g} either way is a direction; make it smaller"
                )
        return self


def _parse_text(value: object) -> object:
    """Accept set points as text too; turn an error of the text into one of the document."""
    if not isinstance(value, str):
        return value
    try:
        return parse_set_points(value)
    except InvalidInput as error:
        raise ValueError(str(error)) from error


class SetPoints(PlanModel):
    """Points one by one, in their order; accepted as text of the set-point language, kept written out."""

    kind: Literal["set_points"]
    points: Annotated[
        tuple[SetPoint, ...],
        Field(max_length=MOST_SET_POINTS, strict=False),
        BeforeValidator(_parse_text, json_schema_input_type=_SetPointList | str),
    ]

    @model_validator(mode="after")
    def _has_points(self) -> "SetPoints":
        if not self.points:
            raise ValueError("there is no point; give at least one")
        return self


class Verging(PlanModel):
    """The distance at which both eyes meet, from the rig's origin."""

    mode: Literal["scene", "given"] = "scene"
    """"scene": the average of the scene, measured by fixations before the start and filled in then."""
    distance_m: Distance | None = None
    each_point: bool = False
    """Verge anew at every point, as a click there does."""

    @model_validator(mode="after")
    def _has_what_it_was_given(self) -> "Verging":
        if self.mode == "given" and self.distance_m is None:
            raise ValueError('mode "given" lacks distance_m; give metres or "infinity", or choose "scene"')
        return self


class RasterPlan(PlanModel):
    """What a raster capture takes, in which order; the points follow from it alone."""

    format: Literal["foveacam-raster-plan"] = "foveacam-raster-plan"
    version: Literal[1] = 1
    points: Annotated[GridPoints | SetPoints, Field(discriminator="kind")] = GridPoints()
    verging: Verging = Verging()
    exposures_ms: Annotated[tuple[ExposureMs, ...], Field(max_length=16, strict=False)] = ()
    """The bracket, taken at every point in this order; empty: one picture, as the cameras are set."""
    stack_frames: Annotated[int, Field(ge=1, le=256)] = 1
    """Frames of every exposure."""
    stack_keep: Literal["mean", "all"] = "mean"
    """The mean of a stack in 16 bits, or every frame of it."""
    wide: Literal["point", "scan", "none"] = "point"
    """A wide frame with every point, one with every scan, or none."""
    rail_positions_mm: Annotated[tuple[PlaceMm, ...], Field(max_length=25, strict=False)] = ()
    """A full scan from each, in this order, mm from the rail's middle; empty: one, where the rig stands."""

    @field_validator("exposures_ms")
    @classmethod
    def _differ(cls, exposures_ms: tuple[float, ...]) -> tuple[float, ...]:
        if len(set(exposures_ms)) < len(exposures_ms):
            raise ValueError(
                "an exposure is given twice; use stack_frames for several frames of one exposure"
            )
        return exposures_ms

    @model_validator(mode="after")
    def _is_not_endless(self) -> "RasterPlan":
        total = self.scans * self.points_per_scan
        if total > MOST_POINTS:
            raise ValueError(
                f"{self.scans} scans of {self.points_per_scan} points are {total}, at most {MOST_POINTS} are"
                " taken in one capture; make it smaller or several"
            )
        return self

    @property
    def scans(self) -> int:
        """Number of full scans."""
        return max(1, len(self.rail_positions_mm))

    @property
    def points_per_scan(self) -> int:
        """Number of points of every scan."""
        source = self.points
        return source.columns * source.rows if isinstance(source, GridPoints) else len(source.points)

    @property
    def exposures_per_point(self) -> int:
        """Number of exposures of the bracket; 1 without one."""
        return max(1, len(self.exposures_ms))

    @property
    def needs_distance(self) -> bool:
        """Whether the scene's average distance has to be measured before the start."""
        source = self.points
        own = isinstance(source, SetPoints) and all(point.distance_m is not None for point in source.points)
        return self.verging.distance_m is None and not own

    @property
    def needs_field(self) -> bool:
        """Whether the size of the grid has to be filled in from the calibration."""
        return isinstance(self.points, GridPoints) and self.points.half_width_deg is None


def plan_from(document: object, *, what: str = "raster plan") -> RasterPlan:
    """Return the plan of a JSON document; raise InvalidInput that names `what` and the wrong field."""
    if isinstance(document, RasterPlan):
        return document
    if isinstance(document, dict):
        _check_version(document, what)
    try:
        return RasterPlan.model_validate_json(json.dumps(document))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"]) or "document"
        found = first["msg"].removeprefix("Value error, ")
        raise InvalidInput(f"{what}: {where}: {found}; correct it and try again") from error


def _check_version(document: dict[str, object], what: str) -> None:
    found = document.get("format", FORMAT), document.get("version", VERSION)
    if found[0] != FORMAT:
        raise InvalidInput(f"{what}: format {FORMAT!r} is needed, {found[0]!r} was found; give a raster plan")
    if found[1] != VERSION:
        raise InvalidInput(
            f"{what}: version {found[1]!r} was found, this program reads {VERSION};"
            " use the program that wrote it"
        )
