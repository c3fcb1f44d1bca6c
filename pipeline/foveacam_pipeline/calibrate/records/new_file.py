"""Files that are written whole or not at all, and never over another."""

import os
from pathlib import Path

from foveacam_hardware.contract import InvalidInput


def write_new(path: Path, content: str | bytes) -> None:
    """Write `content` to `path`: on disk first, then named; a file that says the same may be there."""
    data = content.encode("utf-8") if isinstance(content, str) else content
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with temporary.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        link_new(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def link_new(temporary: Path, path: Path) -> None:
    """Give a finished file its name, unless another content has that name: then raise InvalidInput."""
    try:
        path.hardlink_to(temporary)
    except FileExistsError as error:
        if path.read_bytes() != temporary.read_bytes():
            raise InvalidInput(
                f"{path} exists already with another content, nothing was overwritten; "
                "give another name or move that file away"
            ) from error
