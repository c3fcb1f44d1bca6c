"""A rig: opens the devices that a configuration names, reports what is missing, closes in reverse order.

The only module that names concrete drivers or the simulation, with `rig_cameras` for cameras, `rig_base` for
pan-tilt and rail, and `rig_replay` for recordings.
"""

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from types import TracebackType
from typing import TYPE_CHECKING, Protocol

from foveacam_hardware.contract import (
    Binning,
    Camera,
    Clock,
    FoveaError,
    Head,
    InvalidInput,
    MarkerPrint,
    MirrorLimits,
    Mirrors,
    MonotonicClock,
    PanTilt,
    Rail,
    RailPlace,
    Role,
    Station,
)
from foveacam_hardware.drivers.controller.crc_agreement import Crc
from foveacam_hardware.drivers.controller.guard import LinkSupervision
from foveacam_hardware.drivers.controller.guardian import Guardian
from foveacam_hardware.drivers.controller.mirrors import ControllerMirrors
from foveacam_hardware.drivers.triggered_head import TriggeredHead
from foveacam_hardware.rig_base import build_base
from foveacam_hardware.rig_cameras import build_camera
from foveacam_hardware.rig_config import RigConfig, SerialRigConfig, SimulatedRigConfig, load_rig_config
from foveacam_hardware.simulated_faults import FaultInjector
from foveacam_hardware.wire.controller import USB_PRODUCT_ID, USB_VENDOR_ID
from foveacam_hardware.wire.link import usb_link

if TYPE_CHECKING:  # importing the simulation compiles a renderer, which a hardware rig does not need
    from foveacam_hardware.sim.truth import Truth

__all__ = ["Closeable", "OpeningProblem", "Rig", "RigConfig", "RigName", "load_rig_config", "open_rig"]

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class OpeningProblem:
    """Why a device is not usable, for the operator, and the remedy where the device knows one."""

    device: str
    detail: str
    remedy: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RigName:
    """Identity of a rig; calibrations carry its `rig_id`."""

    rig_id: str
    name: str
    simulated: bool
    baseline_m: float
    scene: str | None = None


class Closeable(Protocol):
    """A resource that is released when the rig closes."""

    def close(self) -> None:
        """Release the resource; do nothing when it is already released."""
        ...


class OpeningWatch(Protocol):
    """Observer that is notified as each device of a rig is opened."""

    def begins(self, device: str) -> None:
        """Record that a device is being opened."""
        ...

    def ends(self, device: str, problem: OpeningProblem | None) -> None:
        """Record that a device is open, or why it is not."""
        ...


class SettlingHead(Head, Protocol):
    """A head that waits after every move; `settle_us`: default settling time of a look."""

    settle_us: int


class Rig:
    """Three cameras, two mirrors, their head, and optionally a pan-tilt and a rail; owned by one thread.

    `connect` may be called again at any time: it opens the devices that are not open yet.
    """

    def __init__(
        self,
        identity: RigName,
        *,
        clock: Clock,
        mirrors: Mirrors,
        cameras: tuple[Camera, Camera, Camera],
        head: SettlingHead,
    ) -> None:
        self.rig_id = identity.rig_id
        self.name = identity.name
        self.simulated = identity.simulated
        self.scene = identity.scene
        self.baseline_m = identity.baseline_m
        self.clock = clock
        self.mirrors = mirrors
        self.wide, self.left, self.right = cameras
        self.head = head
        self.pan_tilt: PanTilt | None = None
        """Turns the whole rig; None when there is no pan-tilt."""
        self.stations: tuple[Station, ...] = ()
        """Bearings at which the rig is calibrated; may be empty."""
        self.markers = MarkerPrint()
        """Dimensions and ids of the printed calibration markers."""
        self.rail: Rail | None = None
        """Moves the whole rig sideways; None when there is no rail."""
        self.rail_places: tuple[RailPlace, ...] = ()
        """Named positions on the rail."""
        self.breakable: FaultInjector | None = None
        """Injects faults into a simulated rig; None for a hardware rig."""
        self.truth: Truth | None = None
        self.replayed = False
        """Whether it plays a recording: nothing moves, and looks return what was recorded."""
        self.working_binning: Binning = 1
        """Binning of all three cameras for looks, following and live views; set by the code that needs it."""
        self.problems: tuple[OpeningProblem, ...] = ()
        self._owned: list[Closeable] = []

    @property
    def settle_us(self) -> int:
        """Default wait of a look between its move and its exposure."""
        return self.head.settle_us

    @settle_us.setter
    def settle_us(self, settle_us: int) -> None:
        if settle_us < 0:
            raise InvalidInput(f"settle time {settle_us} µs: give 0 or more")
        self.head.settle_us = settle_us

    def own(self, resources: Sequence[Closeable]) -> None:
        """Take over resources that were opened before the devices; they are closed after them."""
        self._owned.extend(resources)

    @property
    def cameras(self) -> tuple[Camera, Camera, Camera]:
        """The cameras in the order wide, left, right."""
        return self.wide, self.left, self.right

    def camera(self, role: Role) -> Camera:
        """Return the camera of a role."""
        return {Role.WIDE: self.wide, Role.LEFT: self.left, Role.RIGHT: self.right}[role]

    def connect(self, *, watch: OpeningWatch | None = None) -> tuple[OpeningProblem, ...]:
        """Open every device; return the problems of those that failed to open, without raising."""
        problems = []
        for name, connect in self._connections():
            if watch is not None:
                watch.begins(name)
            problem = _problem_of(name, connect)
            if watch is not None:
                watch.ends(name, problem)
            if problem is not None:
                problems.append(problem)
        self.problems = tuple(problems)
        return self.problems

    def _connections(self) -> list[tuple[str, Callable[[], None]]]:
        """Return the name and the opening call of each device, in the order of opening."""
        cameras = [(str(camera.role), partial(_start, camera)) for camera in self.cameras]
        return [
            ("mirrors", self.mirrors.connect),
            *cameras,
            *((name, device.connect) for name, device in self._base),
        ]

    def close(self) -> None:
        """Release everything in reverse order; pan-tilt and rail stop, the mirrors are parked."""
        devices: list[tuple[str, Closeable]] = [*reversed(self._base)]
        devices.extend((str(camera.role), camera) for camera in reversed(self.cameras))
        devices.append(("mirrors", self.mirrors))
        devices.extend(("resource", owned) for owned in reversed(self._owned))
        self._owned.clear()
        for name, device in devices:
            try:
                device.close()
            except FoveaError as error:
                logger.warning("closing %s: %s", name, error)

    @property
    def _base(self) -> list[tuple[str, PanTilt | Rail]]:
        """Pan-tilt and rail by name, where the rig has them."""
        devices = (("pan_tilt", self.pan_tilt), ("rail", self.rail))
        return [(name, device) for name, device in devices if device is not None]

    def __enter__(self) -> "Rig":
        self.connect()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _start(camera: Camera) -> None:
    camera.connect()
    camera.start()


def _problem_of(name: str, connect: Callable[[], None]) -> OpeningProblem | None:
    """Open a device; return why it could not be opened."""
    try:
        connect()
    except FoveaError as error:
        return OpeningProblem(device=name, detail=str(error), remedy=error.remedy)
    return None


def open_rig(
    config: SimulatedRigConfig | SerialRigConfig, *, clock: Clock | None = None, guarded: bool = False
) -> Rig:
    """Return the rig that a configuration describes, not yet connected.

    `guarded`: a guardian process parks the mirrors of a hardware rig when this process is killed.
    """
    if isinstance(config, SimulatedRigConfig):
        from foveacam_hardware.sim.rig import simulated_rig

        return simulated_rig(config, clock=clock)
    supervision = LinkSupervision(guardian=Guardian() if guarded else None, crc=Crc(config.mirrors.crc))
    return _serial_rig(config, clock or MonotonicClock(), supervision)


def _serial_rig(config: SerialRigConfig, clock: Clock, supervision: LinkSupervision) -> Rig:
    given = config.mirrors
    mirrors = ControllerMirrors(
        usb_link(given.port, usb_id=(USB_VENDOR_ID, USB_PRODUCT_ID)),
        clock,
        MirrorLimits(max_v=given.max_v, bias_v=given.bias_v),
        given.low_pass_hz,
        name=given.port,
        supervision=supervision,
    )
    wide = build_camera(Role.WIDE, config.cameras.wide, clock=clock)
    left = build_camera(Role.LEFT, config.cameras.left, clock=clock)
    right = build_camera(Role.RIGHT, config.cameras.right, clock=clock)
    head = TriggeredHead(
        mirrors, left, right, wide, clock=clock, settle_us=given.settle_us, pulse_us=given.pulse_us
    )
    identity = RigName(rig_id=config.rig_id, name=config.name, simulated=False, baseline_m=config.baseline_m)
    rig = Rig(identity, clock=clock, mirrors=mirrors, cameras=(wide, left, right), head=head)
    base = build_base(config, clock)
    rig.pan_tilt, rig.stations = base.pan_tilt, base.stations
    rig.rail, rig.rail_places = base.rail, base.places
    rig.markers = config.markers.printed
    rig.working_binning = config.working_binning
    return rig
