"""Byte links: what a driver writes to and reads from. Sole importer of pyserial.

Knows nothing of packets. Every failure of the operating system ends as `NotConnected` in words.
"""

import errno
import os
import select
import termios
import threading
from collections.abc import Callable
from typing import Protocol, TypeAlias

import serial
from serial.tools import list_ports

from foveacam_hardware.contract import NotConnected

WRITE_TIMEOUT_S = 0.25
"""A packet that the port does not take within this time counts as an unplugged device."""


class Link(Protocol):
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


LinkFactory: TypeAlias = Callable[[], Link]
"""Opens a fresh link, or raises `NotConnected`."""


class SerialLink:
    """A serial port, held exclusively."""

    def __init__(self, port: str, *, baud: int = 115_200) -> None:
        self._name = port
        self._write_lock = threading.Lock()
        try:
            self._port = serial.Serial(port, baud, timeout=0, exclusive=True)
            self._port.reset_input_buffer()
        except (serial.SerialException, OSError, ValueError, termios.error) as failure:
            raise NotConnected(_why_not_open(port, failure)) from failure

    def write(self, data: bytes) -> None:
        """Send a whole packet in one call; what a full port leaves over follows at once."""
        try:
            with self._write_lock:
                file = self._port.fileno()
                while data:
                    # pyserial's own write spins on a full port and may time out after the last byte.
                    _, ready, _ = select.select([], [file], [], WRITE_TIMEOUT_S)
                    if not ready:
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
            self._port.close()
        except OSError:  # an unplugged port has nothing left to restore
            return

    def _lost(self, action: str, failure: Exception) -> NotConnected:
        return NotConnected(
            f"serial port {self._name}: {action} failed ({failure}); the device was unplugged or lost"
            " its power: plug it in again and reconnect"
        )


def serial_link(port: str) -> LinkFactory:
    """Return a factory that opens the serial port `port`."""
    return lambda: SerialLink(port)


def find_ports(*, vendor_id: int, product_id: int) -> list[str]:
    """Return the device paths of the serial ports with this USB id."""
    return sorted(
        found.device for found in list_ports.comports() if (found.vid, found.pid) == (vendor_id, product_id)
    )


def _why_not_open(port: str, failure: Exception) -> str:
    code = getattr(failure, "errno", None)
    if code in (errno.ENOENT, errno.ENXIO, errno.ENODEV):
        present = ", ".join(sorted(found.device for found in list_ports.comports())) or "none"
        found, remedy = (
            f"does not exist (ports present: {present})",
            "plug in the controller or correct the port",
        )
    elif code in (errno.EACCES, errno.EPERM):
        found = f"permission denied for user id {os.getuid()}"
        remedy = "add the user to the group that owns the port (usually dialout)"
    elif code in (errno.EBUSY, errno.EAGAIN):
        found, remedy = "is held by another program", "close that program"
    else:
        found, remedy = f"cannot be opened ({failure})", "check that it is a serial port"
    return f"serial port {port}: {found}; {remedy}"
