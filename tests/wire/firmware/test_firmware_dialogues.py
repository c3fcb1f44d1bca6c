"""The compiled firmware speaks the protocol: golden vectors, and dialogues compared with the simulation's."""

import random
from collections.abc import Callable

import pytest
from tests.support.devices.firmware_board import START_US, FirmwareBoard

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
    FrameRequest,
    MirrorCodes,
    StreamCommand,
    pack_u16,
    pack_u32,
    pack_u64,
)

BIAS: MirrorCodes = (29490, 29490, 29490, 29490)
TURNED: MirrorCodes = (31128, 27851, 27851, 31128)

GOLDEN_ACTUATE = "04 f7 2a 0a 13 98 79 cb 6c cb 6c 98 79 cb 6c 98 79 98 79 cb 6c d0 07 01 01 00"
GOLDEN_FRAME = "04 b6 19 15 05 05 06 20 4e 01 03 d0 07 01 01 00"


@pytest.mark.parametrize(
    ("sent", "received"),
    [
        ("04 13 12 01 01 00", "04 30 32 01 03 02 01 01 00"),
        ("04 5b 26 05 02 78 01 00", "04 4b 36 05 02 78 01 00"),
        ("04 60 27 06 03 32 73 00", "04 70 37 06 03 32 73 00"),
        ("03 2c 28 01 13 01 05 1d 75 46 71 c1 75 a2 70 46 71 1d 75 a2 70 c1 75 00", ""),
    ],
)
def test_golden_requests_draw_the_golden_replies(sent: str, received: str) -> None:
    board = FirmwareBoard()

    board.feed(bytes.fromhex(sent))

    assert board.take_output() == bytes.fromhex(received)


def test_enable_logs_and_then_draws_the_golden_reply() -> None:
    board = FirmwareBoard()
    board.feed(bytes.fromhex("04 2d 24 08 02 01 00"))
    board.run_for(1000)

    said = board.take_output()

    assert said.startswith(bytes.fromhex("03 c0 ff 01 13 5b 49 4e 46 4f 5d"))
    assert said.endswith(bytes.fromhex("00 04 3d 34 08 02 01 00"))


def test_actuate_while_disabled_draws_the_golden_refusal() -> None:
    board = FirmwareBoard()
    order = ActuateCommand(left=TURNED, right=BIAS, settle_us=0)

    board.post(Packet(PacketMethod.SET, PacketProperty.ACTUATE, 7, order.pack()))

    expected = b"Cannot perform action: system is not enabled"
    assert board.take_output() == bytes.fromhex("04 2e 4a 07 2d") + expected + b"\x00"


def test_the_golden_actuate_puts_the_golden_values_on_the_dacs_in_one_update() -> None:
    board = FirmwareBoard()
    board.enable()
    board.pins.words.clear()

    board.feed(bytes.fromhex(GOLDEN_ACTUATE))

    # The vector's words, with command 0 (fill the input register) for 3 (and update this channel).
    left = [word & 0x07FFFF for word in (0x187998, 0x196CCB, 0x1B6CCB, 0x1A7998)]
    right = [word & 0x07FFFF for word in (0x186CCB, 0x197998, 0x1B7998, 0x1A6CCB)]
    assert board.pins.words == [*((1, word) for word in left), *((2, word) for word in right), (3, 0x0F0000)]
    assert board.pins.codes == (0x7998, 0x6CCB, 0x6CCB, 0x7998, 0x6CCB, 0x7998, 0x7998, 0x6CCB)


def test_the_golden_frame_request_draws_the_golden_acknowledgement() -> None:
    board = FirmwareBoard()
    board.enable()
    board.ask(PacketMethod.SET, PacketProperty.STREAM, stream(0, 5))

    board.feed(bytes.fromhex(GOLDEN_FRAME))

    assert board.take_output() == bytes.fromhex("04 2c 39 15 01 01 00")


def test_enable_writes_the_pages_words_in_the_pages_order() -> None:
    board = FirmwareBoard()
    board.enable()

    words = [word for mirrors, word in board.pins.words if mirrors == 3]
    assert words == [0x280001, 0x380001, 0x20000F, 0x300000, 0x1F7332]
    assert board.pins.rails[-1] == (START_US, True)
    assert board.pins.clocks[-1] == (START_US + 1000, 60 * 60)


def stream(operation: int, number: int, left: MirrorCodes = BIAS, right: MirrorCodes = BIAS) -> bytes:
    return StreamCommand(operation=operation, stream=number, left=left, right=right).pack()


def frame(number: int, *, cameras: int = 0, pulse_us: int = 4000, settle_us: int = 0) -> bytes:
    return FrameRequest(stream=number, cameras=cameras, pulse_us=pulse_us, settle_us=settle_us).pack()


class Twins:
    """The simulated far end and the compiled firmware, asked the same at the same times."""

    def __init__(self) -> None:
        self.clock = VirtualClock(START_US * 1000)
        self.cables = RecordingCables()
        self.simulated = ControllerFarEnd(self.clock, self.cables)
        self.board = FirmwareBoard()
        self._decoder = CobsDecoder()
        self._sequence = 0
        self.replies: list[Packet] = []

    def post(self, *packets: Packet) -> None:
        data = b"".join(map(encode_packet, packets))
        self.simulated.feed(data)
        self.board.feed(data)
        self.compare()

    def exchange(self, *messages: tuple[PacketMethod, PacketProperty, bytes], silent: bool = False) -> None:
        packets = []
        for method, prop, payload in messages:
            self._sequence += 1
            packets.append(Packet(method, prop, 0 if silent else self._sequence, payload))
        self.post(*packets)

    def run_for(self, duration_us: int) -> None:
        self.clock.sleep_until_ns(self.clock.now_ns() + duration_us * 1000)
        self.simulated.advance(self.clock.now_ns())
        self.board.advance(self.clock.now_ns())
        self.compare()

    def compare(self) -> None:
        expected = [decode_packet(piece) for piece in self._decoder.feed(self.simulated.take_output())]
        found = self.board.packets()
        assert found == expected
        self.replies += found
        pins, cables = self.board.pins, self.cables
        assert last_of_each_time(pins.drives) == last_of_each_time(
            [(t_ns // 1000, codes) for t_ns, codes in cables.drives]
        )
        assert pins.rail_on == cables.rail_on
        assert (pins.clocks[-1][1] if pins.clocks else 0) == 60 * cables.cutoff_hz
        assert rises(pins.triggers) == [(edge.t_ns // 1000, edge.cameras) for edge in cables.triggers]


def last_of_each_time(drives: list[tuple[int, tuple[int, ...]]]) -> list[tuple[int, tuple[int, ...]]]:
    final = {t_us: codes for t_us, codes in drives if any(codes)}  # zeros: the simulation unplugs its DACs
    changes: list[tuple[int, tuple[int, ...]]] = []
    for t_us, codes in final.items():
        if not changes or changes[-1][1] != codes:
            changes.append((t_us, codes))
    return changes


def rises(triggers: list[tuple[int, int]]) -> list[tuple[int, int]]:
    edges, before = [], 0
    for t_us, high in triggers:
        if high & ~before:
            edges.append((t_us, high & ~before))
        before = high
    return edges


def enabled() -> Twins:
    twins = Twins()
    twins.exchange(
        (PacketMethod.SET, PacketProperty.LPF, pack_u16(120)),
        (PacketMethod.SET, PacketProperty.BIAS, pack_u16(29490)),
    )
    twins.exchange((PacketMethod.SET, PacketProperty.ENABLE, b"\x01"))
    twins.run_for(1000)
    return twins


Dialogue = Callable[[], Twins]


def settings() -> Twins:
    twins = Twins()
    for prop in (
        PacketProperty.VERSION,
        PacketProperty.ENABLE,
        PacketProperty.LOG_LEVEL,
        PacketProperty.LPF,
        PacketProperty.BIAS,
    ):
        twins.exchange((PacketMethod.GET, prop, b""))
    twins.exchange(
        (PacketMethod.SET, PacketProperty.BIAS, pack_u16(1234)),
        (PacketMethod.SET, PacketProperty.LPF, pack_u16(240)),
    )
    twins.exchange(
        (PacketMethod.SET, PacketProperty.LOG_LEVEL, b"\x01"),
        (PacketMethod.SET, PacketProperty.ENABLE, b"\x07"),
    )
    twins.run_for(5000)
    for prop in (PacketProperty.ENABLE, PacketProperty.LOG_LEVEL, PacketProperty.LPF, PacketProperty.BIAS):
        twins.exchange((PacketMethod.GET, prop, b""))
    twins.exchange(
        (PacketMethod.SET, PacketProperty.ENABLE, b"\x01"),
        (PacketMethod.SET, PacketProperty.LPF, pack_u16(500)),
    )
    twins.exchange(
        (PacketMethod.SET, PacketProperty.LOG_LEVEL, b"\x03"),
        (PacketMethod.SET, PacketProperty.ENABLE, b"\x00"),
    )
    twins.run_for(5000)
    twins.exchange(
        (PacketMethod.SET, PacketProperty.ENABLE, b"\x00"), (PacketMethod.GET, PacketProperty.ENABLE, b"")
    )
    return twins


def clock() -> Twins:
    twins = Twins()
    twins.run_for(1_234_567)
    twins.exchange(
        (PacketMethod.GET, PacketProperty.TIMESTAMP, b""),
        (PacketMethod.SET, PacketProperty.TIMESTAMP, pack_u64(0)),
    )
    twins.run_for(42)
    twins.exchange(
        (PacketMethod.GET, PacketProperty.TIMESTAMP, b""),
        (PacketMethod.SET, PacketProperty.TIMESTAMP, pack_u64(2**40)),
    )
    twins.run_for(4_294_967_296)  # the board's own counter wraps
    twins.exchange((PacketMethod.GET, PacketProperty.TIMESTAMP, b""))
    return twins


def malformed_requests() -> Twins:
    twins = enabled()
    twins.exchange((PacketMethod.SET, PacketProperty.STREAM, stream(0, 0)))
    for prop in (PacketProperty.INFO, PacketProperty.VERSION, PacketProperty.NONE, PacketProperty.LOG):
        twins.exchange((PacketMethod.SET, prop, b"\x00"), (PacketMethod.GET, prop, b"\x00"))
    for prop in [
        *(PacketProperty(number) for number in range(PacketProperty.TIMESTAMP + 1)),
        PacketProperty.LOG,
    ]:
        twins.exchange((PacketMethod.SET, prop, b"\x01" * 7), (PacketMethod.GET, prop, b"\x01" * 7))
    for method in (PacketMethod.ACK, PacketMethod.REJ, PacketMethod.FIN, PacketMethod.SYN, PacketMethod.NOP):
        twins.exchange((method, PacketProperty.ENABLE, b"\x01"))
    return twins


def resets() -> Twins:
    twins = Twins()
    twins.exchange(
        (PacketMethod.SET, PacketProperty.RESET, b"\x02"), (PacketMethod.SET, PacketProperty.RESET, b"\x07")
    )
    twins = enabled()
    twins.exchange(
        (PacketMethod.SET, PacketProperty.STREAM, stream(0, 0, TURNED)),
        (PacketMethod.SET, PacketProperty.RESET, b"\x02"),
    )
    twins.exchange((PacketMethod.SET, PacketProperty.ENABLE, b"\x00"))
    twins.run_for(2000)
    for kind in (b"\x00", b"\x01"):
        twins.exchange((PacketMethod.SET, PacketProperty.RESET, kind))
        twins.run_for(100_000)
        twins.exchange(
            (PacketMethod.GET, PacketProperty.BIAS, b""), (PacketMethod.GET, PacketProperty.TIMESTAMP, b"")
        )
    return twins


def streams() -> Twins:
    twins = enabled()
    for operation, number in ((0, 3), (0, 4), (0, 3), (0, 64), (1, 9), (2, 9), (7, 3), (1, 255)):
        twins.exchange((PacketMethod.SET, PacketProperty.STREAM, stream(operation, number, TURNED)))
    twins.exchange((PacketMethod.SET, PacketProperty.STREAM, stream(1, 4, BIAS, TURNED)))
    twins.exchange((PacketMethod.SET, PacketProperty.STREAM, stream(1, 3, BIAS, TURNED)), silent=True)
    twins.exchange(
        (PacketMethod.SET, PacketProperty.STREAM, stream(2, 3)),
        (PacketMethod.SET, PacketProperty.STREAM, stream(0, 8)),
    )
    twins.exchange((PacketMethod.SET, PacketProperty.STREAM, b"\x01"), silent=True)
    twins.run_for(1_500_000)
    return twins


def two_phases() -> Twins:
    twins = enabled()
    order = ActuateCommand(left=TURNED, right=BIAS, settle_us=2000).pack()
    twins.exchange(
        (PacketMethod.SET, PacketProperty.ACTUATE, order), (PacketMethod.SET, PacketProperty.ACTUATE, order)
    )
    twins.run_for(3000)
    twins.exchange(
        (PacketMethod.SET, PacketProperty.TRIGGER, pack_u32(2000)),
        (PacketMethod.SET, PacketProperty.TRIGGER, pack_u32(2000)),
    )
    twins.run_for(3000)
    twins.exchange((PacketMethod.SET, PacketProperty.ACTUATE, order))
    twins.exchange(
        (PacketMethod.SET, PacketProperty.TRIGGER, pack_u32(20_000)),
        (PacketMethod.SET, PacketProperty.ENABLE, b"\x00"),
    )
    twins.run_for(3000)
    twins.exchange((PacketMethod.SET, PacketProperty.TRIGGER, pack_u32(3000)))
    twins.run_for(5000)
    return twins


def frames() -> Twins:
    twins = enabled()
    twins.exchange(*((PacketMethod.SET, PacketProperty.STREAM, stream(0, number)) for number in range(10)))
    twins.exchange((PacketMethod.SET, PacketProperty.STREAM, stream(1, 1, TURNED)))
    twins.exchange((PacketMethod.GET, PacketProperty.FRAME, frame(1, settle_us=10_000)))
    twins.run_for(30_000)
    twins.exchange((PacketMethod.GET, PacketProperty.FRAME, frame(1, settle_us=10_000)))
    twins.run_for(2000)
    twins.exchange((PacketMethod.SET, PacketProperty.STREAM, stream(1, 1, (29491, 29490, 29481, 29500))))
    twins.run_for(20_000)
    for number in range(10):
        twins.exchange((PacketMethod.GET, PacketProperty.FRAME, frame(number)))
    twins.run_for(200_000)
    return twins


def frame_mistakes() -> Twins:
    twins = Twins()
    twins.exchange((PacketMethod.GET, PacketProperty.FRAME, frame(1)))
    twins = enabled()
    twins.exchange(*((PacketMethod.SET, PacketProperty.STREAM, stream(0, number)) for number in range(3)))
    twins.exchange(*((PacketMethod.GET, PacketProperty.FRAME, frame(1)) for _ in range(2)))
    for wrong in (frame(20), frame(255), frame(2, cameras=8), frame(2, cameras=1)):
        twins.exchange((PacketMethod.GET, PacketProperty.FRAME, wrong))
    twins.exchange(
        (PacketMethod.SET, PacketProperty.STREAM, stream(2, 1)),
        (PacketMethod.GET, PacketProperty.FRAME, frame(2)),
    )
    twins.exchange((PacketMethod.SET, PacketProperty.ENABLE, b"\x00"))
    twins.run_for(50_000)
    return twins


DIALOGUES: list[Dialogue] = [
    settings,
    clock,
    malformed_requests,
    resets,
    streams,
    two_phases,
    frames,
    frame_mistakes,
]


@pytest.mark.parametrize("dialogue", DIALOGUES, ids=lambda dialogue: dialogue.__name__)
def test_a_dialogue_runs_as_with_the_simulated_far_end(dialogue: Dialogue) -> None:
    assert dialogue().replies


def random_request(rng: random.Random) -> tuple[PacketMethod, PacketProperty, bytes]:
    number = rng.randrange(6)
    left, right = (rng.choice((BIAS, TURNED, (29500, 29480, 29470, 29510))) for _ in range(2))
    return rng.choice(
        (
            (
                PacketMethod.GET,
                rng.choice(
                    (PacketProperty.ENABLE, PacketProperty.BIAS, PacketProperty.LPF, PacketProperty.TIMESTAMP)
                ),
                b"",
            ),
            (PacketMethod.SET, PacketProperty.STREAM, stream(rng.randrange(3), number, left, right)),
            (PacketMethod.SET, PacketProperty.STREAM, stream(1, number, left, right)),
            (
                PacketMethod.GET,
                PacketProperty.FRAME,
                frame(number, pulse_us=rng.randrange(2000, 4500), settle_us=rng.randrange(100, 3000)),
            ),
            (PacketMethod.SET, PacketProperty.LPF, pack_u16(rng.randrange(1, 1000))),
            (PacketMethod.SET, PacketProperty.ENABLE, bytes((rng.random() < 0.8,))),
            (PacketMethod.SET, PacketProperty.RESET, b"\x02"),
        )
    )


@pytest.mark.parametrize("seed", range(30))
def test_random_dialogues_run_as_with_the_simulated_far_end(seed: int) -> None:
    rng = random.Random(seed)  # noqa: S311 - repeatable, not secret
    twins = enabled()
    for _ in range(60):
        twins.exchange(random_request(rng), silent=rng.random() < 0.1)
        twins.run_for(rng.choice((7, 1500, 12_000, 90_000)))
    assert len(twins.replies) > 40
