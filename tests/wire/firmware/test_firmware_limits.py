"""Limits and atomic updates, as seen at the DACs of the compiled firmware."""

import itertools
import math
import random
import struct

import pytest
from tests.support.devices.firmware_board import REST, VOLTS, FirmwareBoard, Item

from foveacam_hardware.contract import MirrorVolts
from foveacam_hardware.drivers.controller.volts import mirror_codes
from foveacam_hardware.sim.mirror_drive import QuadDac
from foveacam_hardware.wire.controller import Packet, PacketMethod, PacketProperty
from foveacam_hardware.wire.controller_payloads import (
    ActuateCommand,
    FrameRequest,
    MirrorCodes,
    StreamCommand,
    pack_u16,
)

BIAS: MirrorCodes = (29490, 29490, 29490, 29490)
VOLTAGE, SLEW = "Outside the voltage limits", "Outside the slew limits"
UPDATE_ALL = 0x0F0000


def stream(operation: int, number: int, left: MirrorCodes, right: MirrorCodes = BIAS) -> bytes:
    return StreamCommand(operation=operation, stream=number, left=left, right=right).pack()


def refused(packets: list[Packet]) -> str | None:
    """Return the text of the REJ that ends a request; None when it was served."""
    return packets[-1].payload.decode() if packets[-1].method is PacketMethod.REJ else None


@pytest.fixture
def board() -> FirmwareBoard:
    board = FirmwareBoard()
    board.enable()
    assert refused(board.ask(PacketMethod.SET, PacketProperty.STREAM, stream(0, 0, BIAS))) is None
    return board


def limited(**items: int) -> FirmwareBoard:
    board = FirmwareBoard()
    for name, value in items.items():
        assert board.set_item(Item[name.upper()], value) is None
    board.enable()
    assert refused(board.ask(PacketMethod.SET, PacketProperty.STREAM, stream(0, 0, BIAS))) is None
    return board


def test_the_whole_swing_of_170_v_is_inside(board: FirmwareBoard) -> None:
    for codes in ((57_343, 1638, 1638, 57_343), (1638, 57_343, 57_343, 1638)):
        assert refused(board.ask(PacketMethod.SET, PacketProperty.STREAM, stream(1, 0, codes))) is None
        assert board.pins.codes == codes + BIAS


@pytest.mark.parametrize(
    "codes",
    [
        (57_344, 57_343, 29_490, 29_490),
        (29_490, 29_490, 0, 65_535),
        (57_343, 1637, 29_490, 29_490),
        (1637, 57_343, 29_490, 29_490),
        (65_535, 65_535, 65_535, 65_535),
    ],
)
@pytest.mark.parametrize("request_of", ["stream", "create", "actuate"])
def test_a_move_outside_the_voltage_limits_is_refused_whole(
    board: FirmwareBoard, codes: MirrorCodes, request_of: str
) -> None:
    inside = (30_000, 29_000, 29_490, 29_490)  # one mirror inside does not move either
    match request_of:
        case "stream":
            replies = board.ask(PacketMethod.SET, PacketProperty.STREAM, stream(1, 0, inside, codes))
        case "create":
            replies = board.ask(PacketMethod.SET, PacketProperty.STREAM, stream(0, 9, inside, codes))
        case _:
            order = ActuateCommand(left=codes, right=inside, settle_us=0)
            replies = board.ask(PacketMethod.SET, PacketProperty.ACTUATE, order.pack())

    assert refused(replies) == VOLTAGE
    assert board.pins.codes == REST
    assert board.item(Item.REFUSED_MOVES) == 1


def test_a_silent_move_outside_is_refused_counted_and_told_once_a_second(board: FirmwareBoard) -> None:
    for _ in range(5):
        board.post(Packet(PacketMethod.SET, PacketProperty.STREAM, 0, stream(1, 0, (65_535, 0, 0, 0))))

    (told,) = board.packets()
    assert told.payload == b"[WARN] A move outside the voltage limits was refused"
    assert board.pins.codes == REST
    assert board.item(Item.REFUSED_MOVES) == 5
    board.run_for(1_000_000)
    board.post(Packet(PacketMethod.SET, PacketProperty.STREAM, 0, stream(1, 0, (65_535, 0, 0, 0))))
    assert [packet.prop for packet in board.packets()] == [PacketProperty.LOG]


def test_a_bias_beyond_the_channel_limit_is_refused_now_and_at_enable() -> None:
    board = FirmwareBoard()
    assert refused(board.ask(PacketMethod.SET, PacketProperty.BIAS, pack_u16(57_344))) == VOLTAGE
    board.ask(PacketMethod.SET, PacketProperty.BIAS, pack_u16(57_343))
    board.set_item(Item.CHANNEL_MAX, 30_000)

    assert refused(board.ask(PacketMethod.SET, PacketProperty.ENABLE, b"\x01")) == VOLTAGE
    assert not board.pins.rail_on


def test_narrower_limits_hold() -> None:
    board = limited(channel_max=40_000, difference_max=1000)

    assert (
        refused(board.ask(PacketMethod.SET, PacketProperty.STREAM, stream(1, 0, (29_990, 28_990, 0, 0))))
        is None
    )
    assert (
        refused(board.ask(PacketMethod.SET, PacketProperty.STREAM, stream(1, 0, (29_990, 28_989, 0, 0))))
        == VOLTAGE
    )
    assert (
        refused(board.ask(PacketMethod.SET, PacketProperty.STREAM, stream(1, 0, (40_001, 40_000, 0, 0))))
        == VOLTAGE
    )


def test_a_step_longer_than_allowed_is_refused_and_smaller_ones_lead_there() -> None:
    board = limited(step_max=500)

    far: MirrorCodes = (30_490, 28_490, 29_490, 29_490)
    assert refused(board.ask(PacketMethod.SET, PacketProperty.STREAM, stream(1, 0, far))) == SLEW
    assert board.pins.codes == REST
    for half in (500, 1000):
        step: MirrorCodes = (29_490 + half, 29_490 - half, 29_490, 29_490)
        assert refused(board.ask(PacketMethod.SET, PacketProperty.STREAM, stream(1, 0, step))) is None
    assert board.pins.codes == far + BIAS


def test_steps_in_quick_succession_use_up_the_slew_and_time_refills_it() -> None:
    board = limited(step_max=1000, slew=100)

    def go(half: int) -> str | None:
        codes: MirrorCodes = (29_490 + half, 29_490 - half, 29_490, 29_490)
        return refused(board.ask(PacketMethod.SET, PacketProperty.STREAM, stream(1, 0, codes)))

    board.run_for(100_000)
    assert go(1000) is None
    assert go(1001) == SLEW
    board.run_for(2500)
    assert go(1251) == SLEW
    assert go(1250) is None
    board.run_for(1_000_000)
    assert go(250) is None
    board.run_for(9990)
    assert go(-749) is None
    assert go(-750) == SLEW


def test_a_frame_too_far_away_is_refused_after_its_acknowledgement_and_the_next_one_served() -> None:
    board = limited(step_max=500)
    board.ask(PacketMethod.SET, PacketProperty.STREAM, stream(0, 1, (31_000, 28_000, 29_490, 29_490)))
    board.ask(PacketMethod.SET, PacketProperty.STREAM, stream(0, 2, (29_600, 29_400, 29_490, 29_490)))
    frames = [
        Packet(
            PacketMethod.GET,
            PacketProperty.FRAME,
            600 + number,
            FrameRequest(stream=number, cameras=0, pulse_us=4000, settle_us=10).pack(),
        )
        for number in (0, 1, 2)
    ]

    board.post(*frames)
    board.finish()

    ends = [(reply.sequence, reply.method) for reply in board.packets() if reply.sequence >= 600]
    assert sorted(ends) == [
        (600, PacketMethod.ACK),
        (600, PacketMethod.FIN),
        (601, PacketMethod.ACK),
        (601, PacketMethod.REJ),
        (602, PacketMethod.ACK),
        (602, PacketMethod.FIN),
    ]
    assert board.pins.codes == (29_600, 29_400, 29_490, 29_490, *BIAS)


def outputs_after_each_word(words: list[tuple[int, int]]) -> list[tuple[int, ...]]:
    left, right = QuadDac(), QuadDac()
    seen: list[tuple[int, ...]] = []
    for mirrors, word in words:
        for bit, dac in ((1, left), (2, right)):
            if mirrors & bit:
                dac.write(word)
        seen.append((*left.codes, *right.codes))
    return seen


def test_all_eight_channels_change_at_one_word_and_no_other(board: FirmwareBoard) -> None:
    rng = random.Random(4)  # noqa: S311 - repeatable, not secret
    told: list[tuple[int, ...]] = [REST]
    for _ in range(200):
        halves = [rng.randrange(-20_000, 20_000) for _ in range(4)]
        a, b, c, d, e, f, g, h = (29_490 + sign * half for half in halves for sign in (1, -1))
        board.post(
            Packet(PacketMethod.SET, PacketProperty.STREAM, 0, stream(1, 0, (a, b, c, d), (e, f, g, h)))
        )
        told.append((a, b, c, d, e, f, g, h))
    board.run_for(2_500_000)  # once a second the words are sent again, and then the watchdog parks

    words = board.pins.words
    seen = outputs_after_each_word(words)
    start = seen.index(REST)
    for (_, word), before, after in zip(words[start + 1 :], seen[start:], seen[start + 1 :], strict=False):
        assert before == after or word == UPDATE_ALL or word >> 16 == 0x1F
    standing = [codes for codes, _ in itertools.groupby(seen[start:])]
    assert standing[: len(told)] == told
    for codes in standing:
        for plus, minus in zip(codes[::2], codes[1::2], strict=True):
            assert plus - 29_490 == 29_490 - minus  # never half a pair


def volts(board: FirmwareBoard, *values: float, number: int = 0) -> bytes:
    return board.raw(PacketMethod.SET, VOLTS, struct.pack("<B4f", number, *values))


def test_volts_are_rounded_pair_by_pair_as_the_driver_does(board: FirmwareBoard) -> None:
    rng = random.Random(5)  # noqa: S311 - repeatable, not secret
    ties = (20, 60, 100, 140, -20, -60, -100, -140)  # exactly between two codes, in binary too
    for _ in range(500):
        asked = [rng.choice((rng.uniform(-169.9, 169.9), rng.choice(ties))) for _ in range(4)]
        wire = struct.unpack("<4f", struct.pack("<4f", *asked))
        left = mirror_codes(MirrorVolts(x_v=wire[0], y_v=wire[1]), bias=29_490)
        right = mirror_codes(MirrorVolts(x_v=wire[2], y_v=wire[3]), bias=29_490)

        reply = volts(board, *asked)

        assert reply[0] == PacketMethod.ACK << 4 | VOLTS
        assert struct.unpack("<8H", reply[4:]) == left + right == board.pins.codes


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e30, -170.1, 170.1, 200.1, 3.4e38])
@pytest.mark.parametrize("at", range(4))
def test_volts_that_are_none_or_too_many_are_refused(board: FirmwareBoard, bad: float, at: int) -> None:
    values = [1.0, 2.0, 3.0, 4.0]
    values[at] = bad

    assert volts(board, *values)[3:] == VOLTAGE.encode()
    assert board.pins.codes == REST


def test_volts_need_an_enabled_controller_and_a_stream_that_is_there(board: FirmwareBoard) -> None:
    assert volts(board, 0, 0, 0, 0, number=5)[3:] == b"Unknown stream id"
    assert volts(board, 0, 0, 0, 0, number=200)[3:] == b"Unknown stream id"
    assert volts(FirmwareBoard(), 0, 0, 0, 0)[3:].startswith(b"Cannot perform action")


def test_a_pair_about_a_low_bias_cannot_leave_the_dac() -> None:
    board = FirmwareBoard()
    board.enable(bias=100)
    board.ask(PacketMethod.SET, PacketProperty.STREAM, stream(0, 0, (100,) * 4, (100,) * 4))

    assert volts(board, 0.7, 0, 0, 0)[3:] == VOLTAGE.encode()
    assert volts(board, 0.6, 0, 0, 0)[0] == PacketMethod.ACK << 4 | VOLTS


def test_an_actuated_target_survives_a_dac_that_forgot_its_settings() -> None:
    board = FirmwareBoard()
    board.enable()
    order = ActuateCommand(left=(30_000, 28_980, 29_490, 29_490), right=BIAS, settle_us=0)
    board.ask(PacketMethod.SET, PacketProperty.ACTUATE, order.pack())
    board.pins.left.write(0x280001)

    board.run_for(1_000_000)

    assert board.pins.codes == (30_000, 28_980, 29_490, 29_490, *BIAS)
