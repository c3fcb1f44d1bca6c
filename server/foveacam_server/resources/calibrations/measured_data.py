"""Protocols of what calibrations need of other resources: their sessions and drift checks."""

from pathlib import Path
from typing import Protocol

from foveacam_server.foundation.store import Document


class MeasuredSessions(Protocol):
    """The calibration sessions by their ids; every method raises `NotFound` for an unknown one."""

    def sweeps(self, session_id: str) -> tuple[Path, ...]:
        """Return the files of the session's mirror sweeps."""
        ...

    def document(self, session_id: str) -> Document:
        """Return the session as REST shows it."""
        ...

    def pictures(self, session_id: str, *, fitted: bool) -> dict[str, bytes]:
        """Return its pictures as PNGs by name; without `fitted` only those that no fit went into."""
        ...


class DriftDocuments(Protocol):
    """The drift checks that were made."""

    def every(self) -> list[Document]:
        """Return all checks as REST shows them, newest first."""
        ...
