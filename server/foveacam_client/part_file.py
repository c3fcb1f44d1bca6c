"""A file written atomically: to a temporary file beside it, renamed when complete."""

import os
from pathlib import Path
from types import TracebackType
from typing import Self


class PartFile:
    """Writes `PATH.part`; on exit renames it to PATH, or removes it after an error."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._part = path.with_name(f"{path.name}.part")
        self._file = self._part.open("wb")

    def __enter__(self) -> Self:
        return self

    def write(self, block: bytes) -> None:
        """Append a block."""
        self._file.write(block)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._file:
            if error is None:
                self._file.flush()
                os.fsync(self._file.fileno())
        if error is None:
            self._part.replace(self._path)
        else:
            self._part.unlink(missing_ok=True)
