"""The CRC on packets: asked for where the compiled firmware offers it, not mentioned to others."""

from collections.abc import Callable
from typing import cast

import pytest

from foveacam_hardware.contract import (
    DeviceFault,
    MirrorVolts,
    NotConnected,
    StereoVolts,
    Timeout,
    VirtualClock,
)
from foveacam_hardware.drivers.controller.crc_agreement import Crc
from foveacam_hardware.drivers.controller.guard import Care
from foveacam_hardware.drivers.controller.guardian import Guardian
from foveacam_hardware.drivers.controller.guardian_parking import park_and_disable
from foveacam_hardware.drivers.controller.mirrors import ControllerMirrors
from foveacam_hardware.sim.cables import RecordingCables
from foveacam_hardware.sim.far_ends.controller_far_end import ControllerFarEnd
from foveacam_hardware.sim.far_ends.line_faults import Damage, DamageKind, LineFaults
from foveacam_hardware.sim.far_ends.loopback import LoopbackController, LoopbackLink
from foveacam_hardware.wire.cobs import cobs_decode
from foveacam_hardware.wire.controller import BadPacket, Method, Packet, Property, decode_packet
from foveacam_hardware.wire.guardian import ParkingPlan
from foveacam_hardware.wire.open_file import OpenPort

from .firmware_board import GUARD, REST, START_US, FirmwareBoard, Item, stuffed
from .test_firmware_driver import ClockedBoard

ASIDE = StereoVolts(left=MirrorVolts(x_v=10.0, y_v=-20.0), right=MirrorVolts(x_v=-170.0, y_v=5.0))
QUICK = Care(answer_s=0.05, probe_s=0.04, crc=Crc.REQUIRE)
"""In one process an answer is there at once or never; on a busy machine it may seem lost: one asks again."""
GET_ENABLE = bytes.fromhex("04 16 14 02 01 00")


class DamagedBoard(ClockedBoard):
    """The firmware behind a line that has faults; `said`: by the host, `heard`: by it, undamaged."""

    def __init__(self, clock: VirtualClock) -> None:
        self.to_device, self.to_host = LineFaults(), LineFaults()
        self.said = self.heard = b""
        super().__init__(clock)

    def feed(self, data: bytes) -> None:
        self.said += data
        super().feed(self.to_device.apply(data))

    def take(self) -> bytes:
        data = super().take()
        self.heard += data
        return self.to_host.apply(data)


class OlderBoard(DamagedBoard):
    """A firmware with a guard from before the CRC: it does not know of item 9."""

    def feed(self, data: bytes) -> None:
        pieces = [cobs_decode(piece) or b"" for piece in data.split(b"\x00")[:-1]]
        super().feed(b"".join(stuffed(self._aged(piece)) for piece in pieces))

    def _aged(self, packet: bytes) -> bytes:
        about_check = packet[1] & 0xF == GUARD and packet[4] == Item.CHECK
        return packet[1:4] + b"\x0f" + packet[5:] if about_check else packet[1:]


class Rig:
    """The driver on the compiled firmware."""

    def __init__(
        self, care: Care | None = None, *, board: Callable[[VirtualClock], DamagedBoard] = DamagedBoard
    ) -> None:
        self.clock = VirtualClock(START_US * 1000)
        self.board = board(self.clock)
        self.mirrors = ControllerMirrors(self.open, self.clock, care=care)

    def open(self) -> LoopbackLink:
        # The link asks of a far end only what the board has as well.
        return LoopbackLink(cast(ControllerFarEnd, self.board), self.clock)


def packets(said: bytes, *, crc: bool) -> list[Packet]:
    return [decode_packet(cobs_decode(piece), crc=crc) for piece in said.split(b"\x00")[:-1]]


def test_where_the_firmware_offers_a_crc_every_packet_from_then_on_carries_one() -> None:
    rig = Rig()
    rig.mirrors.connect()
    at_connect, rig.board.said = rig.board.said, b""

    rig.mirrors.steer(ASIDE)
    receipt = rig.mirrors.expose(ASIDE, settle_us=1000, pulse_us=4000)

    assert rig.board.crc
    assert rig.mirrors.telemetry.crc
    assert receipt.volts == rig.mirrors.state.volts
    assert len(packets(rig.board.said, crc=True)) >= 3
    with pytest.raises(BadPacket, match="CRC"):
        packets(at_connect, crc=True)  # it had to be asked for without
    assert rig.board.item(Item.WRONG_CHECKS) == 0
    rig.mirrors.close()


def test_a_host_that_closes_leaves_a_controller_that_any_host_can_talk_to() -> None:
    rig = Rig()
    rig.mirrors.connect()
    rig.mirrors.close()
    rig.board.take()

    rig.board.feed(GET_ENABLE)

    assert [packet.payload for packet in rig.board.packets()] == [b"\x00"]


def test_where_it_is_forbidden_it_is_not_asked_for() -> None:
    rig = Rig(Care(crc=Crc.FORBID))
    rig.mirrors.connect()

    asked = [
        packet.payload[0] for packet in packets(rig.board.said, crc=False) if packet.prop is Property.GUARD
    ]
    assert Item.CHECK not in asked
    assert not rig.mirrors.telemetry.crc
    rig.mirrors.close()


@pytest.mark.parametrize("crc", [Crc.PREFER, Crc.FORBID])
def test_a_controller_in_the_field_hears_nothing_of_it(crc: Crc) -> None:
    controller = LoopbackController(VirtualClock(START_US * 1000), RecordingCables(), strict=True)
    mirrors = ControllerMirrors(controller.open, controller.clock, care=Care(crc=crc))

    mirrors.connect()

    heard = controller.far_end.packets_received
    assert not {Property.GUARD, Property.VOLTS} & {packet.prop for packet in heard}
    assert Method.NOP not in {packet.method for packet in heard}
    assert (mirrors.telemetry.crc, controller.status().malformed) == (False, 0)
    mirrors.close()


def test_where_it_is_required_a_controller_without_is_refused_with_its_rail_off() -> None:
    cables = RecordingCables()
    controller = LoopbackController(VirtualClock(START_US * 1000), cables)
    mirrors = ControllerMirrors(controller.open, controller.clock, care=Care(crc=Crc.REQUIRE))

    with pytest.raises(DeviceFault, match=r'requires a CRC .* it offers none .* write crc = "prefer"'):
        mirrors.connect()

    assert not mirrors.state.connected
    assert not cables.rail_on


@pytest.mark.parametrize("crc", [Crc.PREFER, Crc.REQUIRE])
def test_a_guard_from_before_the_crc_is_used_without_unless_it_is_required(crc: Crc) -> None:
    rig = Rig(Care(crc=crc), board=OlderBoard)

    if crc is Crc.REQUIRE:
        with pytest.raises(DeviceFault, match="it says 'Unknown setting'"):
            rig.mirrors.connect()
        return
    rig.mirrors.connect()

    assert rig.mirrors.state.guarded
    assert not rig.mirrors.telemetry.crc
    rig.mirrors.close()


def test_what_the_checksum_does_not_see_is_counted_told_and_the_mirrors_are_parked() -> None:
    rig = Rig()
    rig.mirrors.connect()
    rig.mirrors.steer(ASIDE)
    # The same bit of two bytes behind each other: of the time that the answer to a ping tells.
    rig.board.to_host.add(Damage(kind=DamageKind.CORRUPT, skip=5, count=2, value=0x40))

    with pytest.raises(Timeout, match="a packet was lost: the mirrors are parked"):
        rig.mirrors.ping()

    telemetry = rig.mirrors.telemetry
    assert (telemetry.crc_errors, telemetry.bad_packets, telemetry.lost_answers) == (1, 1, 1)
    assert rig.board.pins.codes == REST
    rig.mirrors.ping()
    assert rig.mirrors.telemetry.crc_errors == 1
    rig.mirrors.close()


def test_a_controller_that_restarted_and_forgot_the_crc_is_given_up_at_the_next_question() -> None:
    rig = Rig()
    rig.mirrors.connect()
    rig.board.power_cycle()

    with pytest.raises(NotConnected, match="restarted"):
        rig.mirrors.ping()

    assert "restarted" in (rig.mirrors.state.fault or "")
    rig.mirrors.connect()
    assert rig.mirrors.telemetry.crc
    rig.mirrors.close()


def asking_bytes(direction: str) -> range:
    """Return where the bytes lie, of those that pass at a connect, with which the CRC is agreed on."""
    passed = []
    for crc in (Crc.FORBID, Crc.PREFER):
        rig = Rig(Care(crc=crc))
        rig.mirrors.connect()
        passed.append(rig.board.said if direction == "device" else rig.board.heard)
        rig.mirrors.close()
    begin = next(at for at, (one, other) in enumerate(zip(*passed, strict=False)) if one != other)
    return range(begin, begin + 18)


@pytest.mark.parametrize("direction", ["device", "host"])
def test_whichever_byte_is_lost_while_it_is_agreed_on_it_is_agreed_on(direction: str) -> None:
    for skip in asking_bytes(direction)[::3]:
        rig = Rig(QUICK)
        line = rig.board.to_device if direction == "device" else rig.board.to_host
        line.add(Damage(kind=DamageKind.DROP, skip=skip))

        rig.mirrors.connect()

        assert not line.pending
        assert rig.mirrors.telemetry.crc
        assert rig.board.crc
        rig.mirrors.close()


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
        return self._board.take()

    def wait(self, duration_s: float) -> None:
        self._board.run_for(round(duration_s * 1e6))


@pytest.mark.parametrize("left", [b"", bytes.fromhex("04 13 12")], ids=["between packets", "in a packet"])
def test_the_guardian_of_a_dead_host_is_understood_though_packets_carry_a_crc(left: bytes) -> None:
    keeper = PlanKeeper()
    rig = Rig()
    care = Care(guardian=keeper)
    far_end = cast(ControllerFarEnd, rig.board)
    mirrors = ControllerMirrors(lambda: PortOf(far_end, rig.clock), rig.clock, care=care)
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
