"""The CRC on packets: asked for where the compiled firmware offers it, not mentioned to others."""

import pytest
from tests.support.devices.crc_rig import ASIDE, DamagedBoard, Rig
from tests.support.devices.firmware_board import GUARD, REST, START_US, Item, stuffed

from foveacam_hardware.contract import (
    DeviceFault,
    NotConnected,
    Timeout,
    VirtualClock,
)
from foveacam_hardware.drivers.controller.crc_agreement import Crc
from foveacam_hardware.drivers.controller.guard import LinkSupervision
from foveacam_hardware.drivers.controller.mirrors import ControllerMirrors
from foveacam_hardware.sim.cables import RecordingCables
from foveacam_hardware.sim.far_ends.controller_loopback import LoopbackController
from foveacam_hardware.sim.far_ends.line_faults import DamageKind, LineDamage
from foveacam_hardware.wire.cobs import cobs_decode
from foveacam_hardware.wire.controller import BadPacket, Packet, PacketMethod, PacketProperty, decode_packet

GET_ENABLE = bytes.fromhex("04 16 14 02 01 00")


class OlderBoard(DamagedBoard):
    """A firmware with a guard from before the CRC: it does not know of item 9."""

    def feed(self, data: bytes) -> None:
        pieces = [cobs_decode(piece) or b"" for piece in data.split(b"\x00")[:-1]]
        super().feed(b"".join(stuffed(self._aged(piece)) for piece in pieces))

    def _aged(self, packet: bytes) -> bytes:
        about_check = packet[1] & 0xF == GUARD and packet[4] == Item.CHECK
        return packet[1:4] + b"\x0f" + packet[5:] if about_check else packet[1:]


def packets(data: bytes, *, crc: bool) -> list[Packet]:
    return [decode_packet(cobs_decode(piece), crc=crc) for piece in data.split(b"\x00")[:-1]]


def test_where_the_firmware_offers_a_crc_every_packet_from_then_on_carries_one() -> None:
    rig = Rig()
    rig.mirrors.connect()
    at_connect, rig.board.sent = rig.board.sent, b""

    rig.mirrors.steer(ASIDE)
    receipt = rig.mirrors.expose(ASIDE, settle_us=1000, pulse_us=4000)

    assert rig.board.crc
    assert rig.mirrors.telemetry.crc
    assert receipt.volts == rig.mirrors.state.volts
    assert len(packets(rig.board.sent, crc=True)) >= 3
    with pytest.raises(BadPacket, match="CRC"):
        packets(at_connect, crc=True)  # it had to be asked for without
    assert rig.board.item(Item.WRONG_CHECKS) == 0
    rig.mirrors.close()


def test_a_host_that_closes_leaves_a_controller_that_any_host_can_talk_to() -> None:
    rig = Rig()
    rig.mirrors.connect()
    rig.mirrors.close()
    rig.board.take_output()

    rig.board.feed(GET_ENABLE)

    assert [packet.payload for packet in rig.board.packets()] == [b"\x00"]


def test_where_it_is_forbidden_it_is_not_asked_for() -> None:
    rig = Rig(LinkSupervision(crc=Crc.FORBID))
    rig.mirrors.connect()

    asked = [
        packet.payload[0]
        for packet in packets(rig.board.sent, crc=False)
        if packet.prop is PacketProperty.GUARD
    ]
    assert Item.CHECK not in asked
    assert not rig.mirrors.telemetry.crc
    rig.mirrors.close()


@pytest.mark.parametrize("crc", [Crc.PREFER, Crc.FORBID])
def test_a_controller_in_the_field_hears_nothing_of_it(crc: Crc) -> None:
    controller = LoopbackController(VirtualClock(START_US * 1000), RecordingCables(), strict=True)
    mirrors = ControllerMirrors(controller.open, controller.clock, supervision=LinkSupervision(crc=crc))

    mirrors.connect()

    received = controller.far_end.packets_received
    assert not {PacketProperty.GUARD, PacketProperty.VOLTS} & {packet.prop for packet in received}
    assert PacketMethod.NOP not in {packet.method for packet in received}
    assert (mirrors.telemetry.crc, controller.status().malformed) == (False, 0)
    mirrors.close()


def test_where_it_is_required_a_controller_without_is_refused_with_its_rail_off() -> None:
    cables = RecordingCables()
    controller = LoopbackController(VirtualClock(START_US * 1000), cables)
    mirrors = ControllerMirrors(
        controller.open, controller.clock, supervision=LinkSupervision(crc=Crc.REQUIRE)
    )

    with pytest.raises(DeviceFault, match=r'requires a CRC .* it offers none .* write crc = "prefer"'):
        mirrors.connect()

    assert not mirrors.state.connected
    assert not cables.rail_on


@pytest.mark.parametrize("crc", [Crc.PREFER, Crc.REQUIRE])
def test_a_guard_from_before_the_crc_is_used_without_unless_it_is_required(crc: Crc) -> None:
    rig = Rig(LinkSupervision(crc=crc), board=OlderBoard)

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
    rig.board.to_host.add(LineDamage(kind=DamageKind.CORRUPT, skip=5, count=2, value=0x40))

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
