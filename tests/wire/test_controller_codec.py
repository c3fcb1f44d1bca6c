"""The controller's packets, bytes against values: the protocol page's golden vectors, both directions."""

from functools import reduce
from operator import xor

import pytest
from hypothesis import given
from hypothesis import strategies as st

from foveacam_hardware.wire.cobs import CobsDecoder
from foveacam_hardware.wire.controller import (
    BadChecksum,
    BadPacket,
    Packet,
    PacketMethod,
    PacketProperty,
    decode_packet,
    encode_packet,
    next_sequence,
)
from foveacam_hardware.wire.controller_payloads import (
    ActuateCommand,
    FrameReport,
    FrameRequest,
    StreamCommand,
    StreamOperation,
    code_of_volts,
    pack_u8,
    pack_u16,
    pack_u32,
    pack_u64,
    pack_version,
    unpack_u8,
    unpack_u16,
    unpack_u32,
    unpack_u64,
    unpack_version,
)

BIAS = code_of_volts(90)
UP, DOWN = int(BIAS + 65_535 * 5 / 200), int(BIAS - 65_535 * 5 / 200)  # halves truncated separately
PLUS_TEN, MINUS_TEN = (UP, DOWN), (DOWN, UP)
TURNED = ActuateCommand(left=(*PLUS_TEN, *MINUS_TEN), right=(*MINUS_TEN, *PLUS_TEN), settle_us=2000)
UPDATE = StreamCommand(
    operation=StreamOperation.UPDATE,
    stream=5,
    left=(0x751D, 0x7146, 0x75C1, 0x70A2),
    right=(0x7146, 0x751D, 0x70A2, 0x75C1),
)
FRAME = FrameRequest(stream=5, cameras=6, pulse_us=20_000, settle_us=2000)
REFUSAL = b"Cannot perform action: system is not enabled"

GOLDEN = {
    "1 get version": (Packet(PacketMethod.GET, PacketProperty.VERSION, 1), "04 13 12 01 01 00"),
    "1 version": (
        Packet(PacketMethod.ACK, PacketProperty.VERSION, 1, pack_version((2, 1, 0))),
        "04 30 32 01 03 02 01 01 00",
    ),
    "2 set low pass": (
        Packet(PacketMethod.SET, PacketProperty.LPF, 5, pack_u16(120)),
        "04 5b 26 05 02 78 01 00",
    ),
    "2 low pass set": (
        Packet(PacketMethod.ACK, PacketProperty.LPF, 5, pack_u16(120)),
        "04 4b 36 05 02 78 01 00",
    ),
    "3 set bias": (
        Packet(PacketMethod.SET, PacketProperty.BIAS, 6, pack_u16(code_of_volts(90))),
        "04 60 27 06 03 32 73 00",
    ),
    "3 bias set": (
        Packet(PacketMethod.ACK, PacketProperty.BIAS, 6, pack_u16(29490)),
        "04 70 37 06 03 32 73 00",
    ),
    "4 enable": (Packet(PacketMethod.SET, PacketProperty.ENABLE, 8, pack_u8(1)), "04 2d 24 08 02 01 00"),
    "4 enabled": (Packet(PacketMethod.ACK, PacketProperty.ENABLE, 8, pack_u8(1)), "04 3d 34 08 02 01 00"),
    "5 actuate": (
        Packet(PacketMethod.SET, PacketProperty.ACTUATE, 10, TURNED.pack()),
        "04 f7 2a 0a 13 98 79 cb 6c cb 6c 98 79 cb 6c 98 79 98 79 cb 6c d0 07 01 01 00",
    ),
    "6 silent update": (
        Packet(PacketMethod.SET, PacketProperty.STREAM, 0, UPDATE.pack()),
        "03 2c 28 01 13 01 05 1d 75 46 71 c1 75 a2 70 46 71 1d 75 a2 70 c1 75 00",
    ),
    "7 frame": (
        Packet(PacketMethod.GET, PacketProperty.FRAME, 21, FRAME.pack()),
        "04 b6 19 15 05 05 06 20 4e 01 03 d0 07 01 01 00",
    ),
    "7 frame queued": (
        Packet(PacketMethod.ACK, PacketProperty.FRAME, 21, pack_u8(0)),
        "04 2c 39 15 01 01 00",
    ),
    "8 refused": (
        Packet(PacketMethod.REJ, PacketProperty.ACTUATE, 7, REFUSAL),
        "04 2e 4a 07 2d" + REFUSAL.hex() + "00",
    ),
}


@pytest.mark.parametrize("name", GOLDEN)
def test_a_packet_becomes_the_golden_bytes(name: str) -> None:
    packet, wire = GOLDEN[name]

    assert encode_packet(packet) == bytes.fromhex(wire)


@pytest.mark.parametrize("name", GOLDEN)
def test_the_golden_bytes_become_the_packet(name: str) -> None:
    packet, wire = GOLDEN[name]

    (frame,) = CobsDecoder().feed(bytes.fromhex(wire))

    assert decode_packet(frame) == packet


def test_a_log_push_begins_with_the_golden_bytes() -> None:
    push = Packet(PacketMethod.SYN, PacketProperty.LOG, 0, b"[INFO] MEMS Enable")

    assert encode_packet(push).startswith(bytes.fromhex("03 c0 ff 01 13 5b 49 4e 46 4f 5d"))


CODES = st.tuples(*[st.integers(0, 65_535)] * 4)
U32 = st.integers(0, 2**32 - 1)


@given(st.integers(0, 255), st.integers(0, 255), CODES, CODES)
def test_stream_payloads_round_trip(
    operation: int, stream: int, left: tuple[int, int, int, int], right: tuple[int, int, int, int]
) -> None:
    command = StreamCommand(operation=operation, stream=stream, left=left, right=right)

    assert len(command.pack()) == 18
    assert StreamCommand.unpack(command.pack()) == command


@given(CODES, CODES, U32)
def test_actuate_payloads_round_trip(
    left: tuple[int, int, int, int], right: tuple[int, int, int, int], settle_us: int
) -> None:
    command = ActuateCommand(left=left, right=right, settle_us=settle_us)

    assert len(command.pack()) == 20
    assert ActuateCommand.unpack(command.pack()) == command


@given(U32, U32)
def test_frame_requests_round_trip(pulse_us: int, settle_us: int) -> None:
    request = FrameRequest(stream=63, cameras=7, pulse_us=pulse_us, settle_us=settle_us)

    assert len(request.pack()) == 10
    assert FrameRequest.unpack(request.pack()) == request


@given(U32, st.integers(0, 2**64 - 1), CODES)
def test_frame_reports_round_trip(frame_id: int, t_us: int, codes: tuple[int, int, int, int]) -> None:
    report = FrameReport(
        stream=1,
        frame_id=frame_id,
        t_trigger_us=t_us,
        t_exposure_start_us=t_us,
        left=codes,
        right=codes[::-1],
    )

    assert len(report.pack()) == 37
    assert FrameReport.unpack(report.pack()) == report


def test_plain_numbers_round_trip_at_their_ends() -> None:
    assert unpack_u8(pack_u8(255)) == 255
    assert unpack_u16(pack_u16(65_535)) == 65_535
    assert unpack_u32(pack_u32(2**32 - 1)) == 2**32 - 1
    assert unpack_u64(pack_u64(2**64 - 1)) == 2**64 - 1
    assert unpack_version(pack_version((2, 1, 0))) == (2, 1, 0)


@pytest.mark.parametrize(
    "unpack",
    [
        StreamCommand.unpack,
        ActuateCommand.unpack,
        FrameRequest.unpack,
        FrameReport.unpack,
        unpack_u8,
        unpack_u16,
        unpack_u32,
        unpack_u64,
        unpack_version,
    ],
)
def test_a_payload_of_another_size_is_refused(unpack: object) -> None:
    assert callable(unpack)
    with pytest.raises(BadPacket, match="bytes"):
        unpack(b"\x01" * 7)


@given(st.sampled_from([packet for packet, _ in GOLDEN.values()]), st.integers(0, 200), st.integers(1, 255))
def test_one_wrong_byte_breaks_the_checksum(packet: Packet, at: int, flip: int) -> None:
    (frame,) = CobsDecoder().feed(encode_packet(packet))
    assert frame is not None
    broken = bytearray(frame)
    broken[at % len(frame)] ^= flip

    with pytest.raises(BadChecksum):
        decode_packet(bytes(broken))


@pytest.mark.parametrize("body", [b"\x62\x01\x00", b"\x7d\x01\x00"])
def test_unknown_methods_are_no_packets(body: bytes) -> None:
    with pytest.raises(BadPacket, match="unknown"):
        decode_packet(bytes((reduce(xor, body),)) + body)


@pytest.mark.parametrize("frame", [None, b"", b"\x12\x12\x00", b"\x00" * 255])
def test_frames_too_short_or_too_long_are_no_packets(frame: bytes | None) -> None:
    with pytest.raises(BadPacket):
        decode_packet(frame)


def test_a_packet_too_long_for_the_wire_is_not_sent() -> None:
    with pytest.raises(BadPacket, match="254"):
        encode_packet(Packet(PacketMethod.ACK, PacketProperty.INFO, 1, b"x" * 251))


def test_sequence_numbers_wrap_past_zero() -> None:
    assert next_sequence(1) == 2
    assert next_sequence(65_535) == 1
