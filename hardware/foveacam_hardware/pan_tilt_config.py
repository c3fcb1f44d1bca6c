"""What a rig's TOML file may say of its pan-tilt, and the stations that it turns to."""

import math
from collections.abc import Sequence
from typing import Annotated, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, model_validator

from foveacam_hardware.contract import PanTiltLimits, PanTiltPose, Station, StationTarget


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


class OperatorConfig(BaseModel):
    """Somebody who turns the rig where it is wanted: after a while, at a pace, not quite there."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

    delay_s: Annotated[float, Field(ge=0.0, le=60.0)] = 0.8
    """From being asked to beginning to turn."""
    speed_deg_s: Annotated[float, Field(gt=0.0, le=200.0)] = 12.0
    error_deg: Annotated[float, Field(ge=0.0, le=5.0)] = 0.15
    """Standard deviation on either axis; never more than twice as much."""


PanDeg: TypeAlias = Annotated[float, Field(ge=-180.0, le=180.0)]
TiltDeg: TypeAlias = Annotated[float, Field(ge=-90.0, le=90.0)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class ManualPanTiltConfig(_Table):
    """The operator turns the rig."""

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
        """How far it turns."""
        return PanTiltLimits(
            pan_min_rad=math.radians(self.pan_min_deg),
            pan_max_rad=math.radians(self.pan_max_deg),
            tilt_min_rad=math.radians(self.tilt_min_deg),
            tilt_max_rad=math.radians(self.tilt_max_deg),
        )

    @property
    def zero(self) -> PanTiltPose:
        """Where the base points when its motors count zero."""
        return PanTiltPose(
            pan_rad=math.radians(self.zero_pan_deg or 0.0), tilt_rad=math.radians(self.zero_tilt_deg or 0.0)
        )


class GrblPanTiltConfig(_Motors):
    """Two motors on a Grbl board: X pans, Y tilts, in degrees."""

    kind: Literal["grbl"]
    has_switches: bool = True
    """False: it counts from where it stood when it was switched on."""

    @model_validator(mode="after")
    def _know_its_zero(self) -> "GrblPanTiltConfig":
        if self.has_switches and (self.zero_pan_deg is None or self.zero_tilt_deg is None):
            raise ValueError(
                "zero_pan_deg and zero_tilt_deg are missing: say where the base points at the reference"
                " switches, or `has_switches = false`"
            )
        return self


class PtuPanTiltConfig(_Motors):
    """A FLIR (Directed Perception) unit; `zero_…`: where the rig points at its 0/0, 0 when left out."""

    kind: Literal["ptu"]
    baud: Literal[600, 1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200] = 9600
    upside_down: bool = False
    """It hangs from above: both axes turn the other way."""


PanTiltConfig: TypeAlias = Annotated[
    GrblPanTiltConfig | PtuPanTiltConfig | ManualPanTiltConfig, Field(discriminator="kind")
]
