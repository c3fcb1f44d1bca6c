"""What goes wrong while packets carry a CRC: bytes that are lost, and a host that dies."""

from typing import cast

import pytest
from tests.support.devices.crc_rig import ASIDE, Rig
from tests.support.devices.firmware_board import REST, FirmwareBoard
from tests.wire.firmware.test_firmware_driver import axes_v, differences

from foveacam_hardware.contract import PARKED, DeviceFault, NotConnected, Timeout
from foveacam_hardware.drivers.controller.crc_agreement import Crc
from foveacam_hardware.drivers.controller.guard import LinkSupervision
from foveacam_hardware.drivers.controller.guardian import Guardian
from foveacam_hardware.drivers.controller.guardian_parking import park_and_disable
from foveacam_hardware.drivers.controller.mirrors import ControllerMirrors
from foveacam_hardware.sim.far_ends.controller_far_end import ControllerFarEnd
from foveacam_hardware.sim.far_ends.controller_loopback import LoopbackLink
from foveacam_hardware.sim.far_ends.line_faults import DamageKind, LineDamage
from foveacam_hardware.wire.guardian import ParkingPlan
from foveacam_hardware.wire.open_file import OpenPort

REQUIRED = LinkSupervision(crc=Crc.REQUIRE)


def asking_bytes(direction: str) -> range:
    """Return where the bytes lie, of those that pass at a connect, with which the CRC is agreed on."""
    passed = []
    for crc in (Crc.FORBID, Crc.PREFER):
        rig = Rig(LinkSupervision(crc=crc))
        rig.mirrors.connect()
        passed.append(rig.board.sent if direction == "device" else rig.board.received)
        rig.mirrors.close()
    begin = next(at for at, (one, other) in enumerate(zip(*passed, strict=False)) if one != other)
    return range(begin, begin + 18)


@pytest.mark.parametrize("direction", ["device", "host"])
def test_whichever_byte_is_lost_while_it_is_agreed_on_it_is_agreed_on(direction: str) -> None:
    for skip in asking_bytes(direction)[::3]:
        rig = Rig(REQUIRED)
        line = rig.board.to_device if direction == "device" else rig.board.to_host
        line.add(LineDamage(kind=DamageKind.DROP, skip=skip))

        rig.mirrors.connect()

        assert not line.pending
        assert rig.mirrors.telemetry.crc
        assert rig.board.crc
        rig.mirrors.close()


def session(rig: Rig) -> None:
    """Connect, steer, expose, park, close; after each step the firmware is as the host believes."""
    rig.mirrors.connect()
    rig.mirrors.enable()
    for volts in (ASIDE, PARKED):
        actual = rig.mirrors.steer(volts)
        rig.mirrors.ping()
        assert rig.mirrors.state.volts == actual
        assert differences(rig.board.pins.codes) == pytest.approx(axes_v(actual), abs=1e-9)
    assert rig.mirrors.expose(ASIDE, settle_us=2000, pulse_us=4000).volts == rig.mirrors.state.volts
    rig.mirrors.park()
    rig.mirrors.ping()
    assert rig.board.pins.codes == REST
    rig.mirrors.close()
    assert not rig.board.pins.rail_on


@pytest.mark.parametrize("direction", ["device", "host"])
def test_with_a_crc_too_a_lost_byte_is_absorbed_or_told_and_a_session_works_again(direction: str) -> None:
    whole = Rig(REQUIRED)
    session(whole)
    size = len(whole.board.sent if direction == "device" else whole.board.received)
    for skip in range(0, size, 23):
        rig = Rig(REQUIRED)
        line = rig.board.to_device if direction == "device" else rig.board.to_host
        line.add(LineDamage(kind=DamageKind.DROP, skip=skip))
        try:
            session(rig)
        except (Timeout, NotConnected, DeviceFault):
            state = rig.mirrors.state
            assert not state.connected or state.volts == PARKED
            assert state.enabled == (state.connected and rig.board.pins.rail_on)
        assert not line.pending
        session(rig)


class PlanKeeper(Guardian):
    """A guardian that only remembers what it was told."""

    plan: ParkingPlan | None = None

    def guard(self, file: int, plan: ParkingPlan) -> None:
        self.plan = plan


class PortOf(LoopbackLink):
    """A link that says it has a port, to be handed over."""

    @property
    def file(self) -> int:
        return 0


class BoardPort:
    """What the guardian sees of a port: the firmware behind it."""

    def __init__(self, board: FirmwareBoard) -> None:
        self._board = board

    def write(self, data: bytes) -> None:
        self._board.feed(data)
        self._board.finish()

    def read(self, timeout_s: float) -> bytes:
        return self._board.take_output()

    def wait(self, duration_s: float) -> None:
        self._board.run_for(round(duration_s * 1e6))


@pytest.mark.parametrize("left", [b"", bytes.fromhex("04 13 12")], ids=["between packets", "in a packet"])
def test_the_guardian_of_a_dead_host_is_understood_though_packets_carry_a_crc(left: bytes) -> None:
    keeper = PlanKeeper()
    rig = Rig()
    supervision = LinkSupervision(guardian=keeper)
    far_end = cast(ControllerFarEnd, rig.board)
    mirrors = ControllerMirrors(lambda: PortOf(far_end, rig.clock), rig.clock, supervision=supervision)
    mirrors.connect()
    mirrors.steer(ASIDE)
    assert rig.board.crc
    assert keeper.plan is not None
    rig.board.feed(left)  # the last that the host said

    parking = park_and_disable(cast(OpenPort, BoardPort(rig.board)), keeper.plan)

    assert parking.rail_off
    assert rig.board.pins.codes == REST
    assert not rig.board.pins.rail_on
    assert rig.board.pins.rails[-1][0] - rig.board.pins.drives[-1][0] >= keeper.plan.settle_ms * 1000
    mirrors.close()
