"""The simulated pan-tilt's board behind a pseudo terminal: a real port, in a process of its own."""

import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from foveacam_hardware.contract import NotConnected
from foveacam_hardware.sim.far_ends.board_far_end import BoardKind
from foveacam_hardware.sim.far_ends.board_process import BoardProcess
from foveacam_hardware.sim.pan_tilt import TurningHistory
from foveacam_hardware.wire.grbl import GrblLineReader
from foveacam_hardware.wire.link import ByteLink

PATIENCE_S = 10.0
BRISK = {24: 12_000.0, 25: 18_000.0, 110: 18_000.0, 111: 18_000.0, 120: 4000.0, 121: 4000.0}


@pytest.fixture
def turning_rig() -> TurningHistory:
    return TurningHistory()


@pytest.fixture
def board(turning_rig: TurningHistory) -> Iterator[BoardProcess]:
    with BoardProcess(BoardKind.GRBL, turning_rig) as process:
        process.open().close()
        yield process


def wait_for(link: ByteLink, wanted: str) -> list[str]:
    """Read until a line begins as wanted."""
    reader, lines, end_s = GrblLineReader(), list[str](), time.monotonic() + PATIENCE_S
    while not any(line.startswith(wanted) for line in lines):
        assert time.monotonic() < end_s, lines
        lines += reader.feed(link.read(0.1))
    return lines


def test_it_homes_and_jogs_as_told_through_its_port(board: BoardProcess, turning_rig: TurningHistory) -> None:
    board.set_faults(settings=BRISK)
    link = board.open()
    link.write(b"$H\n")
    wait_for(link, "ok")
    link.write(b"$J=G53X-80Y-30F18000\n")
    wait_for(link, "ok")
    time_up_s = time.monotonic() + PATIENCE_S
    while not any(line.startswith("<Idle|MPos:-80.000,-30.000") for line in wait_for_report(link)):
        assert time.monotonic() < time_up_s
    link.close()

    assert turning_rig.bearing_deg(time.monotonic_ns()) == (-8.0, 2.0)


def wait_for_report(link: ByteLink) -> list[str]:
    link.write(b"?")
    return wait_for(link, "<")


def test_an_unplugged_port_is_gone_and_comes_back(board: BoardProcess) -> None:
    link = board.open()
    board.unplug()

    assert not Path(board.port).exists()
    with pytest.raises(NotConnected):
        while True:
            link.read(0.1)
    link.close()

    board.plug()
    link = board.open()
    assert wait_for_report(link)[-1].startswith("<Alarm|")
    link.close()


def test_closing_it_ends_the_process_and_removes_the_port(turning_rig: TurningHistory) -> None:
    process = BoardProcess(BoardKind.GRBL, turning_rig)
    process.open().close()
    process.close()
    process.close()

    assert not Path(process.port).parent.exists()
