"""Atomic writing of files that never overwrites a file of other content."""

import os
from pathlib import Path

from foveacam_hardware.contract import InvalidInput


def write_new(path: Path, content: str | bytes) -> None:
    """Write `content` to `path` atomically; a file of the same content may exist there."""
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
    """Link a finished file to `path`; raise InvalidInput when other content is there."""
    try:
        path.hardlink_to(temporary)
    except FileExistsError as error:
        if path.read_bytes() != temporary.read_bytes():
            raise InvalidInput(
                f"{path} exists already with another content, nothing was overwritten; "
                "give another name or move that file away"
            ) from error
