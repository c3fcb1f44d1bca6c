"""Schemas that several resources share: the stop, a device's identification, a direction."""

from pydantic import Field

from foveacam_server.foundation.quantities import Degrees
from foveacam_server.foundation.schema import RequestModel, ResponseModel


class StopDocument(ResponseModel):
    """Whether the stop is engaged."""

    engaged: bool
    since_utc: str | None
    by: str | None


class StopAnswer(ResponseModel):
    """The stop is engaged; `parked`: whether the mirrors' controller confirmed, after `parked_in_ms`."""

    engaged: bool
    parked: bool
    parked_in_ms: float


class StopChange(ResponseModel):
    """Data of the events that the stop was engaged or released; `parked` is set when it was engaged."""

    by: str
    parked: bool | None = None
    stop: StopDocument


class RigStateChange(ResponseModel):
    """Data of the event that the rig's state changed; `devices`: those with a problem."""

    state: str
    devices: list[str]


class DeviceProblemDocument(ResponseModel):
    """A problem of a device."""

    device: str
    detail: str
    remedy: str


class DeviceName(ResponseModel):
    """Data of the event that a device is back."""

    device: str


class DeviceInfoDocument(ResponseModel):
    """Identification of a device."""

    vendor: str
    model: str
    serial: str
    version: str


class Direction(RequestModel):
    """Axis-wise angles in the rig frame: tan ax = X/Z, tan ay = Y/Z; +x right, +y down."""

    ax_deg: Degrees
    ay_deg: Degrees


class FollowMark(ResponseModel):
    """Mark of a followed target in the wide view, px."""

    id: str
    label: str
    state: str
    x_px: float
    y_px: float


class OverlayDocument(ResponseModel):
    """Overlay of the wide view, by eye; null: unknown.

    `footprints`: corners of the foveae's fields, (x, y) wide px. `gaze`: their directions. `follows`: the
    followed targets.
    """

    footprints: dict[str, list[tuple[float, float]] | None] = Field(default={})
    gaze: dict[str, Direction | None] = Field(default={})
    follows: list[FollowMark] = Field(default=[])
