"""Byte links: what a driver writes to and reads from. Sole importer of pyserial.

Knows nothing of packets. Every failure of the operating system ends as `NotConnected` in words.
"""

import contextlib
import errno
import fcntl
import os
import select
import struct
import termios
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeAlias

import serial
from serial.tools import list_ports

from foveacam_hardware.contract import NotConnected
from foveacam_hardware.wire.usb_ports import PortIdentity, UsbPort, identify

WRITE_TIMEOUT_S = 0.25
"""A packet that the port does not take within this time counts as an unplugged device."""
ECHO_TIMEOUT_S = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Backlog:
    """How hard it is to get bytes out."""

    queued_bytes: int = 0
    """Taken by the system, not yet by the device."""
    stalls: int = 0
    """Writes that the port did not take at once, since it was opened."""


NO_BACKLOG = Backlog()


class ByteLink(Protocol):
    """A full-duplex byte stream. One thread reads; any thread writes, one whole packet a call."""

    def write(self, data: bytes) -> None:
        """Send all of `data`; raise `NotConnected` when the other side is gone."""
        ...

    def read(self, timeout_s: float) -> bytes:
        """Return what has arrived, waiting up to `timeout_s` for the first byte; b"" when nothing did.

        Raise `NotConnected` when the other side is gone.
        """
        ...

    def close(self) -> None:
        """Release the link; harmless when closed."""
        ...


class PortLink(ByteLink, Protocol):
    """A link that knows its port."""

    @property
    def identity(self) -> PortIdentity:
        """Which port it is, and what stands behind it."""
        ...

    @property
    def file(self) -> int | None:
        """The open port's file number, to hand to another process; None for a link without one."""
        ...

    def backlog(self) -> Backlog:
        """Return what waits to go out."""
        ...

    @property
    def quiet(self) -> bool | None:
        """Whether all answers have been heard, so that none will come; None: only a deadline tells."""
        ...


LinkFactory: TypeAlias = Callable[[], ByteLink]
"""Opens a fresh link, or raises `NotConnected`."""
PortLinkFactory: TypeAlias = Callable[[], PortLink]
"""Opens a fresh link to a port, or raises `NotConnected`."""


class SerialLink:
    """A serial port, held exclusively: locked against those who lock, and closed to further openers."""

    def __init__(self, port: str, *, baud: int = 115_200) -> None:
        self._name = port
        self._write_lock = threading.Lock()
        self._stalls = 0
        try:
            self._port = serial.Serial(port, baud, timeout=0, exclusive=True)
            fcntl.ioctl(self._port.fileno(), termios.TIOCEXCL)
            self._port.reset_input_buffer()
        except (serial.SerialException, OSError, ValueError, termios.error) as failure:
            raise NotConnected(_why_not_open(port, failure)) from failure
        self.identity = identify(port)
        """Which port it is, and what stands behind it."""

    @property
    def file(self) -> int | None:
        """The open port's file number; None once it is closed."""
        return self._port.fileno() if self._port.is_open else None

    def backlog(self) -> Backlog:
        """Return what waits to go out; nothing when the port is gone."""
        try:
            answer = fcntl.ioctl(self._port.fileno(), termios.TIOCOUTQ, struct.pack("I", 0))
        except (serial.SerialException, OSError, TypeError):
            return Backlog(stalls=self._stalls)
        return Backlog(queued_bytes=struct.unpack("I", answer)[0], stalls=self._stalls)

    @property
    def quiet(self) -> None:
        """Nobody can know."""
        return

    def write(self, data: bytes) -> None:
        """Send a whole packet in one call; what a full port leaves over follows at once."""
        try:
            with self._write_lock:
                file = self._port.fileno()
                while data:
                    # pyserial's own write spins on a full port and may time out after the last byte.
                    if not select.select([], [file], [], 0.0)[1]:
                        self._stalls += 1
                        if not select.select([], [file], [], WRITE_TIMEOUT_S)[1]:
                            raise OSError(errno.ETIMEDOUT, "the port takes no more bytes")
                    data = data[os.write(file, data) :]
        except (serial.SerialException, OSError, ValueError, TypeError) as failure:
            raise self._lost("write", failure) from failure

    def read(self, timeout_s: float) -> bytes:
        """Return what has arrived within `timeout_s`."""
        try:
            # One select and one read: read_until costs a select a byte.
            ready, _, _ = select.select([self._port.fileno()], [], [], timeout_s)
            return self._port.read(max(1, self._port.in_waiting)) if ready else b""
        # in_waiting raises a bare OSError (EIO) after an unplug; a closed port has no file number.
        except (serial.SerialException, OSError, ValueError, TypeError) as failure:
            raise self._lost("read", failure) from failure

    def close(self) -> None:
        """Release the port."""
        try:
            if self._port.is_open:
                fcntl.ioctl(self._port.fileno(), termios.TIOCNXCL)
        except OSError:  # an unplugged port has nothing left to restore
            pass
        finally:
            with contextlib.suppress(OSError):
                self._port.close()

    def _lost(self, action: str, failure: Exception) -> NotConnected:
        return NotConnected(
            f"serial port {self._name}: {action} failed ({failure}); the device was unplugged or lost"
            " its power: plug it in again and reconnect"
        )


def serial_link(port: str, *, baud: int = 115_200) -> LinkFactory:
    """Return a factory that opens the serial port `port`."""
    return lambda: SerialLink(port, baud=baud)


def usb_link(named: str, *, usb_id: tuple[int, int]) -> PortLinkFactory:
    """Return a factory that opens a port as a rig file names it, the same device each time."""
    port = UsbPort(named, usb_id=usb_id)

    def open_link() -> SerialLink:
        link = SerialLink(port.path())
        port.opened(link.identity)
        return link

    return open_link


def _why_not_open(port: str, failure: Exception) -> str:
    code = getattr(failure, "errno", None)
    if code in (errno.ENOENT, errno.ENXIO, errno.ENODEV):
        present = ", ".join(sorted(found.device for found in list_ports.comports())) or "none"
        found, remedy = (
            f"does not exist (ports present: {present})",
            "plug in the device or correct the port",
        )
    elif code in (errno.EACCES, errno.EPERM):
        found = f"permission denied for user id {os.getuid()}"
        remedy = "add the user to the group that owns the port (usually dialout)"
    elif code in (errno.EBUSY, errno.EAGAIN):
        found, remedy = "is held by another program", "close that program"
    else:
        found, remedy = f"cannot be opened ({failure})", "check that it is a serial port"
    return f"serial port {port}: {found}; {remedy}"


def bare_round_trips_ms(port: str, *, data: bytes, count: int) -> list[float]:
    """Return the times of `count` writes of `data`, each read back whole, ms."""
    times_ms = []
    with serial.Serial(port, 115_200, timeout=ECHO_TIMEOUT_S) as line:
        for _ in range(count):
            began_ns = time.perf_counter_ns()
            line.write(data)
            echo = line.read(len(data))
            times_ms.append((time.perf_counter_ns() - began_ns) / 1e6)
            if echo != data:
                raise ValueError(f"{port} does not echo: sent {data.hex(' ')}, read {echo.hex(' ')}")
    return times_ms
