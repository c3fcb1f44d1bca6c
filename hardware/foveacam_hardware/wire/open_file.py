"""A serial port by its open file alone, as a guardian has it after the host that opened it is gone."""

import contextlib
import errno
import fcntl
import os
import select
import termios
import time

READ_BYTES = 4096
WRITE_TIMEOUT_S = 0.25


class OpenPort:
    """A port that another process opened. Every failure of the system is a bare `OSError`."""

    def __init__(self, file: int) -> None:
        self._file = file
        os.set_blocking(file, False)

    def write(self, data: bytes) -> None:
        """Send all of `data`, with patience for a full port."""
        while data:
            _, ready, _ = select.select([], [self._file], [], WRITE_TIMEOUT_S)
            if not ready:
                raise OSError(errno.ETIMEDOUT, "the port takes no more bytes")
            data = data[os.write(self._file, data) :]

    def read(self, timeout_s: float) -> bytes:
        """Return what has arrived, waiting up to `timeout_s` for the first byte; b"" when nothing did."""
        ready, _, _ = select.select([self._file], [], [], max(0.0, timeout_s))
        if not ready:
            return b""
        data = os.read(self._file, READ_BYTES)
        if not data:
            raise OSError(errno.EIO, "the port has hung up")
        return data

    def wait(self, duration_s: float) -> None:
        """Let time pass."""
        time.sleep(duration_s)

    def close(self) -> None:
        """Give the port back: others may open it again."""
        with contextlib.suppress(OSError):
            fcntl.ioctl(self._file, termios.TIOCNXCL)
        with contextlib.suppress(OSError):
            os.close(self._file)
