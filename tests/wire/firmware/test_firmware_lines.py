"""Trigger and strobe lines of the compiled firmware: a raised line always falls, reports tell the truth."""

import pytest
from tests.support.devices.firmware_board import FirmwareBoard, Item

from foveacam_hardware.sim.cables import TRIGGER_TO_EXPOSURE_US
from foveacam_hardware.wire.controller import Packet, PacketMethod, PacketProperty
from foveacam_hardware.wire.controller_payloads import (
    FrameReport,
    FrameRequest,
    MirrorCodes,
    StreamCommand,
    pack_u32,
    pack_u64,
)

BIAS: MirrorCodes = (29490, 29490, 29490, 29490)
TURNED: MirrorCodes = (31128, 27851, 27851, 31128)
BOTH = 6


@pytest.fixture
def board() -> FirmwareBoard:
    """An enabled controller with streams 0 to 3 at rest."""
    board = FirmwareBoard()
    board.enable()
    for number in range(4):
        put(board, number, BIAS, operation=0)
    return board


def put(board: FirmwareBoard, number: int, left: MirrorCodes, *, operation: int = 1) -> None:
    command = StreamCommand(operation=operation, stream=number, left=left, right=BIAS)
    board.post(Packet(PacketMethod.SET, PacketProperty.STREAM, 0, command.pack()))


def shoot(board: FirmwareBoard, sequence: int, *, number: int = 1, pulse_us: int = 4000) -> None:
    order = FrameRequest(stream=number, cameras=0, pulse_us=pulse_us, settle_us=0)
    board.post(Packet(PacketMethod.GET, PacketProperty.FRAME, sequence, order.pack()))


def ends(board: FirmwareBoard) -> list[tuple[int, PacketMethod, bytes]]:
    board.finish()
    return [
        (packet.sequence, packet.method, packet.payload)
        for packet in board.packets()
        if packet.sequence and packet.method is not PacketMethod.ACK
    ]


def test_a_pulse_longer_than_the_exposure_still_falls_and_the_next_frame_waits_for_it(
    board: FirmwareBoard,
) -> None:
    t_us = board.now_us
    shoot(board, 1, pulse_us=7000)
    shoot(board, 2, number=2, pulse_us=7000)

    assert [method for _, method, _ in ends(board)] == [PacketMethod.FIN, PacketMethod.FIN]
    assert board.pins.triggers[-4:] == [
        (t_us, BOTH),
        (t_us + 7000, 0),
        (t_us + 7000, BOTH),
        (t_us + 14_000, 0),
    ]


@pytest.mark.parametrize("exposure_us", [None, 9001, 60_000])
def test_a_strobe_missing_or_too_long_is_a_timeout_and_the_lines_are_low(
    board: FirmwareBoard, exposure_us: int | None
) -> None:
    board.strobe(2, exposure_us)
    t_us = board.now_us

    shoot(board, 1)
    board.run_for(8999)
    assert [packet.method for packet in board.packets() if packet.sequence] == [PacketMethod.ACK]
    board.run_for(1)

    assert [packet.payload for packet in board.packets()] == [b"Strobe timeout"]
    assert board.pins.triggers[-1] == (t_us + 4000, 0)


def test_disable_in_a_pulse_drops_the_lines(board: FirmwareBoard) -> None:
    shoot(board, 1, pulse_us=500_000)
    shoot(board, 2, number=2)
    board.post(Packet(PacketMethod.SET, PacketProperty.TRIGGER, 3, pack_u32(800_000)))
    assert board.pins.high == 7
    t_us = board.now_us

    board.post(Packet(PacketMethod.SET, PacketProperty.ENABLE, 4, b"\x00"))

    assert board.pins.triggers[-1] == (t_us, 0)
    told = {sequence: text for sequence, method, text in ends(board) if method is PacketMethod.REJ}
    assert told == dict.fromkeys((1, 2, 3), b"System disabled")


@pytest.mark.parametrize("kind", [b"\x00", b"\x01"])
def test_a_reset_in_a_pulse_drops_the_lines_and_switches_off(board: FirmwareBoard, kind: bytes) -> None:
    put(board, 0, TURNED)
    shoot(board, 1, number=0, pulse_us=500_000)
    t_us = board.now_us

    board.ask(PacketMethod.SET, PacketProperty.RESET, kind)

    assert (t_us, 0) in board.pins.triggers
    assert board.pins.codes == BIAS + BIAS
    assert board.pins.rails[-1][1] is False
    assert board.pins.rails[-1][0] == t_us + 100_000


def test_a_trigger_falls_while_disabled_too() -> None:
    board = FirmwareBoard()
    t_us = board.now_us

    board.ask(PacketMethod.SET, PacketProperty.TRIGGER, pack_u32(3000))

    assert board.pins.triggers[-2:] == [(t_us, 7), (t_us + 3000, 0)]


def test_a_trigger_over_a_frame_lengthens_its_pulse_and_both_end(board: FirmwareBoard) -> None:
    t_us = board.now_us
    shoot(board, 1)
    board.run_for(1000)
    board.post(Packet(PacketMethod.SET, PacketProperty.TRIGGER, 2, pack_u32(6000)))

    assert [(sequence, method) for sequence, method, _ in ends(board)] == [
        (1, PacketMethod.FIN),
        (2, PacketMethod.FIN),
    ]
    assert board.pins.triggers[-3:] == [(t_us, BOTH), (t_us + 1000, 7), (t_us + 7000, 0)]


def test_strobes_late_and_uneven_are_latched_from_the_first_rise_to_the_last_fall(
    board: FirmwareBoard,
) -> None:
    board.strobe(1, 3000, delay_us=100)
    board.strobe(2, 4000, delay_us=300)
    put(board, 1, (29500, 29480, 29490, 29490))
    board.ask(PacketMethod.SET, PacketProperty.TIMESTAMP, pack_u64(0))
    shoot(board, 1)
    board.run_for(2000)
    put(board, 1, (29503, 29477, 29490, 29490))

    ((_, method, payload),) = ends(board)

    report = FrameReport.unpack(payload)
    assert method is PacketMethod.FIN
    assert (report.t_trigger_us, report.t_exposure_start_us) == (0, 100)
    assert report.left == (29502, 29479, 29490, 29490)


def test_times_are_right_when_the_boards_counter_wraps_within_an_exposure() -> None:
    board = FirmwareBoard(now_us=2**32 - 3000)
    board.enable()
    put(board, 0, BIAS, operation=0)
    shoot(board, 1, number=0)

    ((_, _, payload),) = ends(board)

    report = FrameReport.unpack(payload)
    assert (report.t_trigger_us, report.t_exposure_start_us) == (1000, 1000 + TRIGGER_TO_EXPOSURE_US)
    assert board.now_us > 2**32


def test_strobes_between_frames_change_nothing(board: FirmwareBoard) -> None:
    board.strobe(1, 30_000)
    shoot(board, 1)
    assert ends(board)[0][2] == b"Strobe timeout"  # the left camera's strobe fell only after the timeout

    board.strobe(1, 5000)
    shoot(board, 2)

    assert [method for _, method, _ in ends(board)] == [PacketMethod.FIN]
    assert board.item(Item.LOST_EDGES) == 0
