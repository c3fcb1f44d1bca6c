"""Appends buffers to one new file without joining them first, and truncates it after a failed write."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Protocol, TypeAlias

from foveacam_hardware.contract import FoveaError, InvalidInput
from foveacam_pipeline.storage.disk import describe_disk_error, disk_error_class, disk_fault

Buffer: TypeAlias = bytes | memoryview
MOST_BUFFERS = 512
"""Buffers per system call, which allows at least 1024."""


class RecordingDisk(Protocol):
    """The file of a recording. Every call may raise `OSError`."""

    def append(self, buffers: Sequence[Buffer]) -> None:
        """Write all buffers at the end, in order."""
        ...

    def truncate(self, length: int) -> None:
        """Truncate the file to `length` bytes."""
        ...

    def close(self) -> None:
        """Sync the file to disk and close it."""
        ...


class FileDisk:
    """A new file; opening it fails if the file exists."""

    def __init__(self, path: Path) -> None:
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_CLOEXEC", 0)
        self._file = os.open(path, flags, 0o644)

    def append(self, buffers: Sequence[Buffer]) -> None:
        """Write all buffers; the system may write them in parts."""
        left = [memoryview(buffer) for buffer in buffers if len(buffer)]
        while left:
            taken = os.writev(self._file, left[:MOST_BUFFERS])
            while left and taken >= len(left[0]):
                taken -= len(left.pop(0))
            if left and taken:
                left[0] = left[0][taken:]

    def truncate(self, length: int) -> None:
        """Truncate the file and continue writing from there."""
        os.ftruncate(self._file, length)
        os.lseek(self._file, length, os.SEEK_SET)

    def close(self) -> None:
        """Sync and close; do nothing when closed."""
        file, self._file = self._file, -1
        if file >= 0:
            try:
                os.fsync(file)
            finally:
                os.close(file)


def new_recording_file(path: Path) -> RecordingDisk:
    """Return a new file at `path`; raise `InvalidInput` for a name in use, else as `disk_fault`."""
    try:
        return FileDisk(path)
    except FileExistsError as error:
        raise InvalidInput(f"recording {path}: there is such a file already; give another name") from error
    except FileNotFoundError as error:
        raise InvalidInput(f"recording {path}: there is no folder {path.parent}; make it") from error
    except ValueError as error:
        raise InvalidInput(f"recording {path}: that is no name for a file ({error}); give another") from error
    except OSError as error:
        raise disk_fault(error, what=f"recording {path.name}", folder=path.parent) from error


def recording_disk_error(path: Path, error: OSError, *, content: str) -> FoveaError:
    """Return the error that ended a recording, for the operator; `content`: what the file contains."""
    found, remedy = describe_disk_error(error, path.parent, again="or choose another one, and record anew")
    return disk_error_class(error)(
        f"recording {path}: the disk took no more: {found}; {content}",
        asked="write a recording",
        found=found,
        remedy=remedy,
    )
