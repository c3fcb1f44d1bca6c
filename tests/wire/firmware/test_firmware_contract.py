"""The whole Mirrors contract on the compiled firmware: the suite of tests/contract, this far end under it."""

from collections.abc import Iterator
from dataclasses import replace
from typing import cast

import pytest
from tests.contract import test_mirrors as contract
from tests.support.devices.firmware_board import FirmwareBoard, Item, Kind
from tests.support.devices.mirror_benches import Bench, Make

from foveacam_hardware.contract import VirtualClock
from foveacam_hardware.sim.cables import CAMERA_ROLES, RecordingCables, TriggerEdge
from foveacam_hardware.sim.far_ends.controller_far_end import ControllerFarEnd
from foveacam_hardware.sim.far_ends.controller_loopback import LoopbackController, LoopbackLink
from foveacam_hardware.sim.far_ends.side_channel import ControllerStatus

START_NS = 1_000_000_000


class CabledBoard(FirmwareBoard):
    """A board that follows a clock, strobes as cables say, and tells them what it does."""

    def __init__(self, clock: VirtualClock, cables: RecordingCables) -> None:
        self._clock = clock
        self._cables = cables
        self._forwarded = dict.fromkeys(("drives", "rails", "clocks", "triggers"), 0)
        super().__init__(now_us=clock.now_ns() // 1000)

    def feed(self, data: bytes) -> None:
        self.advance(self._clock.now_ns())
        for camera, role in enumerate(CAMERA_ROLES.values()):
            self.strobe(camera, self._cables.exposure_us[role])
        super().feed(data)

    def _collect(self) -> None:
        super()._collect()
        self._forward_drives()
        for t_us, on in self._new(Kind.RAIL):
            if bool(on) != self._cables.rail_on:
                self._cables.set_rail(t_us * 1000, on=bool(on))
        for t_us, clock_hz in self._new(Kind.CLOCK):
            if clock_hz // 60 != self._cables.cutoff_hz:
                self._cables.set_low_pass(t_us * 1000, clock_hz // 60)
        for t_us, high in self._new(Kind.TRIGGERS):
            self._forward_triggers(t_us, high)

    def _new(self, kind: Kind) -> list[tuple[int, int]]:
        name = kind.name.lower() + ("s" if kind in (Kind.RAIL, Kind.CLOCK) else "")
        events = cast(list[tuple[int, int]], getattr(self.pins, name))
        forwarded, self._forwarded[name] = self._forwarded[name], len(events)
        return events[forwarded:]

    def _forward_drives(self) -> None:
        final = dict(self.pins.drives[self._forwarded["drives"] :])  # of one moment, what stands in the end
        self._forwarded["drives"] = len(self.pins.drives)
        for t_us, codes in final.items():
            if codes != self._cables.codes:
                self._cables.set_codes(t_us * 1000, codes)

    def _forward_triggers(self, t_us: int, high: int) -> None:
        edges = self._cables.triggers
        if high:
            edges.append(TriggerEdge(t_ns=t_us * 1000, pulse_us=0, cameras=high))
        elif edges and edges[-1].pulse_us == 0:
            edges[-1] = replace(edges[-1], pulse_us=t_us - edges[-1].t_ns // 1000)


class FirmwareController:
    """A controller as the contract's suite wants it."""

    def __init__(self, clock: VirtualClock, cables: RecordingCables) -> None:
        self._clock = clock
        self._cables = cables
        self._board = CabledBoard(clock, cables)

    def open(self) -> LoopbackLink:
        # The link asks of a far end only what the board has as well.
        return LoopbackLink(cast(ControllerFarEnd, self._board), self._clock)

    def status(self) -> ControllerStatus:
        board = self._board
        return ControllerStatus(dead=False, enabled=board.pins.rail_on, malformed=board.item(Item.MALFORMED))

    def power_cycle(self) -> None:
        self._board.power_cycle()


@pytest.fixture
def make() -> Iterator[Make]:
    benches: list[Bench] = []

    def build(version: tuple[int, int, int]) -> Bench:
        if version != (2, 1, 0):
            pytest.skip("this firmware is 2.1.0")
        clock, cables = VirtualClock(START_NS), RecordingCables()
        controller = cast(LoopbackController, FirmwareController(clock, cables))  # what the suite asks of it
        benches.append(Bench(controller, cables, clock))
        return benches[-1]

    yield build
    for bench in benches:
        bench.mirrors.close()


bench = contract.bench
LEFT_OUT = {
    "test_telemetry_counts_the_traffic",  # it counts packets, and a guarded firmware is sent some more
    "test_a_second_driver_is_told_that_the_port_is_held",  # it brings a far end of its own
}
globals().update(
    {name: test for name, test in vars(contract).items() if name.startswith("test_") and name not in LEFT_OUT}
)


def test_the_suite_is_there() -> None:
    assert {"test_expose_moves_settles_and_triggers", *LEFT_OUT} <= set(vars(contract))
