"""What REST says of the rail, and what it may be asked."""

from foveacam_server.api.models import RequestModel, ResponseModel
from foveacam_server.api.rig_models import DeviceInfoDocument
from foveacam_server.quantities import Millimetres


class RailLimitsDocument(ResponseModel):
    """How far the rail reaches, from its middle."""

    min_mm: float
    max_mm: float


class RailPlaceDocument(ResponseModel):
    """A place on the rail by its name."""

    name: str
    position_mm: float


class RailDocument(ResponseModel):
    """What moves the whole rig sideways: + to its right."""

    present: bool
    info: DeviceInfoDocument | None
    moves_itself: bool
    """False when the operator pushes the rig by hand."""
    wanted_mm: float | None
    """Where the operator is to push it; null when nothing is wanted, or when it moves itself."""
    connected: bool
    homed: bool
    moving: bool
    position_mm: float | None
    fault: str | None
    awaits_zero: bool
    """Whether it wants to be told that it stands at its zero: `zero_confirmations`."""
    limits: RailLimitsDocument | None
    places: list[RailPlaceDocument]


class RailMove(RequestModel):
    """Where the rig shall stand: a place by its name, or millimetres from the middle."""

    place: str | None = None
    position_mm: Millimetres | None = None
