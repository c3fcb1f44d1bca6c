"""How much of a disk is free, and how much of it recordings, captures and the like leave for the rest."""

import shutil
from pathlib import Path

from foveacam_hardware.contract import FoveaError, OutOfRange, StorageFull

RESERVE_BYTES = 512 << 20
"""Kept free on the disk for the database, the events and the ends of files: nothing large is begun that would
take from it, and a recording that has come so far ends by itself."""

FULL_BYTES = 1 << 20
"""With less free a disk is full: not one picture fits."""

KEPT_FREE = f"{RESERVE_BYTES / 1e6:.0f} MB that are kept free for the database and the events"


def free_bytes(folder: Path) -> int:
    """Return how much is free on the disk of a folder. Raise OSError."""
    return shutil.disk_usage(folder).free


def no_room(message: str, *, needed_bytes: int, free_bytes: int, remedy: str) -> FoveaError:
    """Return the error for what needs more room, the reserve included, than a disk has.

    OutOfRange where less could be asked; StorageFull where the disk is full.
    """
    kind = StorageFull if free_bytes < FULL_BYTES else OutOfRange
    return kind(message, asked=f"{needed_bytes} bytes", found=f"{free_bytes} bytes", remedy=remedy)
