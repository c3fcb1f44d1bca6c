"""Schemas of captures: requests, descriptions, estimates, points, events."""

import math
from typing import Annotated, Any, Literal, Self, TypeAlias
from urllib.parse import quote

from pydantic import Field

from foveacam_pipeline.capture.dataset import Dataset, DatasetPoint
from foveacam_pipeline.capture.dataset.pictures import sheet_cells
from foveacam_pipeline.capture.plan import PlanCoverage, RasterPlan
from foveacam_pipeline.capture.run import CaptureReport
from foveacam_server.datasets.archived import ArchivedDocument, archived_dataset
from foveacam_server.datasets.collection import CAPTURES_URL, StoredCapture
from foveacam_server.foundation.quantities import CodecName, DistanceM, Text
from foveacam_server.foundation.schema import RequestModel, ResponseModel

LiveState: TypeAlias = Literal["starting", "running", "paused"]
State: TypeAlias = Literal[LiveState, "complete", "partial", "damaged"]


class CaptureRequest(RequestModel):
    """Request of a capture: its plan and name; an empty plan covers the whole field of the rig."""

    name: Annotated[str, Field(max_length=1000)]
    """Name of the dataset's folder: up to 100 letters, digits, spaces, dots, dashes and underscores."""
    plan: RasterPlan = RasterPlan()
    label: Text = ""
    licence: Text = "all rights reserved"
    codec: CodecName = "tiff"
    """TIFF keeps up with the rig's full rate; PNG takes half the space."""


class CaptureResumption(RequestModel):
    """The capture to resume; stored as the request of the job."""

    capture_id: str


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

    @classmethod
    def of(cls, dataset: Dataset | None) -> Self:
        """Return the counts of a dataset; zeros for None, a dataset that cannot be read."""
        if dataset is None:
            return cls(planned=0, taken=0, skipped=0, scans=0, frames=0)
        return cls(
            planned=dataset.document.header.points,
            taken=len(dataset),
            skipped=len(dataset.skipped),
            scans=len(dataset.scans),
            frames=sum(len(point.frames) for point in dataset),
        )


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

    @classmethod
    def of(cls, report: CaptureReport) -> Self:
        """Return the progress that a capture reports."""
        return cls(
            phase=report.phase.value,
            done=report.done,
            total=report.total,
            stored=report.stored,
            written_bytes=report.written_bytes,
            bytes_per_s=round(report.bytes_per_s, 1),
            left_s=None if report.left_s is None else round(report.left_s, 2),
            note=report.note,
        )


class CaptureProgressEvent(CaptureProgress):
    """Data of the event `capture.progress`. `wish`: manual action that the operator is asked for."""

    capture_id: str
    job_id: str
    state: LiveState
    wish: str


class CaptureEvent(ResponseModel):
    """Data of the other events of captures; `name` of a removed one, `state` and `why` of one that ended."""

    capture_id: str
    name: str | None = None
    state: State | None = None
    why: str | None = None


class CaptureDocument(ResponseModel):
    """One capture. `why`: what ended a partial one, or the action that the operator is asked for."""

    id: str
    name: str
    folder: str
    """Path on the server's disk."""
    label: str
    licence: str
    state: State
    why: str
    removed: bool
    created_utc: str | None
    codec: str | None
    rig_id: str | None
    calibration_id: str | None
    plan: dict[str, Any] | None  # Any: a raster plan, of this or an older version
    conditions: dict[str, Any] | None  # Any: the rig's configuration during the capture
    points: CapturePoints
    size_bytes: int
    resumable: bool
    job_id: str | None
    progress: CaptureProgress | None
    archived: ArchivedDocument | None
    url: str

    @classmethod
    def of(cls, stored: StoredCapture) -> Self:
        """Return a capture on the disk; the service adds a running job."""
        dataset = stored.dataset
        header = None if dataset is None else dataset.document.header
        calibration = None if header is None else header.calibration
        state: State = "damaged" if dataset is None else dataset.document.state.value
        return cls(
            id=stored.id,
            name=stored.name,
            folder=str(stored.folder.resolve()),
            label="" if header is None else header.label,
            licence="" if header is None else header.licence,
            state=state,
            why=stored.trouble if dataset is None else dataset.document.why,
            removed=stored.removed,
            created_utc=None if header is None else header.created_utc,
            codec=None if header is None else header.codec.value,
            rig_id=None if header is None else header.rig_id,
            calibration_id=None if calibration is None else calibration.id,
            plan=None if header is None else header.plan,
            conditions=None if header is None else header.conditions,
            points=CapturePoints.of(dataset),
            size_bytes=sum(frame.size_bytes for point in dataset or () for frame in point.frames),
            resumable=state == "partial" and not stored.removed,
            job_id=None,
            progress=None,
            archived=archived_dataset(stored),
            url=f"{CAPTURES_URL}/{quote(stored.id, safe='')}",
        )


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

    @classmethod
    def of(cls, point: DatasetPoint, cell: tuple[int, int]) -> Self:
        """Return a point of a dataset; `cell`: its row and column on the contact sheet."""
        place = point.place
        ax_rad, ay_rad = place.aim_rad or (None, None)
        return cls(
            index=point.index,
            scan=place.scan,
            sheet_row=cell[0],
            sheet_column=cell[1],
            aim_ax_deg=None if ax_rad is None else math.degrees(ax_rad),
            aim_ay_deg=None if ay_rad is None else math.degrees(ay_rad),
            distance_m=place.distance_m,
            rail_mm=None if place.rail_m is None else 1e3 * place.rail_m,
            cameras=sorted({frame.role.value for frame in point.frames}),
            brackets=len(point.brackets),
        )


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

    @classmethod
    def of(cls, dataset: Dataset) -> Self:
        """Return the captured points of a dataset in order, and the skipped ones with the reason."""
        points = list(dataset)
        cells = sheet_cells(points)
        return cls(
            rows=max((row + 1 for row, _ in cells), default=0),
            columns=max((column + 1 for _, column in cells), default=0),
            points=[PointDocument.of(point, cell) for point, cell in zip(points, cells, strict=True)],
            skipped=[SkippedPoint(index=index, why=why) for index, why in dataset.skipped.items()],
        )


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

    @classmethod
    def of(cls, cover: PlanCoverage) -> Self:
        """Return the footprints of a plan's views."""
        return cls(
            footprints=[
                Footprints(left=left, right=right) for left, right in cover.footprints_px.round(2).tolist()
            ],
            seen_either=round(cover.seen_either, 4),
            seen_both=round(cover.seen_both, 4),
            overlap_across=cover.overlap_across,
            overlap_down=cover.overlap_down,
            outside_wide=cover.outside_wide,
        )


class EstimateDocument(ResponseModel):
    """Time and space of a plan. `total_s` is the least that physics allows: `limit_s`, verging and moves."""

    plan: dict[str, Any]  # Any: the raster plan, filled in
    distance_assumed: bool
    """Whether the distance will be measured at the start, and is assumed here."""
    points: int
    shots: int
    total_s: float
    duration_low_s: float
    """The least time that the capture is expected to take until it is complete, without moves by hand."""
    duration_high_s: float
    """The largest such time."""
    preparing_low_s: float
    """Of it, the least time before the first point: `preparing_fixations` measure the scene's distance."""
    preparing_high_s: float
    """The largest such time."""
    preparing_fixations: int
    timed_captures: int
    """How many of the rig's last captures the expected times are from; with 0 they are assumed."""
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
