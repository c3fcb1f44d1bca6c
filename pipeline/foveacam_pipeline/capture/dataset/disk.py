"""Files that are on the disk when a call returns, and errors of the disk in words.

A file gets its name only when its content is on the disk; the folder's own entry is made durable by
`sync_folder`, once for several files.
"""

import errno
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from foveacam_hardware.contract import DeviceFault, FoveaError, StorageFull

PART = ".part"
"""How the name of a file ends that is not finished; it begins with a dot."""
AGAIN = "then try again"
"""What follows once a disk is mended, where nothing better is said."""
_FULL = (errno.ENOSPC, errno.EDQUOT)
_NOT_WRITABLE = (errno.EROFS, errno.EACCES, errno.EPERM, errno.EEXIST, errno.ENOTDIR)


def part_of(path: Path) -> Path:
    """Return the name under which `path` is written before it is finished."""
    return path.with_name(f".{path.name}{PART}")


def write_part(path: Path, content: bytes | memoryview) -> None:
    """Put `content` on the disk under the temporary name of `path`. Raise OSError."""
    with part_of(path).open("wb", buffering=0) as file:
        rest = memoryview(content)
        while rest:
            rest = rest[file.write(rest) :]
        os.fsync(file.fileno())


def finish_part(path: Path) -> None:
    """Give a file its name; it is durable after `sync_folder`. Raise OSError."""
    part_of(path).replace(path)


def sync_folder(folder: Path) -> None:
    """Make the names in `folder` durable. Raise OSError."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def write_file(path: Path, content: bytes | memoryview) -> None:
    """Write one file whole, over an older one, durably. Raise OSError."""
    try:
        write_part(path, content)
        finish_part(path)
    finally:
        part_of(path).unlink(missing_ok=True)
    sync_folder(path.parent)


@contextmanager
def disk_errors(what: str, folder: Path, *, again: str = AGAIN) -> Iterator[None]:
    """Turn an OSError inside into StorageFull or DeviceFault: what was written, where, and what to do."""
    try:
        yield
    except OSError as error:
        raise disk_fault(error, what=what, folder=folder, again=again) from error


def disk_fault(error: OSError, *, what: str, folder: Path, again: str = AGAIN) -> FoveaError:
    """Return the error of the contract for an OSError met while writing."""
    found, remedy = disk_words(error, folder, again=again)
    kind = disk_kind(error)
    return kind(f"{what} in {folder}: {found}; {remedy}", asked=what, found=found, remedy=remedy)


def disk_kind(error: OSError) -> type[FoveaError]:
    """Return StorageFull for a disk that refuses to be written, DeviceFault for one that failed."""
    return StorageFull if error.errno in (*_FULL, *_NOT_WRITABLE) else DeviceFault


def takes_no_more(error: OSError) -> bool:
    """Tell whether an OSError, of whatever call, can only be that of a disk that takes no more."""
    return error.errno in (*_FULL, errno.EROFS)


def disk_words(error: OSError, folder: Path, *, again: str = AGAIN) -> tuple[str, str]:
    """Return what ails the disk of a folder, and what to do; `again`: what follows once it is mended."""
    if error.errno == errno.EDQUOT:
        return f"the quota of the disk is used up ({_free(folder)})", f"free some space, {again}"
    if error.errno == errno.ENOSPC:
        return f"the disk is full ({_free(folder)})", f"free some space, {again}"
    if error.errno in _NOT_WRITABLE:
        return f"the disk cannot be written ({error.strerror})", f"make the folder writable, {again}"
    return f"the disk failed ({error.strerror or error})", f"check the disk, {again}"


def _free(folder: Path) -> str:
    try:
        return f"{shutil.disk_usage(folder).free / 1e6:.1f} MB free"
    except OSError:
        return "free space unknown"
