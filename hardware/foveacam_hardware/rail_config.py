"""Schema of the rail in a rig's TOML file, and the named positions on it.

The default positions are the five from which the paper's datasets are captured (Sec. 5.1).
"""

from collections.abc import Sequence
from typing import Annotated, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, model_validator

from foveacam_hardware.contract import RailLimits, RailPlace

PAPER_PLACES = (
    RailPlace(name="far left", position_m=-0.3),
    RailPlace(name="left", position_m=-0.1),
    RailPlace(name="centre", position_m=0.0),
    RailPlace(name="right", position_m=0.1),
    RailPlace(name="far right", position_m=0.3),
)
"""Sec. 5.1: along the x axis, mm -300, -100, 0, 100, 300."""
PlaceMm: TypeAlias = Annotated[float, Field(ge=-2000.0, le=2000.0)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class RailPlaceTable(_Table):
    """A named position on the rail."""

    name: Annotated[str, Field(min_length=1, max_length=60)]
    position_mm: PlaceMm
    """Distance from the centre of the rail, positive to the rig's right."""


def _paper_places() -> list[RailPlaceTable]:
    return [RailPlaceTable(name=place.name, position_mm=1e3 * place.position_m) for place in PAPER_PLACES]


class _Rail(_Table):
    min_mm: PlaceMm = -300.0
    max_mm: PlaceMm = 300.0
    places: list[RailPlaceTable] = Field(default_factory=_paper_places)

    @model_validator(mode="after")
    def _hold_its_places(self) -> "_Rail":
        if self.min_mm >= self.max_mm:
            raise ValueError("min_mm is not below max_mm; exchange them")
        _check_places(self.places, self.min_mm, self.max_mm)
        return self

    @property
    def limits(self) -> RailLimits:
        """The travel of the rail, m."""
        return RailLimits(min_m=1e-3 * self.min_mm, max_m=1e-3 * self.max_mm)

    @property
    def named_positions(self) -> tuple[RailPlace, ...]:
        """The named positions as the contract's value types."""
        return tuple(RailPlace(name=place.name, position_m=1e-3 * place.position_mm) for place in self.places)


class ManualRailConfig(_Rail):
    """A rail along which the operator pushes the rig by hand, read on a scale."""

    kind: Literal["manual"]


class GrblRailConfig(_Rail):
    """A motor on axis Z of a Grbl board, in millimetres; the board may also drive the pan-tilt."""

    kind: Literal["grbl"]
    port: Annotated[str, Field(min_length=1)]
    has_switches: bool = True
    """False: positions count from where the axis was at power-on."""
    zero_mm: PlaceMm | None = None
    """Position of the rig at the board's zero, which is at the reference switch if there is one."""
    speed_mm_s: Annotated[float, Field(gt=0.0, le=500.0)] = 50.0
    reversed: bool = False
    """Whether the motor counts positive to the rig's left."""

    @model_validator(mode="after")
    def _know_its_zero(self) -> "GrblRailConfig":
        if self.has_switches and self.zero_mm is None:
            raise ValueError(
                "zero_mm is missing: give the rig's position at the reference switch, or"
                " `has_switches = false`"
            )
        return self


RailConfig: TypeAlias = Annotated[GrblRailConfig | ManualRailConfig, Field(discriminator="kind")]


def _check_places(places: Sequence[RailPlaceTable], min_mm: float, max_mm: float) -> None:
    names = [place.name for place in places]
    for place in places:
        if names.count(place.name) > 1:
            raise ValueError(f"place {place.name!r} appears twice; give every place a name of its own")
        if not min_mm <= place.position_mm <= max_mm:
            raise ValueError(
                f"place {place.name!r} at {place.position_mm:g} mm lies outside {min_mm:g} to {max_mm:g} mm;"
                " move it, or widen the limits"
            )
