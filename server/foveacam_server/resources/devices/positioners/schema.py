"""Schemas of the pan-tilt and of the rail."""

from typing import Literal

from foveacam_server.foundation.quantities import Degrees, Millimetres
from foveacam_server.foundation.schema import RequestModel, ResponseModel
from foveacam_server.rig.schema import DeviceInfoDocument


class RailLimitsDocument(ResponseModel):
    """Range of the rail, from its middle."""

    min_mm: float
    max_mm: float


class RailPlaceDocument(ResponseModel):
    """A named position on the rail."""

    name: str
    position_mm: float


class RailDocument(ResponseModel):
    """The rail, which moves the whole rig sideways: + to its right."""

    present: bool
    info: DeviceInfoDocument | None
    moves_itself: bool
    """False when the operator pushes the rig by hand."""
    wanted_mm: float | None
    """Position to which the operator is asked to push the rig; null without one, or for a motorised rail."""
    connected: bool
    homed: bool
    moving: bool
    position_mm: float | None
    fault: str | None
    awaits_zero: bool
    """Whether it waits for the confirmation of its zero by `zero_confirmations`."""
    limits: RailLimitsDocument | None
    places: list[RailPlaceDocument]


class RailMove(RequestModel):
    """Destination of the rig: a place by its name, or millimetres from the middle."""

    place: str | None = None
    position_mm: Millimetres | None = None


class PanTiltLimitsDocument(ResponseModel):
    """Limits of the pan-tilt."""

    pan_min_deg: float
    pan_max_deg: float
    tilt_min_deg: float
    tilt_max_deg: float


class StationDocument(ResponseModel):
    """A pan-tilt pose for calibration; `distance_m`: measured by tape, null when not measured."""

    name: str
    target: Literal["board", "markers"]
    pan_deg: float
    tilt_deg: float
    distance_m: float | None


class PanTiltDocument(ResponseModel):
    """The pan-tilt, which turns the whole rig: +pan to the right, +tilt down."""

    present: bool
    info: DeviceInfoDocument | None
    moves_itself: bool
    """False when the operator turns the rig by hand."""
    wanted_pan_deg: float | None
    wanted_tilt_deg: float | None
    """Pose to which the operator is asked to turn the rig; null without one, or for a motorised pan-tilt."""
    connected: bool
    homed: bool
    moving: bool
    pan_deg: float | None
    tilt_deg: float | None
    fault: str | None
    awaits_zero: bool
    """Whether it waits for the confirmation of its zero by `zero_confirmations`."""
    limits: PanTiltLimitsDocument | None
    stations: list[StationDocument]


class PanTiltMove(RequestModel):
    """Destination of a turn: a station by its name, or a bearing."""

    station: str | None = None
    pan_deg: Degrees | None = None
    tilt_deg: Degrees | None = None
