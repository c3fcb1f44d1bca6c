"""Schemas of captures: requests, descriptions, estimates, points."""

from typing import Annotated, Any, Literal

from pydantic import Field

from foveacam_pipeline.capture.plan import RasterPlan
from foveacam_server.foundation.quantities import CodecName, DistanceM, Text
from foveacam_server.foundation.schema import RequestModel, ResponseModel


class CaptureRequest(RequestModel):
    """A plan to capture, and its name; an empty plan is the whole field of the rig."""

    name: Annotated[str, Field(max_length=1000)]
    """Becomes a folder: up to 100 letters, digits, spaces, dots, dashes and underscores."""
    plan: RasterPlan = RasterPlan()
    label: Text = ""
    licence: Text = "all rights reserved"
    codec: CodecName = "tiff"
    """TIFF keeps up with the rig's full rate; PNG takes half the space."""


class EstimateRequest(RequestModel):
    """A plan to estimate; `distance_m` is used where the plan measures the distance at its start."""

    plan: RasterPlan = RasterPlan()
    codec: CodecName = "tiff"
    distance_m: DistanceM | None = None


class CapturePatch(RequestModel):
    """Fields of a capture to change."""

    label: Text | None = None
    licence: Text | None = None


class CapturePoints(ResponseModel):
    """Counts of a capture's points: planned, captured, skipped."""

    planned: int
    taken: int
    skipped: int
    scans: int
    frames: int


class CaptureProgress(ResponseModel):
    """Progress of a running capture; bytes and rate are of this run."""

    phase: Literal["survey", "rail", "points", "paused", "closing"]
    done: int
    total: int
    stored: int
    written_bytes: int
    bytes_per_s: float
    left_s: float | None
    note: str


class CaptureDocument(ResponseModel):
    """One capture. `why`: what ended a partial one, or what the operator is asked to do before it goes on."""

    id: str
    name: str
    folder: str
    """Path on the server's disk."""
    label: str
    licence: str
    state: Literal["starting", "running", "paused", "complete", "partial", "damaged"]
    why: str
    removed: bool
    created_utc: str | None
    codec: str | None
    rig_id: str | None
    calibration_id: str | None
    plan: dict[str, Any] | None  # Any: a raster plan, of this or an older version
    conditions: dict[str, Any] | None  # Any: what the rig ran with
    points: CapturePoints
    size_bytes: int
    resumable: bool
    job_id: str | None
    progress: CaptureProgress | None
    url: str


class PointDocument(ResponseModel):
    """A captured point. `sheet_row`, `sheet_column`: its position on the contact sheet, from 0."""

    index: int
    scan: int
    sheet_row: int
    sheet_column: int
    aim_ax_deg: float | None
    aim_ay_deg: float | None
    distance_m: float | None
    rail_mm: float | None
    cameras: list[Literal["left", "right", "wide"]]
    brackets: int


class SkippedPoint(ResponseModel):
    """A skipped point."""

    index: int
    why: str


class PointsDocument(ResponseModel):
    """The points of a capture; `rows`, `columns`: of the contact sheet."""

    rows: int
    columns: int
    points: list[PointDocument]
    skipped: list[SkippedPoint]


class CaptureChecked(ResponseModel):
    """Result of reading every file again; `faults`: a sentence each."""

    id: str
    sound: bool
    faults: list[str]


class KindDocument(ResponseModel):
    """Files of one kind: `fovea` or `wide`."""

    kind: str
    files: int
    raw_bytes: int
    stored_bytes: int


class Footprints(ResponseModel):
    """Corners of both views of a point, wide px, clockwise from the top left of its image."""

    left: list[tuple[float, float]]
    right: list[tuple[float, float]]


class CoverageDocument(ResponseModel):
    """Positions of the views of one scan in the wide image; shares and overlaps from 0 to 1."""

    footprints: list[Footprints]
    seen_either: float
    seen_both: float
    overlap_across: float | None
    overlap_down: float | None
    outside_wide: int


class EstimateDocument(ResponseModel):
    """Time and space of a plan. `total_s` is the least that physics allows: `limit_s`, verging and moves."""

    plan: dict[str, Any]  # Any: the raster plan, filled in
    distance_assumed: bool
    """Whether the distance will be measured at the start, and is assumed here."""
    points: int
    shots: int
    total_s: float
    limit_s: float
    reverge_s: float
    rail_s: float
    hand_moves: int
    files: int
    raw_bytes: int
    stored_bytes: int
    free_bytes: int
    kinds: list[KindDocument]
    warnings: list[str]
    coverage: CoverageDocument
