"""How much of a disk is free, and how much of it recordings, captures and the like leave for the rest."""

import shutil
from pathlib import Path

RESERVE_BYTES = 512 << 20
"""Kept free on the disk for the database, the events and the ends of files: nothing large is begun that would
take from it, and a recording that has come so far ends by itself."""

KEPT_FREE = f"{RESERVE_BYTES / 1e6:.0f} MB that are kept free for the database and the events"


def free_bytes(folder: Path) -> int:
    """Return how much is free on the disk of a folder. Raise OSError."""
    return shutil.disk_usage(folder).free
