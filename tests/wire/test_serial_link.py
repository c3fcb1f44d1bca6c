"""The serial link against real ptys: what goes through, and what is said when nothing does."""

import fcntl
import os
import pty
import struct
import tty
from collections.abc import Iterator
from pathlib import Path

import pytest
import serial

from foveacam_hardware.contract import NotConnected
from foveacam_hardware.wire.link import Backlog, SerialLink, serial_link

TIOCGEXCL = 0x80045440
"""Asks whether a terminal is closed to further openers; the termios module does not name it."""


class FarSide:
    """The other side of a pty."""

    def __init__(self) -> None:
        self.file, self._slave = pty.openpty()
        tty.setraw(self._slave)
        self.port = os.ttyname(self._slave)

    def hang_up(self) -> None:
        for file in (self.file, self._slave):
            os.close(file)
        self.file = -1


@pytest.fixture
def far_side() -> Iterator[FarSide]:
    side = FarSide()
    yield side
    if side.file >= 0:
        side.hang_up()


def test_bytes_go_both_ways_unchanged(far_side: FarSide) -> None:
    every_byte = bytes(range(256))
    link = SerialLink(far_side.port)

    link.write(every_byte)
    assert os.read(far_side.file, 1000) == every_byte
    os.write(far_side.file, every_byte)
    received = b""
    while len(received) < 256:
        received += link.read(1.0)
    link.close()

    assert received == every_byte


def test_reading_silence_returns_nothing(far_side: FarSide) -> None:
    link = SerialLink(far_side.port)
    assert link.read(0.01) == b""
    link.close()


def test_what_was_said_before_opening_is_forgotten(far_side: FarSide) -> None:
    os.write(far_side.file, b"stale")
    link = SerialLink(far_side.port)
    assert link.read(0.01) == b""
    link.close()


def test_a_missing_port_is_named(tmp_path: Path) -> None:
    with pytest.raises(NotConnected, match=r"nothing: does not exist.*plug in"):
        SerialLink(str(tmp_path / "nothing"))


def test_a_port_held_by_another_program_is_said_to_be(far_side: FarSide) -> None:
    first = SerialLink(far_side.port)
    with pytest.raises(NotConnected, match="held by another program"):
        SerialLink(far_side.port)
    first.close()
    SerialLink(far_side.port).close()


def exclusive(side: FarSide) -> bool:
    answer = fcntl.ioctl(side._slave, TIOCGEXCL, struct.pack("i", 0))
    return bool(struct.unpack("i", answer)[0])


def test_an_open_port_is_closed_to_everybody_else_until_it_is_released(far_side: FarSide) -> None:
    link = SerialLink(far_side.port)
    while_open = exclusive(far_side)
    link.close()

    assert (while_open, exclusive(far_side)) == (True, False)


def test_bytes_that_nobody_takes_are_told(far_side: FarSide) -> None:
    link = SerialLink(far_side.port)
    before = link.backlog()
    with pytest.raises(NotConnected, match="takes no more bytes"):
        for _ in range(1000):
            link.write(b"\x55" * 255)

    assert before == Backlog()
    assert link.backlog().stalls > 0
    link.close()
    assert link.file is None


def test_a_file_that_is_no_port_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "letter"
    path.write_text("dear controller")
    with pytest.raises(NotConnected, match="cannot be opened"):
        SerialLink(str(path))


def test_a_missing_permission_names_the_group(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise serial.SerialException(13, "could not open port")

    monkeypatch.setattr(serial, "Serial", refuse)
    with pytest.raises(NotConnected, match=r"permission denied.*dialout"):
        SerialLink("/dev/ttyACM0")


def test_a_hang_up_ends_reading_and_writing_as_not_connected(far_side: FarSide) -> None:
    link = SerialLink(far_side.port)
    far_side.hang_up()

    with pytest.raises(NotConnected, match=r"read failed.*plug it in"):
        link.read(1.0)
    with pytest.raises(NotConnected, match="write failed"):
        link.write(b"\x01\x00")
    link.close()
    link.close()


def test_a_closed_link_says_so_instead_of_breaking(far_side: FarSide) -> None:
    link = SerialLink(far_side.port)
    link.close()

    with pytest.raises(NotConnected):
        link.read(0.0)
    with pytest.raises(NotConnected):
        link.write(b"\x01")


def test_a_port_that_takes_no_more_bytes_is_not_waited_for_forever(far_side: FarSide) -> None:
    link = serial_link(far_side.port)()
    with pytest.raises(NotConnected, match="takes no more bytes"):
        for _ in range(1000):
            link.write(b"\x55" * 250)
    link.close()
