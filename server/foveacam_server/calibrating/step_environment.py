"""What a step of a calibration works with: a rig for a while, who watches, and where results go."""

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Protocol

from foveacam_hardware.contract import (
    CameraSettings,
    Clock,
    Head,
    InvalidInput,
    MarkerPrint,
    NotConnected,
    PanTilt,
    Role,
    Station,
    StationTarget,
)
from foveacam_pipeline.calibrate.watcher import ProcedureWatcher
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.calibrating.settle_times import SettleTime


@dataclass(frozen=True, slots=True, kw_only=True)
class ExclusiveRig:
    """A rig that nobody else uses for the moment."""

    head: Head
    pan_tilt: PanTilt | None


@dataclass(frozen=True, slots=True, kw_only=True)
class StepEnvironment:
    """A rig and its room.

    `use`: gives the rig to one step, named for people, until the context ends. `wait_after_moves`: puts a
    measured settle time in use, now and at every start.
    """

    rig_id: str
    baseline_m: float
    stations: tuple[Station, ...]
    clock: Clock
    serials: Mapping[Role, str]
    fovea_settings: CameraSettings | None
    max_v: float
    markers: MarkerPrint
    use: Callable[[str], AbstractContextManager[ExclusiveRig]]
    wait_after_moves: Callable[[SettleTime], None]

    def station(self, name: str) -> Station:
        """Return a station by its name or raise `InvalidInput` that lists them."""
        for station in self.stations:
            if station.name == name:
                return station
        known = ", ".join(repr(station.name) for station in self.stations) or "none"
        raise InvalidInput(
            f"there is no station {name!r}; this rig has {known}; choose one, or name them in the rig's file",
            asked=f"station {name!r}",
            found=f"the stations are {known}",
            remedy="choose one, or name them in the rig's file",
        )

    def stations_of(self, target: StationTarget) -> tuple[Station, ...]:
        """Return where such a target stands, or raise `InvalidInput` when it stands nowhere."""
        found = tuple(station for station in self.stations if station.target is target)
        if found:
            return found
        remedy = "name one in the rig's file ([[pan_tilt.stations]]), or use the scene `calibration`"
        raise InvalidInput(
            f"calibration: this rig has no station with {target.value}; {remedy}",
            asked=f"a station with {target.value}",
            found=f"the stations are {', '.join(repr(s.name) for s in self.stations) or 'none'}",
            remedy=remedy,
        )

    def sweep_stations(self, names: Sequence[str] | None) -> tuple[Station, ...]:
        """Return where to sweep: the stations named, else all with markers, the farthest first."""
        there = self.stations_of(StationTarget.MARKERS)
        if names is None:
            return tuple(sorted(there, key=lambda station: -(station.distance_m or math.inf)))
        named = tuple(self.station(name) for name in names)
        for station in named:
            if station.target is not StationTarget.MARKERS:
                known = ", ".join(repr(other.name) for other in there)
                raise InvalidInput(
                    f"station {station.name!r} has no markers, a sweep needs them; choose among {known}",
                    asked=f"a sweep at {station.name!r}",
                    found="no markers",
                    remedy=f"choose among {known}",
                )
        return named


class StepWatcher(ProcedureWatcher, Protocol):
    """A watcher who also hears what each step has brought."""

    def stage(self, name: str) -> None:
        """Take note that the step `name` begins; its progress counts from zero."""
        ...

    def sample(self, sample_id: str) -> None:
        """Take note of a new view of the board."""
        ...

    def pose(self, station: str, *, index: int, left: str, right: str) -> None:
        """Take note of a pose that was measured, and what became of either eye."""
        ...

    def fitted(self, calibration: Calibration) -> None:
        """Take note of a new calibration."""
        ...


class CalibrationRegistry(Protocol):
    """The calibrations of the rig."""

    def add(self, calibration: Calibration) -> None:
        """Keep a new one."""
        ...

    def get(self, calibration_id: str) -> Calibration:
        """Return one by its id."""
        ...

    def activate(self, calibration_id: str) -> Calibration:
        """Put one in force."""
        ...


def no_pan_tilt(asked: str) -> NotConnected:
    """Return the refusal of a rig on a fixed base."""
    remedy = "name one in the rig's file ([pan_tilt], kind grbl or manual)"
    return NotConnected(
        f"asked to {asked}: this rig has no pan-tilt; {remedy}",
        asked=asked,
        found="no pan-tilt",
        remedy=remedy,
    )
