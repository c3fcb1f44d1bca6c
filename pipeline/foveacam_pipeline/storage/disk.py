"""Atomic, durable writes and disk errors, for every package of the pipeline and for the server.

A file gets its name only after its content is on the disk. `sync_folder` makes the entries of a folder
durable, once for several files.
"""

import errno
import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from foveacam_hardware.contract import DeviceFault, FoveaError, InvalidInput, StorageFull

PRIVATE = 0o600
"""Mode of a file that its owner alone may read: it holds secrets."""
PART = ".part"
"""Suffix of an unfinished file, whose name begins with a dot."""
TRY_AGAIN = "then try again"
"""Default advice of an error for the time after the disk is repaired."""
_FULL = (errno.ENOSPC, errno.EDQUOT)
_NO_NAME = (errno.ENAMETOOLONG, errno.EILSEQ)
_NOT_WRITABLE = (errno.EROFS, errno.EACCES, errno.EPERM, errno.EEXIST, errno.ENOTDIR)


def part_path(path: Path) -> Path:
    """Return the temporary name of an unfinished `path`."""
    return path.with_name(f".{path.name}{PART}")


def write_part(path: Path, content: bytes | memoryview, *, mode: int | None = None) -> None:
    """Write `content` durably under the temporary name of `path`; `mode`: its permissions. Raise OSError."""
    with part_path(path).open("wb", buffering=0) as file:
        if mode is not None:
            os.fchmod(file.fileno(), mode)  # before there is anything to read
        rest = memoryview(content)
        while rest:
            rest = rest[file.write(rest) :]
        os.fsync(file.fileno())


def finish_part(path: Path) -> None:
    """Rename an unfinished file to `path`; the rename is durable after `sync_folder`. Raise OSError."""
    part_path(path).replace(path)


def sync_folder(folder: Path) -> None:
    """Make the entries of `folder` durable. Raise OSError."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def rename_durably(path: Path, target: Path, *, rename: Callable[[Path, Path], object] = Path.rename) -> None:
    """Move `path` to `target` on its disk; durable in both folders after a power cut. Raise OSError."""
    target.parent.mkdir(parents=True, exist_ok=True)
    rename(path, target)
    sync_folder(target.parent)  # before the other: a cut between them leaves two names, not none
    sync_folder(path.parent)


def write_file(path: Path, content: bytes | memoryview, *, mode: int | None = None) -> None:
    """Write one file atomically and durably over an older one; `mode`: its permissions. Raise OSError."""
    try:
        write_part(path, content, mode=mode)
        finish_part(path)
    finally:
        part_path(path).unlink(missing_ok=True)
    sync_folder(path.parent)


def check_name(path: Path, *, name: str) -> None:
    """Raise `InvalidInput` for a path that the file system or its encoding cannot have; nothing is created.

    `name`: the name as the user gave it.
    """
    try:
        os.lstat(part_path(path))  # which is longer than the file's own name
    except (OSError, ValueError) as error:  # ValueError: NUL, or no character of the encoding
        if isinstance(error, OSError) and error.errno not in _NO_NAME:
            return  # there is no such file, as should be; what else is wrong is met when it is written
        found = _refused_name(error)
        raise InvalidInput(f"name {name!r}: {found}", asked=name, found=found, remedy=_OTHER_NAME) from error


def _refused_name(error: OSError | ValueError) -> str:
    return f"the file system takes no such name ({getattr(error, 'strerror', None) or error})"


_OTHER_NAME = "choose a shorter name of plain letters"


@contextmanager
def disk_errors(what: str, folder: Path, *, again: str = TRY_AGAIN) -> Iterator[None]:
    """Turn an OSError raised inside into StorageFull or DeviceFault; arguments as for `disk_fault`."""
    try:
        yield
    except OSError as error:
        raise disk_fault(error, what=what, folder=folder, again=again) from error


def disk_fault(error: OSError, *, what: str, folder: Path, again: str = TRY_AGAIN) -> FoveaError:
    """Return the contract's error for an OSError raised while writing.

    `what`: what was written. `again`: what to do after the disk is repaired.
    """
    found, remedy = describe_disk_error(error, folder, again=again)
    kind = disk_error_class(error)
    return kind(f"{what} in {folder}: {found}", asked=what, found=found, remedy=remedy)


def disk_error_class(error: OSError) -> type[FoveaError]:
    """Return StorageFull for a disk that is full or not writable, DeviceFault for one that failed.

    InvalidInput for a name that the file system cannot have.
    """
    if error.errno in _NO_NAME:
        return InvalidInput
    return StorageFull if error.errno in (*_FULL, *_NOT_WRITABLE) else DeviceFault


def is_disk_exhausted(error: OSError) -> bool:
    """Return whether an OSError, whatever call raised it, can only mean a full or read-only disk."""
    return error.errno in (*_FULL, errno.EROFS)


def describe_disk_error(error: OSError, folder: Path, *, again: str = TRY_AGAIN) -> tuple[str, str]:
    """Return the cause of a disk error and its remedy; `again`: the user's next step after the repair."""
    if error.errno == errno.EDQUOT:
        return f"the quota of the disk is used up ({_free(folder)})", f"free some space, {again}"
    if error.errno == errno.ENOSPC:
        return f"the disk is full ({_free(folder)})", f"free some space, {again}"
    if error.errno in _NO_NAME:
        return _refused_name(error), _OTHER_NAME
    if error.errno in _NOT_WRITABLE:
        return f"the disk cannot be written ({error.strerror})", f"make the folder writable, {again}"
    return f"the disk failed ({error.strerror or error})", f"check the disk, {again}"


def _free(folder: Path) -> str:
    try:
        return f"{shutil.disk_usage(folder).free / 1e6:.1f} MB free"
    except OSError:
        return "free space unknown"
