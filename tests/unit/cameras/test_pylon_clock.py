"""A Basler camera's clock: by either family's names, or not at all."""

from dataclasses import dataclass, field

import pytest

from foveacam_hardware.contract import VirtualClock
from foveacam_hardware.drivers.cameras.device import ClockReading
from foveacam_hardware.drivers.cameras.pylon.device import LATCHES, PylonClock
from foveacam_hardware.drivers.cameras.pylon.nodes import READ_WRITE, WRITE_ONLY

TRIP_NS = 300_000
TICK_NS = 8.0
START_NS = 5_000_000_000


@dataclass
class Camera:
    """A camera whose clock is the host's; a command takes a trip, and the library remembers what it read."""

    clock: VirtualClock
    has: tuple[str, ...]
    tick_ns: float = 1.0
    stands: bool = False
    latched_ns: int = 0
    remembered: dict[str, int] = field(default_factory=dict)

    def GetNode(self, name: str) -> "Node | None":  # noqa: N802 - the vendor's name
        return Node(self, name) if name in self.has else None

    def travel(self) -> None:
        self.clock.sleep_until_ns(self.clock.now_ns() + TRIP_NS // 2)


@dataclass
class Node:
    """A feature, or a command."""

    camera: Camera
    name: str

    @property
    def Node(self) -> "Node":  # noqa: N802 - the vendor's name
        return self

    def GetAccessMode(self) -> int:  # noqa: N802 - the vendor's name
        return WRITE_ONLY if self.name.endswith("Latch") else READ_WRITE

    def Execute(self) -> None:  # noqa: N802 - the vendor's name
        self.camera.travel()
        self.camera.latched_ns = 0 if self.camera.stands else self.camera.clock.now_ns()
        self.camera.travel()

    def InvalidateNode(self) -> None:  # noqa: N802 - the vendor's name
        self.camera.remembered.pop(self.name, None)

    def GetValue(self) -> int:  # noqa: N802 - the vendor's name
        return self.camera.remembered.setdefault(self.name, int(self.camera.latched_ns / self.camera.tick_ns))


def read(camera: Camera) -> ClockReading | None:
    return PylonClock(camera, clock=camera.clock, tick_ns=camera.tick_ns).read()


@pytest.mark.parametrize(("latch", "tick_ns"), [(LATCHES[0], 1.0), (LATCHES[1], TICK_NS)], ids=["new", "old"])
def test_the_time_was_taken_between_the_two_moments_that_are_told(
    latch: tuple[str, str], tick_ns: float
) -> None:
    reading = read(Camera(VirtualClock(START_NS), latch, tick_ns=tick_ns))

    assert reading is not None
    assert (reading.t_before_ns, reading.t_after_ns) == (START_NS, START_NS + TRIP_NS)
    assert reading.t_device_ns == pytest.approx(START_NS + TRIP_NS / 2, abs=tick_ns)


def test_every_reading_is_a_new_one() -> None:
    camera = Camera(VirtualClock(START_NS), LATCHES[0])
    clock = PylonClock(camera, clock=camera.clock, tick_ns=1.0)
    first, second = clock.read(), clock.read()

    assert first is not None
    assert second is not None
    assert second.t_device_ns == first.t_device_ns + TRIP_NS


@pytest.mark.parametrize("has", [(), LATCHES[0][:1], LATCHES[1][1:]])
def test_a_camera_without_the_command_or_the_value_has_no_readable_clock(has: tuple[str, ...]) -> None:
    assert read(Camera(VirtualClock(START_NS), has)) is None


def test_a_clock_that_stands_at_zero_is_none() -> None:
    assert read(Camera(VirtualClock(START_NS), LATCHES[1], stands=True)) is None
