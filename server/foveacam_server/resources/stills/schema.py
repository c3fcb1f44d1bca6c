"""Schemas of stills."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from foveacam_pipeline.capture.still import MOST_FRAMES
from foveacam_server.foundation.quantities import CodecName, Text
from foveacam_server.foundation.schema import RequestModel, ResponseModel

CameraName = Literal["wide", "left", "right"]
Name = Annotated[str, Field(max_length=1000)]
"""Becomes a folder: up to 100 letters, digits, spaces, dots, dashes and underscores."""
StateName = Literal["held", "kept", "removed"]


class StillRequest(RequestModel):
    """A still to take; the mirrors do not move."""

    stack_frames: Annotated[int, Field(ge=1, le=MOST_FRAMES)] = 5
    stack_keep: Literal["mean", "all"] = "mean"
    """The mean in 16 bits, or every frame as the camera gave it; a single frame is stored as it is."""
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
    """Keep it at once; else it is held until it is kept or discarded."""

    @model_validator(mode="after")
    def _once_each(self) -> "StillRequest":
        if len(set(self.cameras)) != len(self.cameras):
            raise ValueError("name every camera once")
        return self


class StillKeepRequest(RequestModel):
    """Name and label of a held still that is kept; those left out stay."""

    name: Name | None = None
    label: Text | None = None


class StillPatch(RequestModel):
    """Fields of a still to change."""

    label: Text | None = None
    licence: Text | None = None


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


class StillDocument(ResponseModel):
    """One still. `trouble`: why it cannot be read; `distance_m`: where the gazes cross, None: they do not."""

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
    folder: str
    url: str


class StillCheck(ResponseModel):
    """Whether every file is as it was written; `faults`: what is not, a sentence each."""

    id: str
    sound: bool
    faults: list[str]
