"""What the firmware adds: watchdog, settings, boot id, CRC."""

import binascii
import functools
from operator import xor

import pytest
from tests.support.devices.firmware_board import REST, START_US, FirmwareBoard, Item

from foveacam_hardware.wire.cobs import CobsDecoder, cobs_encode
from foveacam_hardware.wire.controller import (
    Packet,
    PacketMethod,
    PacketProperty,
    decode_packet,
    encode_packet,
)
from foveacam_hardware.wire.controller_payloads import ActuateCommand, FrameRequest, StreamCommand, pack_u32

ASIDE = (57_343, 1638, 20_000, 39_000)
"""170 V on x, less on y."""
DISABLED = "Cannot perform action: system is not enabled"


def stream(operation: int, number: int, left: tuple[int, int, int, int] = ASIDE) -> bytes:
    return StreamCommand(operation=operation, stream=number, left=left, right=left[::-1]).pack()


@pytest.fixture
def board() -> FirmwareBoard:
    """An enabled controller, mirrors far aside."""
    board = FirmwareBoard()
    board.enable()
    (reply,) = board.ask(PacketMethod.SET, PacketProperty.STREAM, stream(0, 0))
    assert reply.method is PacketMethod.ACK
    return board


def texts(packets: list[Packet]) -> list[str]:
    return [
        packet.payload.decode() for packet in packets if packet.method in (PacketMethod.REJ, PacketMethod.SYN)
    ]


def test_silence_slews_both_mirrors_to_the_bias_and_then_switches_the_rail_off(board: FirmwareBoard) -> None:
    fed_us, steps = board.now_us, len(board.pins.drives)
    board.take_output()

    board.run_for(2_200_000)

    way = board.pins.drives[steps:]
    assert way[0][0] == fed_us + 2_000_000
    assert way[-1] == (fed_us + 2_027_000, REST)
    for (_, before), (_, after) in zip([board.pins.drives[steps - 1], *way], way, strict=False):
        assert max(abs(a - b) for a, b in zip(before, after, strict=True)) <= 1000
    assert board.pins.rails[-1] == (fed_us + 2_128_000, False)
    assert board.pins.clocks[-1] == (fed_us + 2_128_000, 0)
    assert texts(board.packets()) == [
        "[WARN] Watchdog: no packet, parking the mirrors",
        "[INFO] MEMS Disable",
    ]
    assert (board.item(Item.STATE), board.item(Item.WATCHDOG_PARKS)) == (3, 1)


@pytest.mark.parametrize("silent", [False, True])
def test_any_packet_twice_a_second_keeps_the_mirrors_up(board: FirmwareBoard, silent: bool) -> None:
    ping = Packet(PacketMethod.GET, PacketProperty.TIMESTAMP, 0 if silent else 77)
    for _ in range(20):
        board.post(ping)
        board.run_for(500_000)

    assert board.pins.rail_on
    assert board.pins.codes == ASIDE + ASIDE[::-1]


def test_noise_does_not_feed_the_watchdog(board: FirmwareBoard) -> None:
    for _ in range(30):
        board.feed(b"\x04\x14\x12\x01\x01\x00" + b"\x99" * 300 + b"\x00\x00")
        board.run_for(100_000)

    assert not board.pins.rail_on
    assert board.pins.codes == REST


def test_what_is_pending_ends_when_the_watchdog_fires_and_the_trigger_lines_fall(
    board: FirmwareBoard,
) -> None:
    order = ActuateCommand(left=REST[:4], right=REST[:4], settle_us=10_000_000).pack()
    frame = FrameRequest(stream=0, cameras=0, pulse_us=9_000_000, settle_us=0).pack()
    board.strobe(1, 8_000_000)
    board.post(
        Packet(PacketMethod.SET, PacketProperty.ACTUATE, 50, order),
        Packet(PacketMethod.GET, PacketProperty.FRAME, 51, frame),
        Packet(PacketMethod.SET, PacketProperty.TRIGGER, 52, pack_u32(9_000_000)),
    )
    board.run_for(1_900_000)
    assert board.pins.high == 7
    board.take_output()

    board.run_for(100_000)

    ends = {packet.sequence: packet.payload for packet in board.packets() if packet.sequence}
    assert ends == dict.fromkeys((50, 51, 52), b"System disabled")
    assert board.pins.high == 0


def test_while_it_parks_nothing_else_moves_the_mirrors(board: FirmwareBoard) -> None:
    board.run_for(2_010_000)
    assert board.item(Item.STATE) == 2
    halfway = board.pins.codes
    assert halfway not in (REST, ASIDE + ASIDE[::-1])

    board.post(Packet(PacketMethod.SET, PacketProperty.STREAM, 0, stream(1, 0)))
    board.post(Packet(PacketMethod.SET, PacketProperty.STREAM, 88, stream(0, 0)))

    assert DISABLED in texts(board.packets())
    assert board.pins.codes == halfway
    assert board.ask(PacketMethod.GET, PacketProperty.ENABLE)[0].payload == b"\x01"  # the rail is on
    assert board.pins.codes == REST


def test_disable_ends_parking_at_once_and_enable_starts_afresh(board: FirmwareBoard) -> None:
    board.run_for(2_010_000)
    t_us = board.now_us
    board.post(Packet(PacketMethod.SET, PacketProperty.ENABLE, 90, b"\x01"))
    assert "The watchdog is parking the mirrors" in texts(board.packets())

    (reply,) = board.ask(PacketMethod.SET, PacketProperty.ENABLE, b"\x00")

    assert (reply.method, reply.payload) == (PacketMethod.ACK, b"\x00")
    assert board.pins.rails[-1] == (t_us + 1000, False)
    assert board.pins.codes == REST
    board.enable()
    assert board.item(Item.STATE) == 1
    assert board.ask(PacketMethod.SET, PacketProperty.STREAM, stream(0, 0))[0].method is PacketMethod.ACK


def test_watchdog_and_parking_follow_their_settings(board: FirmwareBoard) -> None:
    assert board.set_item(Item.WATCHDOG_MS, 300) is None
    assert board.set_item(Item.PARK_MS, 0) is None
    assert board.set_item(Item.PARK_SLEW, 65_535) is None
    fed_us = board.now_us

    board.run_for(400_000)

    assert board.pins.drives[-1] == (fed_us + 300_000, REST)
    assert board.pins.rails[-1] == (fed_us + 301_000, False)


def test_a_disabled_controller_may_be_left_alone() -> None:
    board = FirmwareBoard()

    board.run_for(60_000_000)

    assert board.item(Item.WATCHDOG_PARKS) == 0
    assert board.pins.words == []


DEFAULTS = {
    Item.WATCHDOG_MS: (2000, 100, 60_000),
    Item.PARK_MS: (100, 0, 5000),
    Item.PARK_SLEW: (1000, 1, 65_535),
    Item.CHANNEL_MAX: (57_343, 0, 57_343),
    Item.DIFFERENCE_MAX: (55_705, 0, 55_705),
    Item.STEP_MAX: (65_535, 1, 65_535),
    Item.SLEW: (0, 0, 65_535),
}


@pytest.mark.parametrize("item", DEFAULTS)
def test_a_setting_has_its_default_takes_its_range_and_refuses_the_rest(item: Item) -> None:
    default, least, most = DEFAULTS[item]
    board = FirmwareBoard()
    assert board.item(item) == default

    assert board.set_item(item, least) is None
    assert board.item(item) == least
    for beyond in {most + 1, 2**32 - 1, max(0, least - 1)} - {0 if least == 0 else -1}:
        assert board.set_item(item, beyond) == "Setting out of range"
    assert board.item(item) == least
    board.ask(PacketMethod.SET, PacketProperty.RESET, b"\x00")
    assert board.item(item) == default


def test_limits_stand_while_enabled(board: FirmwareBoard) -> None:
    for item in (Item.CHANNEL_MAX, Item.DIFFERENCE_MAX, Item.STEP_MAX, Item.SLEW):
        assert board.set_item(item, 40_000) == "Cannot change limits while system is enabled"


def test_unknown_and_read_only_items_are_refused() -> None:
    board = FirmwareBoard()

    assert board.set_item(Item.BOOT_ID, 1) == "Setting is read only"
    assert board.set_item(Item.MALFORMED, 0) == "Setting is read only"
    assert board.set_item(10, 1) == "Unknown setting"
    assert board.set_item(255, 1) == "Unknown setting"
    assert board.raw(PacketMethod.GET, 0xD, b"\x0a")[3:] == b"Unknown setting"
    assert board.raw(PacketMethod.GET, 0xD, b"")[3:] == b"Invalid packet"
    assert board.raw(PacketMethod.SET, 0xD, b"\x02\x01\x01")[3:] == b"Invalid packet"


def test_the_name_says_that_there_is_a_guard() -> None:
    (reply,) = FirmwareBoard().ask(PacketMethod.GET, PacketProperty.INFO)

    assert reply.payload.endswith(b" +guard")


def test_every_boot_has_an_id_of_its_own() -> None:
    ids = []
    board = FirmwareBoard(noise=7)
    for kind in (b"\x00", b"\x01", b"\x00"):
        ids.append(board.item(Item.BOOT_ID))
        board.ask(PacketMethod.SET, PacketProperty.RESET, kind)
    ids += [board.item(Item.BOOT_ID), FirmwareBoard(noise=8).item(Item.BOOT_ID)]

    assert len(set(ids)) == 5
    assert 0 not in ids
    assert board.pins.reboots == 1


def test_replies_that_the_port_does_not_take_are_counted_and_hurt_nobody() -> None:
    board = FirmwareBoard()
    board.fill_port(full=True)
    assert board.ask(PacketMethod.GET, PacketProperty.VERSION) == []
    board.fill_port(full=False)

    assert board.item(Item.UNSENT) == 1


def with_crc(packet: Packet) -> bytes:
    """Return the wire bytes of a packet with the CRC of Python's own library behind it."""
    body = bytes((packet.method << 4 | packet.prop,)) + packet.sequence.to_bytes(2, "little") + packet.payload
    body += binascii.crc_hqx(body, 0xFFFF).to_bytes(2, "little")
    return cobs_encode(bytes((functools.reduce(xor, body),)) + body)


def answers_with_crc(board: FirmwareBoard) -> list[Packet]:
    packets = []
    for frame in CobsDecoder().feed(board.take_output()):
        assert frame is not None
        assert binascii.crc_hqx(frame[1:-2], 0xFFFF) == int.from_bytes(frame[-2:], "little")
        packet = decode_packet(frame)  # the XOR of all bytes stays 0
        packets.append(Packet(packet.method, packet.prop, packet.sequence, packet.payload[:-2]))
    return packets


def test_the_crc_is_agreed_on_and_then_asked_of_every_packet() -> None:
    board = FirmwareBoard()
    assert board.set_item(Item.CHECK, 2) == "Setting out of range"
    assert board.set_item(Item.CHECK, 1) is None

    board.feed(with_crc(Packet(PacketMethod.GET, PacketProperty.BIAS, 5)))
    assert answers_with_crc(board) == [Packet(PacketMethod.ACK, PacketProperty.BIAS, 5, b"\x00\x00")]

    board.feed(encode_packet(Packet(PacketMethod.SET, PacketProperty.BIAS, 6, b"\x32\x73")))
    assert board.take_output() == b""
    board.feed(with_crc(Packet(PacketMethod.GET, PacketProperty.BIAS, 7)))
    assert answers_with_crc(board) == [Packet(PacketMethod.ACK, PacketProperty.BIAS, 7, b"\x00\x00")]


def test_two_flips_that_the_xor_does_not_see_are_seen_by_the_crc() -> None:
    board = FirmwareBoard()
    board.set_item(Item.CHECK, 1)
    wire = bytearray(with_crc(Packet(PacketMethod.SET, PacketProperty.BIAS, 9, b"\x32\x73")))
    wire[5] ^= 0x08
    wire[6] ^= 0x08

    board.feed(bytes(wire))

    assert board.take_output() == b""


def test_a_host_that_knows_no_crc_finds_a_plain_controller() -> None:
    board = FirmwareBoard()
    board.set_item(Item.CHECK, 1)

    board.feed(bytes.fromhex("04 13 12 01 01 00"))

    assert board.take_output() == bytes.fromhex("04 30 32 01 03 02 01 01 00")
    assert board.ask(PacketMethod.GET, PacketProperty.ENABLE)[0].payload == b"\x00"


def test_boot_switches_everything_off_before_anything_else() -> None:
    board = FirmwareBoard()

    assert board.pins.rails == [(START_US, False)]
    assert board.pins.clocks == [(START_US, 0)]
    assert board.pins.triggers == [(START_US, 0)]
