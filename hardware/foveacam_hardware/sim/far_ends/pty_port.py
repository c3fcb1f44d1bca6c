"""A serial port that is none: a pty, and a stable path that leads to it while it is plugged in."""

import contextlib
import os
import tty
from pathlib import Path

READ_BYTES = 4096


class PtyPort:
    """The far end's side of a pty."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._files: tuple[int, int] | None = None

    @property
    def file(self) -> int | None:
        """The master's file number; None while unplugged."""
        return self._files[0] if self._files else None

    def plug(self) -> None:
        """Open a pty and point the path at it."""
        if self._files is not None:
            return
        master, slave = os.openpty()
        tty.setraw(slave)
        os.set_blocking(master, False)
        self._path.unlink(missing_ok=True)
        self._path.symlink_to(os.ttyname(slave))
        self._files = master, slave

    def unplug(self) -> None:
        """Hang up: the host's reads and writes fail, and the path is gone."""
        if self._files is not None:
            self._path.unlink(missing_ok=True)
            for file in self._files:
                os.close(file)
            self._files = None

    def read(self) -> bytes:
        """Return what the host has sent."""
        return os.read(self._files[0], READ_BYTES) if self._files else b""

    def write(self, data: bytes) -> None:
        """Send to the host; what nobody reads is lost, as on a USB port that nobody has opened."""
        if self._files is not None:
            with contextlib.suppress(BlockingIOError):
                os.write(self._files[0], data)
