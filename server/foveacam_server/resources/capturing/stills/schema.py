"""Schemas of stills."""

import math
from collections.abc import Sequence
from typing import Annotated, Literal, Self

from pydantic import BaseModel, Field, TypeAdapter, model_validator

from foveacam_hardware.contract import Role
from foveacam_pipeline.capture.dataset.values import FrameRecord, PlanPosition
from foveacam_pipeline.capture.still import MOST_FRAMES, StillFrame, StillPlan
from foveacam_server.datasets.archived import ArchivedDocument, archived_dataset
from foveacam_server.foundation.quantities import CodecName, Text
from foveacam_server.foundation.schema import RequestModel, ResponseModel
from foveacam_server.resources.capturing.stills.collection import URL, StoredStill

CameraName = Literal["wide", "left", "right"]
Name = Annotated[str, Field(max_length=1000)]
"""Name of the still's folder: up to 100 letters, digits, spaces, dots, dashes and underscores."""
StateName = Literal["held", "kept", "removed"]
UNCALIBRATED = (
    "the rig was not calibrated: pictures and volts are kept, no angles, and no pair can be rectified"
)
_CAMERAS = (Role.WIDE, Role.LEFT, Role.RIGHT)
_PLAN = TypeAdapter(StillPlan)


class StillRequest(RequestModel):
    """Request of a still; the mirrors do not move."""

    stack_frames: Annotated[int, Field(ge=1, le=MOST_FRAMES)] = 5
    stack_keep: Literal["mean", "all"] = "mean"
    """`mean`: the stack's mean in 16 bits; otherwise every frame as delivered. A single frame is stored
    unchanged."""
    cameras: Annotated[tuple[CameraName, ...], Field(min_length=1, max_length=3, strict=False)] = (
        "wide",
        "left",
        "right",
    )
    name: Name | None = None
    """None: named by the time."""
    label: Text = ""
    licence: Text = "all rights reserved"
    codec: CodecName = "png"
    save: bool = False
    """Keep the still at once; otherwise it is held until it is kept or discarded."""

    @model_validator(mode="after")
    def _once_each(self) -> "StillRequest":
        if len(set(self.cameras)) != len(self.cameras):
            raise ValueError("name every camera once")
        return self


class StillKeepRequest(RequestModel):
    """Name and label of a held still to keep; fields left out stay."""

    name: Name | None = None
    label: Text | None = None


class StillPatch(RequestModel):
    """Fields of a still to change."""

    label: Text | None = None
    licence: Text | None = None


class MissingCamera(BaseModel):
    """A camera that delivered fewer frames than requested, as stored in the dataset."""

    role: Role
    detail: str
    remedy: str


class StillConditions(BaseModel):
    """The conditions of a still's dataset, as far as they concern its frames."""

    exposures: list[StillFrame] = []
    missing: list[MissingCamera] = []


class StillCamera(ResponseModel):
    """The frames of one camera: `came` of `asked`, stored as `files`; `detail`: why no more came.

    Exposure, volts and angles are of the stack's middle; `gain_db` and the times are of its frames.
    """

    camera: CameraName
    asked: int
    came: int
    files: int
    width: int
    height: int
    channels: int
    bits: int
    exposure_ms: float | None
    gain_db: float | None
    first_t_ns: int | None
    last_t_ns: int | None
    x_v: float | None
    y_v: float | None
    ax_deg: float | None
    ay_deg: float | None
    detail: str
    remedy: str

    @classmethod
    def of(cls, role: Role, *, asked: int, files: Sequence[FrameRecord], conditions: StillConditions) -> Self:
        """Return the camera `role` of a still; `files`: of all its cameras."""
        own = [frame for frame in files if frame.role is role]
        exposures = [frame for frame in conditions.exposures if frame.role is role]
        missing = next((each for each in conditions.missing if each.role is role), None)
        first = own[0] if own else None
        volts_v = None if first is None else first.volts_v
        gaze_rad = None if first is None else first.gaze_rad
        return cls(
            camera=role.value,
            asked=asked,
            came=len(exposures),
            files=len(own),
            width=0 if first is None else first.width,
            height=0 if first is None else first.height,
            channels=0 if first is None else first.channels,
            bits=0 if first is None else first.bits,
            exposure_ms=None if first is None else first.exposure_ns / 1e6,
            gain_db=exposures[0].gain_db if exposures else None,
            first_t_ns=exposures[0].t_ns if exposures else None,
            last_t_ns=exposures[-1].t_ns if exposures else None,
            x_v=None if volts_v is None else volts_v[0],
            y_v=None if volts_v is None else volts_v[1],
            ax_deg=None if gaze_rad is None else math.degrees(gaze_rad[0]),
            ay_deg=None if gaze_rad is None else math.degrees(gaze_rad[1]),
            detail="" if missing is None else missing.detail,
            remedy="" if missing is None else missing.remedy,
        )


class StillDocument(ResponseModel):
    """One still.

    `trouble`: why it cannot be read; `distance_m`: at which the gazes cross; None: they do not.
    """

    id: str
    name: str
    label: str
    licence: str
    state: StateName
    trouble: str
    created_utc: str | None
    codec: str | None
    rig_id: str | None
    calibration_id: str | None
    stack_frames: int
    stack_keep: Literal["mean", "all"]
    cameras: list[StillCamera]
    distance_m: float | None
    rail_mm: float | None
    pan_deg: float | None
    tilt_deg: float | None
    size_bytes: int
    warnings: list[str]
    archived: ArchivedDocument | None
    folder: str
    url: str

    @classmethod
    def of(cls, found: StoredStill) -> Self:
        """Return the document of a still on the disk; a damaged one has no cameras, and a `trouble`."""
        stored, dataset = found.stored, found.stored.dataset
        header = None if dataset is None else dataset.document.header
        calibration = None if header is None else header.calibration
        plan = None if header is None else _PLAN.validate_python(header.plan)
        conditions = StillConditions.model_validate({} if header is None else header.conditions)
        files = [frame for point in dataset or () for frame in point.frames]
        place = dataset[0].place if dataset else PlanPosition(index=0)
        return cls(
            id=stored.id,
            name=stored.name,
            label="" if header is None else header.label,
            licence="" if header is None else header.licence,
            state=found.state.value,
            trouble=stored.trouble,
            created_utc=None if header is None else header.created_utc,
            codec=None if header is None else header.codec.value,
            rig_id=None if header is None else header.rig_id,
            calibration_id=None if calibration is None else calibration.id,
            stack_frames=0 if plan is None else plan.frames,
            stack_keep="mean" if plan is None else plan.keep.value,
            cameras=[
                StillCamera.of(role, asked=plan.frames, files=files, conditions=conditions)
                for role in _CAMERAS
                if plan is not None and role in plan.roles
            ],
            distance_m=place.distance_m,
            rail_mm=None if place.rail_m is None else 1e3 * place.rail_m,
            pan_deg=None if place.pan_rad is None else math.degrees(place.pan_rad),
            tilt_deg=None if place.tilt_rad is None else math.degrees(place.tilt_rad),
            size_bytes=sum(frame.size_bytes for frame in files),
            warnings=[UNCALIBRATED] if header is not None and calibration is None else [],
            archived=archived_dataset(stored),
            folder=str(stored.folder.resolve()),
            url=f"{URL}/{stored.id}",
        )


class StillEvent(ResponseModel):
    """Data of the events of stills."""

    still_id: str
    name: str
    state: StateName


class StillCheck(ResponseModel):
    """Whether every file is unchanged; `faults`: a sentence for each difference."""

    id: str
    sound: bool
    faults: list[str]
