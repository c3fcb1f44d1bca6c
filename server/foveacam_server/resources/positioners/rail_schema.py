"""Schemas of the rail."""

from foveacam_server.foundation.quantities import Millimetres
from foveacam_server.foundation.schema import RequestModel, ResponseModel
from foveacam_server.resources.rig_state.schema import DeviceInfoDocument


class RailLimitsDocument(ResponseModel):
    """How far the rail reaches, from its middle."""

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
    """Position to which the operator is asked to push it; null when none, or when it moves itself."""
    connected: bool
    homed: bool
    moving: bool
    position_mm: float | None
    fault: str | None
    awaits_zero: bool
    """Whether it awaits the confirmation that it stands at its zero: `zero_confirmations`."""
    limits: RailLimitsDocument | None
    places: list[RailPlaceDocument]


class RailMove(RequestModel):
    """Destination of the rig: a place by its name, or millimetres from the middle."""

    place: str | None = None
    position_mm: Millimetres | None = None
