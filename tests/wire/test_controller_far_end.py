"""Dialogues with the simulated controller: every property of the protocol page, asked and refused."""

import pytest

from foveacam_hardware.contract import VirtualClock
from foveacam_hardware.sim.cables import RecordingCables
from foveacam_hardware.sim.far_ends.controller_far_end import ControllerFarEnd
from foveacam_hardware.wire.cobs import CobsDecoder
from foveacam_hardware.wire.controller import (
    Packet,
    PacketMethod,
    PacketProperty,
    decode_packet,
    encode_packet,
)
from foveacam_hardware.wire.controller_payloads import (
    ActuateCommand,
    MirrorCodes,
    StreamCommand,
    pack_u16,
    pack_u32,
    pack_u64,
    unpack_u32,
    unpack_u64,
)

REST: MirrorCodes = (29490, 29490, 29490, 29490)
TURNED: MirrorCodes = (31128, 27851, 27851, 31128)


class Desk:
    """A host without a driver: packets in, packets out, simulated time."""

    def __init__(self, *, version: tuple[int, int, int] = (2, 1, 0), strict: bool = False) -> None:
        self.clock = VirtualClock(5_000_000_000)
        self.cables = RecordingCables()
        self.far_end = ControllerFarEnd(self.clock, self.cables, version=version, strict=strict)
        self.decoder = CobsDecoder()
        self.sequence = 0

    def send(self, method: PacketMethod, prop: PacketProperty, payload: bytes = b"") -> list[Packet]:
        """Send one request; return all that comes back once the controller is idle."""
        self.sequence += 1
        return self.exchange(encode_packet(Packet(method, prop, self.sequence, payload)))

    def exchange(self, data: bytes) -> list[Packet]:
        self.far_end.feed(data)
        while self.far_end.busy and (due_ns := self.far_end.next_event_ns()) is not None:
            self.clock.sleep_until_ns(due_ns)
            self.far_end.advance(due_ns)
        return [decode_packet(frame) for frame in self.decoder.feed(self.far_end.take_output())]

    def get(self, prop: PacketProperty, payload: bytes = b"") -> Packet:
        (reply,) = self.send(PacketMethod.GET, prop, payload)
        return reply

    def set(self, prop: PacketProperty, payload: bytes) -> Packet:
        (reply,) = self.send(PacketMethod.SET, prop, payload)
        return reply

    def enable(self) -> None:
        self.set(PacketProperty.LPF, pack_u16(120))
        self.set(PacketProperty.BIAS, pack_u16(29490))
        *_, reply = self.send(PacketMethod.SET, PacketProperty.ENABLE, b"\x01")
        assert reply.method is PacketMethod.ACK

    def stream(self, operation: int, stream: int, left: MirrorCodes = REST) -> Packet:
        command = StreamCommand(operation=operation, stream=stream, left=left, right=REST)
        return self.set(PacketProperty.STREAM, command.pack())


@pytest.fixture
def desk() -> Desk:
    return Desk()


def text(reply: Packet) -> str:
    assert reply.method is PacketMethod.REJ
    return reply.payload.decode("ascii")


@pytest.mark.parametrize(
    ("sent", "received"),
    [
        ("04 13 12 01 01 00", "04 30 32 01 03 02 01 01 00"),
        ("04 5b 26 05 02 78 01 00", "04 4b 36 05 02 78 01 00"),
        ("04 60 27 06 03 32 73 00", "04 70 37 06 03 32 73 00"),
        ("03 2c 28 01 13 01 05 1d 75 46 71 c1 75 a2 70 46 71 1d 75 a2 70 c1 75 00", ""),
    ],
)
def test_golden_requests_draw_the_golden_replies(desk: Desk, sent: str, received: str) -> None:
    desk.far_end.feed(bytes.fromhex(sent))

    assert desk.far_end.take_output() == bytes.fromhex(received)


def test_enable_logs_and_then_draws_the_golden_reply(desk: Desk) -> None:
    desk.far_end.feed(bytes.fromhex("04 2d 24 08 02 01 00"))
    desk.far_end.advance(desk.clock.now_ns() + 1_000_000)

    said = desk.far_end.take_output()

    assert said.startswith(bytes.fromhex("03 c0 ff 01 13 5b 49 4e 46 4f 5d"))
    assert said.endswith(bytes.fromhex("00 04 3d 34 08 02 01 00"))


def test_actuate_while_disabled_draws_the_golden_refusal(desk: Desk) -> None:
    order = ActuateCommand(left=TURNED, right=REST, settle_us=0)
    desk.far_end.feed(encode_packet(Packet(PacketMethod.SET, PacketProperty.ACTUATE, 7, order.pack())))

    expected = b"Cannot perform action: system is not enabled"
    assert desk.far_end.take_output() == bytes.fromhex("04 2e 4a 07 2d") + expected + b"\x00"


def test_golden_actuate_writes_the_golden_dac_words(desk: Desk) -> None:
    desk.enable()
    desk.exchange(
        bytes.fromhex("04 f7 2a 0a 13 98 79 cb 6c cb 6c 98 79 cb 6c 98 79 98 79 cb 6c d0 07 01 01 00")
    )

    left = [word for word, _ in desk.far_end.firmware.drive.words]
    right = [word for _, word in desk.far_end.firmware.drive.words]
    assert left == [0x187998, 0x196CCB, 0x1B6CCB, 0x1A7998, 0x0F0000]
    assert right == [0x186CCB, 0x197998, 0x1B7998, 0x1A6CCB, 0x0F0000]
    assert desk.cables.codes == (0x7998, 0x6CCB, 0x6CCB, 0x7998, 0x6CCB, 0x7998, 0x7998, 0x6CCB)


def test_info_is_a_name(desk: Desk) -> None:
    assert desk.get(PacketProperty.INFO).payload.isascii()
    assert desk.get(PacketProperty.INFO).payload


def test_bias_and_low_pass_keep_what_they_are_given(desk: Desk) -> None:
    assert desk.get(PacketProperty.BIAS).payload == pack_u16(0)

    desk.set(PacketProperty.BIAS, pack_u16(1234))
    desk.set(PacketProperty.LPF, pack_u16(240))

    assert desk.get(PacketProperty.BIAS).payload == pack_u16(1234)
    assert desk.get(PacketProperty.LPF).payload == pack_u16(240)
    assert desk.cables.cutoff_hz == 0


def test_enable_switches_rail_then_dacs_and_filter_a_millisecond_later(desk: Desk) -> None:
    t_ns = desk.clock.now_ns()

    desk.enable()

    assert desk.cables.rails == [(t_ns, True)]
    assert desk.cables.drives == [(t_ns + 1_000_000, REST + REST)]
    assert desk.cables.cutoffs == [(t_ns + 1_000_000, 120)]
    assert desk.get(PacketProperty.ENABLE).payload == b"\x01"


def test_disable_puts_the_bias_on_before_it_switches_the_rail_off(desk: Desk) -> None:
    desk.enable()
    desk.stream(0, 0, TURNED)
    t_ns = desk.clock.now_ns()

    desk.send(PacketMethod.SET, PacketProperty.ENABLE, b"\x00")

    assert desk.cables.drives[-1] == (t_ns, REST + REST)
    assert desk.cables.rails[-1] == (t_ns + 1_000_000, False)
    assert desk.cables.cutoff_hz == 0
    assert text(desk.stream(1, 0)) == "Cannot perform action: system is not enabled"


def test_bias_cannot_change_while_enabled(desk: Desk) -> None:
    desk.enable()

    assert text(desk.set(PacketProperty.BIAS, pack_u16(0))) == "Cannot set bias while system is enabled"


def test_log_level_silences_the_pushes(desk: Desk) -> None:
    assert desk.get(PacketProperty.LOG_LEVEL).payload == b"\x03"
    desk.set(PacketProperty.LOG_LEVEL, b"\x01")

    replies = desk.send(PacketMethod.SET, PacketProperty.ENABLE, b"\x01")

    assert [reply.prop for reply in replies] == [PacketProperty.ENABLE]


def test_the_clock_runs_from_boot_and_can_be_set(desk: Desk) -> None:
    desk.clock.sleep_until_ns(desk.clock.now_ns() + 1_234_567_000)
    assert unpack_u64(desk.get(PacketProperty.TIMESTAMP).payload) == 1_234_567

    desk.set(PacketProperty.TIMESTAMP, pack_u64(0))
    desk.clock.sleep_until_ns(desk.clock.now_ns() + 42_000)

    assert unpack_u64(desk.get(PacketProperty.TIMESTAMP).payload) == 42


@pytest.mark.parametrize("kind", [0, 1])
def test_reset_acknowledges_and_boots_100_ms_later(desk: Desk, kind: int) -> None:
    desk.enable()
    t_ns = desk.clock.now_ns()

    reply = desk.set(PacketProperty.RESET, bytes((kind,)))

    assert (reply.method, reply.payload) == (PacketMethod.ACK, b"")
    assert desk.cables.rails[-1] == (t_ns + 100_000_000, False)
    assert desk.get(PacketProperty.ENABLE).payload == b"\x00"
    assert desk.get(PacketProperty.BIAS).payload == pack_u16(0)


def test_reset_of_the_dacs_needs_the_rail_and_restores_the_target(desk: Desk) -> None:
    assert text(desk.set(PacketProperty.RESET, b"\x02")) == "Cannot recover MEMS: system is not enabled"
    desk.enable()
    desk.stream(0, 0, TURNED)

    assert desk.set(PacketProperty.RESET, b"\x02").payload == b"\x02"
    assert desk.cables.codes == TURNED + REST


def test_unknown_reset_types_are_refused(desk: Desk) -> None:
    assert text(desk.set(PacketProperty.RESET, b"\x07")) == "Unknown reset type"
    assert text(Desk(version=(2, 0, 0)).set(PacketProperty.RESET, b"\x02")) == "Unknown reset type"


def test_the_first_stream_is_active_and_its_target_moves_the_mirrors(desk: Desk) -> None:
    desk.enable()

    desk.stream(0, 3, TURNED)
    assert desk.cables.codes == TURNED + REST
    desk.stream(0, 4, REST)
    assert desk.cables.codes == TURNED + REST
    desk.stream(1, 3, REST)
    assert desk.cables.codes == REST + REST


def test_a_repeated_target_is_not_written_again(desk: Desk) -> None:
    desk.enable()
    desk.stream(0, 0, TURNED)
    drives = len(desk.cables.drives)

    desk.stream(1, 0, TURNED)

    assert len(desk.cables.drives) == drives


def test_stream_mistakes_are_refused_in_the_pages_words(desk: Desk) -> None:
    desk.enable()
    desk.stream(0, 0)

    assert text(desk.stream(0, 0)) == "Stream id out of range, or already exists"
    assert text(desk.stream(0, 64)) == "Stream id out of range, or already exists"
    assert text(desk.stream(1, 9)) == "Unknown stream id"
    assert text(desk.stream(2, 9)) == "Unknown stream id, or a frame request is pending on it"
    assert text(desk.stream(7, 0)) == "Unknown stream operation"


def test_a_terminated_stream_is_gone(desk: Desk) -> None:
    desk.enable()
    desk.stream(0, 0, TURNED)

    assert desk.stream(2, 0).method is PacketMethod.ACK
    assert text(desk.stream(1, 0)) == "Unknown stream id"


def test_actuate_acknowledges_then_finishes_after_the_settling_time(desk: Desk) -> None:
    desk.enable()
    t_ns = desk.clock.now_ns()
    order = ActuateCommand(left=TURNED, right=REST, settle_us=2000)

    ack, fin = desk.send(PacketMethod.SET, PacketProperty.ACTUATE, order.pack())

    assert (ack.method, ack.payload) == (PacketMethod.ACK, order.pack())
    assert (fin.method, fin.payload[:16]) == (PacketMethod.FIN, order.pack()[:16])
    assert unpack_u32(fin.payload[16:]) == (t_ns + 2_000_000 - 5_000_000_000) // 1000
    assert desk.cables.drives[-1] == (t_ns, TURNED + REST)


def test_a_second_actuate_or_trigger_waits_for_the_first(desk: Desk) -> None:
    desk.enable()
    order = ActuateCommand(left=TURNED, right=REST, settle_us=2000).pack()
    for prop, payload, refusal in (
        (PacketProperty.ACTUATE, order, "An actuate request is already pending"),
        (PacketProperty.TRIGGER, pack_u32(2000), "A trigger request is already pending"),
    ):
        twice = [Packet(PacketMethod.SET, prop, sequence, payload) for sequence in (900, 901)]
        replies = desk.exchange(b"".join(map(encode_packet, twice)))

        assert [reply.method for reply in replies] == [PacketMethod.ACK, PacketMethod.REJ, PacketMethod.FIN]
        assert text(replies[1]) == refusal


def test_trigger_raises_all_three_lines_even_while_disabled(desk: Desk) -> None:
    t_ns = desk.clock.now_ns()

    ack, fin = desk.send(PacketMethod.SET, PacketProperty.TRIGGER, pack_u32(3000))

    (edge,) = desk.cables.triggers
    assert (edge.t_ns, edge.pulse_us, edge.cameras) == (t_ns, 3000, 7)
    assert (ack.payload, unpack_u32(fin.payload)) == (pack_u32(3000), 3000)


@pytest.mark.parametrize(
    "prop", [PacketProperty.INFO, PacketProperty.VERSION, PacketProperty.NONE, PacketProperty.LOG]
)
def test_what_cannot_be_set_is_an_invalid_packet(desk: Desk, prop: PacketProperty) -> None:
    assert text(desk.set(prop, b"\x00")) == "Invalid packet"


@pytest.mark.parametrize(
    ("method", "prop"),
    [
        (PacketMethod.GET, PacketProperty.VERSION),
        (PacketMethod.GET, PacketProperty.FRAME),
        (PacketMethod.SET, PacketProperty.ENABLE),
        (PacketMethod.SET, PacketProperty.LPF),
        (PacketMethod.SET, PacketProperty.BIAS),
        (PacketMethod.SET, PacketProperty.STREAM),
        (PacketMethod.SET, PacketProperty.ACTUATE),
        (PacketMethod.SET, PacketProperty.TRIGGER),
        (PacketMethod.SET, PacketProperty.TIMESTAMP),
        (PacketMethod.SET, PacketProperty.RESET),
        (PacketMethod.SET, PacketProperty.LOG_LEVEL),
    ],
)
def test_a_payload_of_the_wrong_size_is_an_invalid_packet(
    desk: Desk, method: PacketMethod, prop: PacketProperty
) -> None:
    desk.enable()
    desk.stream(0, 0)

    (reply,) = desk.send(method, prop, b"\x01" * 7)

    assert text(reply) == "Invalid packet"


def test_sequence_zero_acts_without_any_reply(desk: Desk) -> None:
    desk.enable()
    desk.stream(0, 0)
    command = StreamCommand(operation=1, stream=0, left=TURNED, right=REST)

    moved = desk.exchange(encode_packet(Packet(PacketMethod.SET, PacketProperty.STREAM, 0, command.pack())))
    refused = desk.exchange(encode_packet(Packet(PacketMethod.SET, PacketProperty.STREAM, 0, b"\x01")))

    assert moved == refused == []
    assert desk.cables.codes == TURNED + REST


def test_once_a_second_the_dacs_are_written_again(desk: Desk) -> None:
    desk.enable()
    desk.stream(0, 0, TURNED)
    desk.far_end.firmware.drive._left.write(0x280001)  # the DAC lost its settings

    due_ns = desk.far_end.next_event_ns()
    assert due_ns is not None
    desk.far_end.advance(due_ns)

    assert desk.cables.codes == TURNED + REST
    assert desk.far_end.next_event_ns() == due_ns + 1_000_000_000


def test_before_2_streams_and_frames_are_unknown_and_everything_ends_with_ack() -> None:
    desk = Desk(version=(1, 1, 0))
    desk.enable()

    (reply,) = desk.send(
        PacketMethod.SET, PacketProperty.ACTUATE, ActuateCommand(left=TURNED, right=REST, settle_us=0).pack()
    )

    assert reply.method is PacketMethod.ACK
    assert desk.cables.codes == TURNED + REST
    assert text(desk.stream(0, 0)) == "Invalid packet"
    assert text(desk.get(PacketProperty.FRAME, bytes(10))) == "Invalid packet"
    assert text(Desk(version=(1, 0, 0)).get(PacketProperty.TIMESTAMP)) == "Invalid packet"
