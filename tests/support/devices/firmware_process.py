"""The compiled firmware as a program on a pseudo-terminal, in real time; its pins are told on a pipe."""

import os
import select
import subprocess
import time
from collections.abc import Callable
from types import TracebackType
from typing import Self

from tests.support.devices.firmware_board import Event, Kind, Pins
from tests.support.devices.firmware_build import built

WAIT_S = 10.0
_KINDS = {kind.name.lower(): kind for kind in Kind}


class FirmwareProcess:
    """A running controller; a context manager."""

    def __init__(self, *, exposure_us: int = 5000) -> None:
        self._program = subprocess.Popen(
            [built("fovea-controller"), "--pty", "--exposure-us", str(exposure_us)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        self._text = b""
        self.port = ""
        self.pins = Pins()
        self.wait_until(lambda: bool(self.port), "its port")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._program.communicate(timeout=WAIT_S)
        assert self._program.returncode == 0

    def wait_until(self, condition: Callable[[], bool], what: str) -> None:
        """Read what the pins do until `condition` holds."""
        assert self._program.stdout is not None
        file, end_s = self._program.stdout.fileno(), time.monotonic() + WAIT_S
        while not condition():
            ready, _, _ = select.select([file], [], [], end_s - time.monotonic())
            assert ready, f"waited {WAIT_S} s for {what}; the pins: {self.pins}"
            piece = os.read(file, 65_536)
            assert piece, f"the program ended while {what} was waited for"
            self._take(piece)

    def _take(self, piece: bytes) -> None:
        *lines, self._text = (self._text + piece).split(b"\n")
        for line in lines:
            if not self.port:
                self.port = line.decode()
                continue
            name, t_us, value = line.decode().split()
            self.pins.take(Event(int(t_us), _KINDS[name], int(value, 16)))
