"""A serial port given as an open file descriptor, as the guardian holds it after the host is gone."""

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
    """A port that another process opened. Failures are raised as plain `OSError`."""

    def __init__(self, file: int) -> None:
        self._file = file
        os.set_blocking(file, False)

    def write(self, data: bytes) -> None:
        """Send all of `data`, waiting while the port is full; raise `OSError` on timeout."""
        while data:
            _, ready, _ = select.select([], [self._file], [], WRITE_TIMEOUT_S)
            if not ready:
                raise OSError(errno.ETIMEDOUT, "the port takes no more bytes")
            data = data[os.write(self._file, data) :]

    def read(self, timeout_s: float) -> bytes:
        """Return the received bytes, waiting up to `timeout_s` for the first one; b"" when none came."""
        ready, _, _ = select.select([self._file], [], [], max(0.0, timeout_s))
        if not ready:
            return b""
        data = os.read(self._file, READ_BYTES)
        if not data:
            raise OSError(errno.EIO, "the port has hung up")
        return data

    def wait(self, duration_s: float) -> None:
        """Sleep."""
        time.sleep(duration_s)

    def close(self) -> None:
        """Release the port and its exclusive lock."""
        with contextlib.suppress(OSError):
            fcntl.ioctl(self._file, termios.TIOCNXCL)
        with contextlib.suppress(OSError):
            os.close(self._file)
