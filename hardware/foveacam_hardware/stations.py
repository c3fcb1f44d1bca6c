"""Stations as a file says them: where the base must point to calibrate, and what stands there.

A scene file lists those of its world, a rig file those of a real room.
"""

import math
from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from foveacam_hardware.contract import PanTiltPose, Station, StationTarget


class StationTable(BaseModel):
    """A place to look at while calibrating."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

    name: Annotated[str, Field(min_length=1, max_length=60)]
    target: Literal["board", "markers"]
    pan_deg: Annotated[float, Field(ge=-180.0, le=180.0)]
    """Above 0 to the right."""
    tilt_deg: Annotated[float, Field(ge=-90.0, le=90.0)] = 0.0
    """Above 0 down."""
    distance_m: Annotated[float, Field(gt=0.0, le=1000.0)] | None = None
    """From the wide camera to the middle of the target, by tape; leave it out when nobody measured."""

    def station(self) -> Station:
        """Return it as the contract's."""
        return Station(
            name=self.name,
            target=StationTarget(self.target),
            pose=PanTiltPose(pan_rad=math.radians(self.pan_deg), tilt_rad=math.radians(self.tilt_deg)),
            distance_m=self.distance_m,
        )


def check_station_names(stations: Sequence[StationTable]) -> None:
    """Raise `ValueError` when two stations have one name."""
    names = [station.name for station in stations]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"station {name!r} appears twice; give every station a name of its own")
