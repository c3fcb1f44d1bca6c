"""A small file system for a server's data, which can be filled; only where one may be mounted."""

import contextlib
import subprocess
from collections.abc import Iterator
from pathlib import Path


class SmallDisk:
    """A file system and the file that fills it."""

    def __init__(self, folder: Path) -> None:
        self._ballast = folder / "ballast"

    def fill(self) -> None:
        """Use all space."""
        with contextlib.suppress(OSError), self._ballast.open("wb", buffering=0) as file:
            for block in (bytes(1 << 20), bytes(4096)):
                while file.write(block) == len(block):
                    continue

    def free(self) -> None:
        """Free the space."""
        self._ballast.unlink()


@contextlib.contextmanager
def small_disk(folder: Path, *, size_bytes: int) -> Iterator[SmallDisk | None]:
    """Mount a file system at `folder`, until the context ends; None where that is not allowed."""
    mount = ["mount", "-t", "tmpfs", "-o", f"size={size_bytes}", "foveacam-bench", str(folder)]
    try:
        mounted = subprocess.run(mount, capture_output=True, check=False).returncode == 0  # noqa: S603 - constant
    except FileNotFoundError:
        mounted = False
    try:
        yield SmallDisk(folder) if mounted else None
    finally:
        if mounted:
            subprocess.run(["umount", "--lazy", str(folder)], check=True)  # noqa: S603, S607 - constant
