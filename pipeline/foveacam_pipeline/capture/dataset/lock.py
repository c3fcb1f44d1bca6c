"""A lock that lets one writer at a time into a dataset's folder, and ends with its process."""

import fcntl
import os
import struct
from pathlib import Path

from foveacam_hardware.contract import Busy

LOCK = ".lock"
_FLOCK = "hhqqi4x"
"""struct flock of 64-bit Linux: type, whence, start, length, pid."""


class FolderLock:
    """The writer's lock of a folder; raises Busy, which names `what` it is, when another writer holds it."""

    def __init__(self, folder: Path, *, what: str = "dataset") -> None:
        self._descriptor = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        try:
            fcntl.fcntl(self._descriptor, fcntl.F_OFD_SETLK, _whole_file(fcntl.F_WRLCK))
        except OSError as error:
            self.release()
            raise Busy(
                f"{what} {folder} is being written already; wait until it ends, or cancel it there"
            ) from error

    def release(self) -> None:
        """Release the lock; do nothing when it is released already."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1


def is_being_written(folder: Path) -> bool:
    """Return whether a writer, in this process or another, has locked the dataset."""
    try:
        descriptor = os.open(folder / LOCK, os.O_RDONLY | os.O_CLOEXEC)
    except OSError:
        return False
    try:
        answer = fcntl.fcntl(descriptor, fcntl.F_OFD_GETLK, _whole_file(fcntl.F_WRLCK))
    finally:
        os.close(descriptor)
    kind: int = struct.unpack(_FLOCK, answer)[0]
    return kind != fcntl.F_UNLCK


def _whole_file(kind: int) -> bytes:
    return struct.pack(_FLOCK, kind, os.SEEK_SET, 0, 0, 0)
