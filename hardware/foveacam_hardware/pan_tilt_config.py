"""Schema of the pan-tilt in a rig's TOML file, its calibration stations, and the simulated operator.

A station says where the base must point and which target is there. Scene files list the stations of their
scene, rig files those of a real room.
"""

import math
from collections.abc import Sequence
from typing import Annotated, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, model_validator

from foveacam_hardware.contract import PanTiltLimits, PanTiltPose, Station, StationTarget


class StationTable(BaseModel):
    """A bearing to calibrate at, and the target that is seen there."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

    name: Annotated[str, Field(min_length=1, max_length=60)]
    target: Literal["board", "markers"]
    pan_deg: Annotated[float, Field(ge=-180.0, le=180.0)]
    """Positive to the right."""
    tilt_deg: Annotated[float, Field(ge=-90.0, le=90.0)] = 0.0
    """Positive down."""
    distance_m: Annotated[float, Field(gt=0.0, le=1000.0)] | None = None
    """Measured distance from the wide camera to the centre of the target; leave it out when not measured."""

    def station(self) -> Station:
        """Return the contract's value type."""
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


class OperatorConfig(BaseModel):
    """A simulated person who turns a manual pan-tilt: reaction time, speed and pointing error."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

    delay_s: Annotated[float, Field(ge=0.0, le=60.0)] = 0.8
    """Reaction time from the request to the start of the turn."""
    speed_deg_s: Annotated[float, Field(gt=0.0, le=200.0)] = 12.0
    error_deg: Annotated[float, Field(ge=0.0, le=5.0)] = 0.15
    """Standard deviation of the pointing error on each axis; the error never exceeds twice this value."""


PanDeg: TypeAlias = Annotated[float, Field(ge=-180.0, le=180.0)]
TiltDeg: TypeAlias = Annotated[float, Field(ge=-90.0, le=90.0)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class ManualPanTiltConfig(_Table):
    """A pan-tilt that the operator turns by hand."""

    kind: Literal["manual"]
    stations: list[StationTable] = Field(default_factory=list)

    @model_validator(mode="after")
    def _name_each_once(self) -> "ManualPanTiltConfig":
        check_station_names(self.stations)
        return self


class _Motors(_Table):
    port: Annotated[str, Field(min_length=1)]
    pan_min_deg: PanDeg = -70.0
    pan_max_deg: PanDeg = 70.0
    tilt_min_deg: TiltDeg = -30.0
    tilt_max_deg: TiltDeg = 30.0
    zero_pan_deg: PanDeg | None = None
    zero_tilt_deg: TiltDeg | None = None
    speed_deg_s: Annotated[float, Field(gt=0.0, le=200.0)] = 25.0
    stations: list[StationTable] = Field(default_factory=list)

    @model_validator(mode="after")
    def _reach_its_stations(self) -> "_Motors":
        if self.pan_min_deg >= self.pan_max_deg or self.tilt_min_deg >= self.tilt_max_deg:
            raise ValueError("a minimum is not below its maximum; exchange them")
        check_station_names(self.stations)
        for station in self.stations:
            self._check_reach(station)
        return self

    def _check_reach(self, station: StationTable) -> None:
        pan_ok = self.pan_min_deg <= station.pan_deg <= self.pan_max_deg
        if not (pan_ok and self.tilt_min_deg <= station.tilt_deg <= self.tilt_max_deg):
            raise ValueError(
                f"station {station.name!r} at {station.pan_deg:g}, {station.tilt_deg:g} deg lies outside"
                f" {self.pan_min_deg:g} to {self.pan_max_deg:g}, {self.tilt_min_deg:g} to"
                f" {self.tilt_max_deg:g} deg; move it, or widen the limits"
            )

    @property
    def limits(self) -> PanTiltLimits:
        """The range of both axes, rad."""
        return PanTiltLimits(
            pan_min_rad=math.radians(self.pan_min_deg),
            pan_max_rad=math.radians(self.pan_max_deg),
            tilt_min_rad=math.radians(self.tilt_min_deg),
            tilt_max_rad=math.radians(self.tilt_max_deg),
        )

    @property
    def zero(self) -> PanTiltPose:
        """The bearing of the base at motor position zero, rad."""
        return PanTiltPose(
            pan_rad=math.radians(self.zero_pan_deg or 0.0), tilt_rad=math.radians(self.zero_tilt_deg or 0.0)
        )


class GrblPanTiltConfig(_Motors):
    """Two motors on a Grbl board: X is pan, Y is tilt, in degrees."""

    kind: Literal["grbl"]
    has_switches: bool = True
    """False: positions count from where the axes were at power-on."""

    @model_validator(mode="after")
    def _know_its_zero(self) -> "GrblPanTiltConfig":
        if self.has_switches and (self.zero_pan_deg is None or self.zero_tilt_deg is None):
            raise ValueError(
                "zero_pan_deg and zero_tilt_deg are missing: give the base's angles at the reference"
                " switches, or `has_switches = false`"
            )
        return self


class PtuPanTiltConfig(_Motors):
    """A FLIR (Directed Perception) unit; `zero_…`: bearing of the rig at the unit's 0/0, default 0."""

    kind: Literal["ptu"]
    baud: Literal[600, 1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200] = 9600
    upside_down: bool = False
    """The unit is mounted upside down: both axes turn the other way."""


PanTiltConfig: TypeAlias = Annotated[
    GrblPanTiltConfig | PtuPanTiltConfig | ManualPanTiltConfig, Field(discriminator="kind")
]
