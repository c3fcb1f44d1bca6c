"""Free space of a disk, and the reserve that recordings, captures and other large files must leave."""

import shutil
from pathlib import Path

from foveacam_hardware.contract import FoveaError, OutOfRange, StorageFull

RESERVE_BYTES = 512 << 20
"""Space reserved for the database, the events and the ends of files: no large write is started that would use
it, and a recording that reaches it ends."""

FULL_BYTES = 1 << 20
"""Free space below which a disk counts as full: not one image fits."""

RESERVE_TEXT = f"{RESERVE_BYTES / 1e6:.0f} MB that are kept free for the database and the events"


def free_bytes(folder: Path) -> int:
    """Return the free space of a folder's disk, bytes. Raise OSError."""
    return shutil.disk_usage(folder).free


def free_space_error(statement: str, *, needed_bytes: int, free_bytes: int, remedy: str) -> FoveaError:
    """Return the error for a request that needs more free space, the reserve included, than there is.

    OutOfRange where a smaller request could fit; StorageFull where the disk is full.
    """
    kind = StorageFull if free_bytes < FULL_BYTES else OutOfRange
    return kind(statement, asked=f"{needed_bytes} bytes", found=f"{free_bytes} bytes", remedy=remedy)
