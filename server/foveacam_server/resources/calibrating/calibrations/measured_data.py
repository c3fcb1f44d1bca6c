"""Protocols of what calibrations need of other resources: their sessions and drift checks."""

from pathlib import Path
from typing import Protocol

from foveacam_server.resources.calibrating.drift_checks.schema import DriftCheckDocument
from foveacam_server.resources.calibrating.sessions.schema import SessionDocument


class MeasuredSessions(Protocol):
    """The calibration sessions by their ids; every method raises `NotFound` for an unknown one."""

    def sweeps(self, session_id: str) -> tuple[Path, ...]:
        """Return the files of the session's mirror sweeps."""
        ...

    def describe(self, session_id: str) -> SessionDocument:
        """Return the session's measurements."""
        ...

    def pictures(self, session_id: str, *, fitted: bool) -> dict[str, bytes]:
        """Return its pictures as PNGs by name; without `fitted` only those that no fit went into."""
        ...


class MeasuredDrift(Protocol):
    """The drift checks that were made."""

    def of(self, calibration_id: str) -> list[DriftCheckDocument]:
        """Return the checks that measured or made a calibration, oldest first."""
        ...
