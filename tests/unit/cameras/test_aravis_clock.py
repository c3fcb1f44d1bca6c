"""The camera's clock: by its latch feature, by GigE Vision's registers, or not at all."""

from dataclasses import dataclass, field

import pytest

from foveacam_hardware.contract import VirtualClock
from foveacam_hardware.drivers.cameras.aravis.clock import (
    LATCH,
    LATCH_FEATURE,
    LATCH_NOW,
    LATCHED_FEATURE,
    LATCHED_HIGH,
    LATCHED_LOW,
    TICKS_HIGH,
    TICKS_LOW,
    AravisClock,
)

TRIP_NS = 400_000
TICKS_PER_S = 125_000_000


@dataclass
class Camera:
    """A camera whose clock is the host's; every access takes a trip."""

    clock: VirtualClock
    has_registers: bool = True
    features: tuple[str, ...] = ()
    keeps_time: bool = True
    registers: dict[int, int] = field(default_factory=dict)
    latched_ns: int = 0

    def has(self, feature: str) -> bool:
        return feature in self.features

    def execute(self, command: str) -> None:
        assert command == LATCH_FEATURE
        self._latch()

    def integer(self, feature: str) -> int:
        assert feature == LATCHED_FEATURE
        self._travel(1.0)
        return self.latched_ns

    def read_register(self, address: int) -> int:
        self._travel(1.0)
        ticks = self.latched_ns * TICKS_PER_S // 1_000_000_000
        return {
            TICKS_HIGH: 0,
            TICKS_LOW: TICKS_PER_S if self.keeps_time else 0,
            LATCHED_HIGH: ticks >> 32,
            LATCHED_LOW: ticks & 0xFFFF_FFFF,
        }[address]

    def write_register(self, address: int, value: int) -> None:
        assert (address, value) == (LATCH, LATCH_NOW)
        self._latch()

    def _latch(self) -> None:
        self._travel(0.5)
        self.latched_ns = self.clock.now_ns() if self.keeps_time else 0
        self._travel(0.5)

    def _travel(self, trips: float) -> None:
        self.clock.sleep_until_ns(self.clock.now_ns() + round(trips * TRIP_NS))


@pytest.mark.parametrize("features", [(), (LATCH_FEATURE, LATCHED_FEATURE)], ids=["registers", "features"])
def test_a_reading_is_of_the_moment_in_the_middle_of_its_trip(features: tuple[str, ...]) -> None:
    clock = VirtualClock(40_000_000_000)  # 40 s: more than 32 bits of ticks
    reading = AravisClock(Camera(clock, features=features), clock=clock).read()

    assert reading is not None
    assert reading.t_after_ns - reading.t_before_ns == TRIP_NS
    assert reading.t_device_ns == pytest.approx(reading.t_before_ns + TRIP_NS // 2, abs=8)  # one tick


@pytest.mark.parametrize(
    "camera",
    [
        Camera(VirtualClock(), has_registers=False),
        Camera(VirtualClock(), keeps_time=False),
        Camera(VirtualClock(), features=(LATCH_FEATURE, LATCHED_FEATURE), keeps_time=False),
    ],
    ids=["no registers", "no ticks", "no time"],
)
def test_a_camera_that_keeps_no_time_says_so(camera: Camera) -> None:
    assert AravisClock(camera, clock=camera.clock).read() is None
