"""A rig as one thing: opens what a configuration names, says what is missing, closes last opened first.

The only module that names concrete drivers or the simulation.
"""

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING, Protocol

from foveacam_hardware.contract import (
    Camera,
    Clock,
    FoveaError,
    Head,
    MirrorLimits,
    Mirrors,
    MonotonicClock,
    PanTilt,
    Role,
    Station,
)
from foveacam_hardware.drivers.absent_camera import AbsentCamera
from foveacam_hardware.drivers.controller import ControllerMirrors
from foveacam_hardware.drivers.grbl import GrblPanTilt
from foveacam_hardware.drivers.grbl_axes import GrblMounting
from foveacam_hardware.drivers.manual_pan_tilt import ManualPanTilt
from foveacam_hardware.drivers.triggered_head import TriggeredHead
from foveacam_hardware.pan_tilt_config import GrblPanTiltConfig, ManualPanTiltConfig
from foveacam_hardware.rig_config import RigConfig, SerialRigConfig, SimulatedRigConfig, load_rig_config
from foveacam_hardware.wire.link import serial_link

if TYPE_CHECKING:  # the simulation compiles a renderer: a rig of metal does without
    from foveacam_hardware.sim.truth import Truth

__all__ = ["Closing", "Problem", "Rig", "RigConfig", "RigName", "load_rig_config", "open_rig"]

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """Why a device is not usable, in words for the operator."""

    device: str
    detail: str


@dataclass(frozen=True, slots=True, kw_only=True)
class RigName:
    """Which rig it is; calibrations carry its id."""

    rig_id: str
    name: str
    simulated: bool
    baseline_m: float
    scene: str | None = None


class Closing(Protocol):
    """Anything that is released at the end."""

    def close(self) -> None:
        """Release it; harmless when released."""
        ...


class Rig:
    """Three cameras, a pair of mirrors, the head that they make, and what turns it; one thread owns it.

    `connect` may be called again at any time: it opens what is not open yet.
    """

    def __init__(
        self,
        who: RigName,
        *,
        clock: Clock,
        mirrors: Mirrors,
        cameras: tuple[Camera, Camera, Camera],
        head: Head,
    ) -> None:
        self.rig_id = who.rig_id
        self.name = who.name
        self.simulated = who.simulated
        self.scene = who.scene
        self.baseline_m = who.baseline_m
        self.clock = clock
        self.mirrors = mirrors
        self.wide, self.left, self.right = cameras
        self.head = head
        self.pan_tilt: PanTilt | None = None
        """What turns the whole rig; None when nothing does."""
        self.stations: tuple[Station, ...] = ()
        """Where the pan-tilt must point to calibrate here; may be empty."""
        self.truth: Truth | None = None
        self.problems: tuple[Problem, ...] = ()
        self._owned: list[Closing] = []

    def own(self, resources: Sequence[Closing]) -> None:
        """Take resources that were opened before the devices, to be closed after them."""
        self._owned.extend(resources)

    @property
    def cameras(self) -> tuple[Camera, Camera, Camera]:
        """Wide, left, right."""
        return self.wide, self.left, self.right

    def camera(self, role: Role) -> Camera:
        """Return the camera of an eye."""
        return {Role.WIDE: self.wide, Role.LEFT: self.left, Role.RIGHT: self.right}[role]

    def connect(self) -> tuple[Problem, ...]:
        """Open every device; return what is wrong with those that would not open. Never raises for them."""
        problems = []
        try:
            self.mirrors.connect()
        except FoveaError as error:
            problems.append(Problem(device="mirrors", detail=str(error)))
        for camera in self.cameras:
            try:
                camera.connect()
                camera.start()
            except FoveaError as error:
                problems.append(Problem(device=str(camera.role), detail=str(error)))
        if self.pan_tilt is not None:
            try:
                self.pan_tilt.connect()
            except FoveaError as error:
                problems.append(Problem(device="pan_tilt", detail=str(error)))
        self.problems = tuple(problems)
        return self.problems

    def close(self) -> None:
        """Release everything, last opened first; the pan-tilt is held, the mirrors are parked."""
        devices: list[tuple[str, Closing]] = [] if self.pan_tilt is None else [("pan_tilt", self.pan_tilt)]
        devices.extend((str(camera.role), camera) for camera in reversed(self.cameras))
        devices.append(("mirrors", self.mirrors))
        devices.extend(("resource", owned) for owned in reversed(self._owned))
        self._owned.clear()
        for name, device in devices:
            try:
                device.close()
            except FoveaError as error:
                logger.warning("closing %s: %s", name, error)

    def __enter__(self) -> "Rig":
        self.connect()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def open_rig(config: SimulatedRigConfig | SerialRigConfig, *, clock: Clock | None = None) -> Rig:
    """Return the rig that a configuration names, not yet connected."""
    if isinstance(config, SimulatedRigConfig):
        from foveacam_hardware.sim.rig import simulated_rig

        return simulated_rig(config, clock=clock)
    return _serial_rig(config, clock or MonotonicClock())


def _serial_rig(config: SerialRigConfig, clock: Clock) -> Rig:
    given = config.mirrors
    mirrors = ControllerMirrors(
        serial_link(given.port),
        clock,
        MirrorLimits(max_v=given.max_v, bias_v=given.bias_v),
        given.low_pass_hz,
        name=given.port,
    )
    reason = "the rig file names none; this version drives cameras of the simulated rig alone"
    wide, left, right = (AbsentCamera(role, reason=reason) for role in (Role.WIDE, Role.LEFT, Role.RIGHT))
    head = TriggeredHead(
        mirrors, left, right, wide, clock=clock, settle_us=given.settle_us, pulse_us=given.pulse_us
    )
    who = RigName(rig_id=config.rig_id, name=config.name, simulated=False, baseline_m=config.baseline_m)
    rig = Rig(who, clock=clock, mirrors=mirrors, cameras=(wide, left, right), head=head)
    if config.pan_tilt is not None:
        rig.pan_tilt = _pan_tilt(config.pan_tilt, clock)
        rig.stations = tuple(table.station() for table in config.pan_tilt.stations)
    return rig


def _pan_tilt(config: GrblPanTiltConfig | ManualPanTiltConfig, clock: Clock) -> PanTilt:
    if isinstance(config, ManualPanTiltConfig):
        return ManualPanTilt()
    mounting = GrblMounting(
        zero=config.zero,
        speed_rad_s=math.radians(config.speed_deg_s),
        has_switches=config.has_switches,
    )
    return GrblPanTilt(
        serial_link(config.port), clock, limits=config.limits, name=config.port, mounting=mounting
    )
