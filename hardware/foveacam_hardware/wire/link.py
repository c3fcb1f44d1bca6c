"""Byte links to serial devices, and the plain-pyserial baseline of the serial benchmark.

Knows nothing of packets. Every failure of the operating system is raised as `NotConnected` with a remedy.
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
"""Time after which a port that accepts no bytes counts as unplugged."""
ECHO_TIMEOUT_S = 2.0
QUIET_S, MOST_READS = 0.05, 8
"""Silence that ends the discarding of input, and the most reads on a port that is never silent."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Backlog:
    """Output that waits to be sent at a port."""

    queued_bytes: int = 0
    """Bytes in the operating system's output queue."""
    stalls: int = 0
    """Writes that the port did not accept at once, since it was opened."""


NO_BACKLOG = Backlog()


class ByteLink(Protocol):
    """A full-duplex byte stream. One thread reads; any thread writes, one whole packet per call."""

    def write(self, data: bytes) -> None:
        """Send all of `data`; raise `NotConnected` when the device is gone."""
        ...

    def read(self, timeout_s: float) -> bytes:
        """Return the received bytes, waiting up to `timeout_s` for the first one; b"" when none came.

        Raise `NotConnected` when the device is gone.
        """
        ...

    def close(self) -> None:
        """Release the link; do nothing when closed."""
        ...


def discard_input(link: ByteLink) -> None:
    """Discard bytes that have arrived or are still arriving, on a link that was just opened."""
    for _ in range(MOST_READS):
        if not link.read(QUIET_S):
            return


class PortLink(ByteLink, Protocol):
    """A link with a known port."""

    @property
    def identity(self) -> PortIdentity:
        """The port and the USB device behind it."""
        ...

    @property
    def file(self) -> int | None:
        """File descriptor of the open port, to pass to another process; None for a link without one."""
        ...

    def backlog(self) -> Backlog:
        """Return the waiting output."""
        ...

    @property
    def quiet(self) -> bool | None:
        """Whether every answer has arrived, so that no more will come; None when only a deadline decides."""
        ...


LinkFactory: TypeAlias = Callable[[], ByteLink]
"""Opens a new link, or raises `NotConnected`."""
PortLinkFactory: TypeAlias = Callable[[], PortLink]
"""Opens a new link to a port, or raises `NotConnected`."""


class SerialLink:
    """A serial port, opened exclusively by lock and by TIOCEXCL."""

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
        """The port and the USB device behind it."""

    @property
    def file(self) -> int | None:
        """File descriptor of the open port; None once it is closed."""
        return self._port.fileno() if self._port.is_open else None

    def backlog(self) -> Backlog:
        """Return the waiting output; none when the port is gone."""
        try:
            answer = fcntl.ioctl(self._port.fileno(), termios.TIOCOUTQ, struct.pack("I", 0))
        except (serial.SerialException, OSError, TypeError):
            return Backlog(stalls=self._stalls)
        return Backlog(queued_bytes=struct.unpack("I", answer)[0], stalls=self._stalls)

    @property
    def quiet(self) -> None:
        """Always None: not known for a serial port."""
        return

    def write(self, data: bytes) -> None:
        """Send a whole packet; retry the remainder that a full port did not accept."""
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
        """Return the bytes received within `timeout_s`."""
        try:
            # One select and one read: read_until costs one select per byte.
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
    """Return a factory that opens a port as named in a rig file, the same USB device each time."""
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
    """Return the round-trip times, ms, of `count` writes of `data` to an echoing port, by plain pyserial."""
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
