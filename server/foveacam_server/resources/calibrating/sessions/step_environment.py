"""Environment of a calibration step: an exclusive rig, a watcher, and a calibration registry."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from typing import Protocol

from foveacam_hardware.contract import (
    Binning,
    Camera,
    CameraSettings,
    Clock,
    Head,
    InvalidInput,
    MarkerPrint,
    PanTilt,
    Role,
    Station,
    StationTarget,
)
from foveacam_hardware.rig import Rig
from foveacam_pipeline.calibrate.watcher import ProcedureWatcher, SilentWatcher
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.resources.calibrating.sessions.schema import EyeState
from foveacam_server.rig.settle_times import SettleTime, SettleTimes


@dataclass(frozen=True, slots=True, kw_only=True)
class ExclusiveRig:
    """A rig's devices, reserved for one step."""

    head: Head
    pan_tilt: PanTilt | None


class RigUse(Protocol):
    """Reserves the rig."""

    def __call__(self, what: str, *, binning: Binning | None = 1) -> AbstractContextManager[ExclusiveRig]:
        """Reserve the rig for one step, named for the operator, until the context ends.

        `binning`: of its frames; None: the rig's working binning.
        """
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class StepEnvironment:
    """A rig and its calibration stations.

    `wait_after_moves`: puts a measured settle time in use, now and at every start.
    """

    rig_id: str
    baseline_m: float
    stations: tuple[Station, ...]
    clock: Clock
    serials: Mapping[Role, str]
    fovea_settings: CameraSettings | None
    max_v: float
    markers: MarkerPrint
    use: RigUse
    wait_after_moves: Callable[[SettleTime], None]

    def station(self, name: str) -> Station:
        """Return a station by its name or raise `InvalidInput` with the known ones."""
        for station in self.stations:
            if station.name == name:
                return station
        known = ", ".join(repr(station.name) for station in self.stations) or "none"
        raise InvalidInput(
            f"there is no station {name!r}; this rig has {known}",
            asked=f"station {name!r}",
            found=f"the stations are {known}",
            remedy="choose one, or name them in the rig's file",
        )

    def stations_of(self, target: StationTarget) -> tuple[Station, ...]:
        """Return the stations with such a target or raise `InvalidInput` when there is none."""
        found = tuple(station for station in self.stations if station.target is target)
        if found:
            return found
        raise InvalidInput(
            f"calibration: this rig has no station with {target.value}",
            asked=f"a station with {target.value}",
            found=f"the stations are {', '.join(repr(s.name) for s in self.stations) or 'none'}",
            remedy="name one in the rig's file ([[pan_tilt.stations]]), or use the scene `calibration`",
        )

    def sweep_stations(self, names: Sequence[str] | None) -> tuple[Station, ...]:
        """Return the stations to sweep: those named, else all with markers, farthest first."""
        with_markers = marker_stations(self.stations)
        if names is None:
            return with_markers
        named = tuple(self.station(name) for name in names)
        for station in named:
            if station.target is not StationTarget.MARKERS:
                known = ", ".join(repr(other.name) for other in with_markers)
                raise InvalidInput(
                    f"station {station.name!r} has no markers, a sweep needs them",
                    asked=f"a sweep at {station.name!r}",
                    found="no markers",
                    remedy=f"choose among {known}",
                )
        return named


def marker_stations(stations: Sequence[Station]) -> tuple[Station, ...]:
    """Return the stations with markers: first those of unknown distance, then the farthest."""
    found = [station for station in stations if station.target is StationTarget.MARKERS]
    return tuple(sorted(found, key=lambda station: -(station.distance_m or math.inf)))


class StepWatcher(ProcedureWatcher, Protocol):
    """A procedure's watcher that also gets the results of each step."""

    def stage(self, name: str) -> None:
        """Report that the step `name` begins; its progress counts from zero."""
        ...

    def sample(self, sample_id: str) -> None:
        """Report a new view of the board."""
        ...

    def pose(self, station: str, *, index: int, left: EyeState, right: EyeState) -> None:
        """Report a measured pose and the state of either eye."""
        ...

    def fitted(self, calibration: Calibration) -> None:
        """Report a new calibration."""
        ...


class SilentStepWatcher(SilentWatcher):
    """A step watcher that ignores everything and never cancels."""

    def stage(self, name: str) -> None:
        """Ignore it."""

    def sample(self, sample_id: str) -> None:
        """Ignore it."""

    def pose(self, station: str, *, index: int, left: EyeState, right: EyeState) -> None:
        """Ignore it."""

    def fitted(self, calibration: Calibration) -> None:
        """Ignore it."""


class CalibrationRegistry(Protocol):
    """Stores calibrations and puts them in force."""

    def add(self, calibration: Calibration) -> None:
        """Store a new calibration."""
        ...

    def get(self, calibration_id: str) -> Calibration:
        """Return a calibration by its id."""
        ...

    def activate(self, calibration_id: str) -> Calibration:
        """Put a calibration in force."""
        ...


def environment_of(rig: Rig, times: SettleTimes | None = None) -> StepEnvironment:
    """Return the environment of steps on an opened, enabled rig; `times`: stores settle times put in use."""

    def wait_after_moves(time: SettleTime) -> None:
        if times is not None:
            times.store(time)
        rig.settle_us = time.settle_us

    @contextmanager
    def use(what: str, *, binning: Binning | None = 1) -> Iterator[ExclusiveRig]:
        with binned_cameras(rig, binning or rig.working_binning):
            yield ExclusiveRig(head=rig.head, pan_tilt=rig.pan_tilt)

    return StepEnvironment(
        rig_id=rig.rig_id,
        baseline_m=rig.baseline_m,
        stations=rig.stations,
        clock=rig.clock,
        serials={role: rig.camera(role).info.serial for role in Role},
        fovea_settings=rig.left.settings,
        max_v=rig.mirrors.limits.max_v,
        markers=rig.markers,
        use=use,
        wait_after_moves=wait_after_moves,
    )


@contextmanager
def binned_cameras(rig: Rig, binning: Binning) -> Iterator[None]:
    """Bin the frames of all cameras, and restore their binning afterwards."""
    cameras = [rig.camera(role) for role in Role]
    before = [camera.settings.binning for camera in cameras]
    try:
        for camera in cameras:
            _bin(camera, binning)
        yield
    finally:
        for camera, known in zip(cameras, before, strict=True):
            _bin(camera, known)


def _bin(camera: Camera, binning: Binning) -> None:
    if camera.settings.binning != binning:
        camera.configure(replace(camera.settings, binning=binning))
