"""Protocols by which calibrations read what other resources have measured with them."""

from pathlib import Path
from typing import Protocol

from foveacam_server.resources.calibrating.acceptances.schema import AcceptanceDocument
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
        """Return the session's pictures as PNGs by name; without `fitted` only those independent of a fit."""
        ...


class MeasuredDrift(Protocol):
    """Read access to the drift checks."""

    def of(self, calibration_id: str) -> list[DriftCheckDocument]:
        """Return the checks that measured or made a calibration, oldest first."""
        ...


class MeasuredAcceptances(Protocol):
    """Read access to the acceptance runs."""

    def of(self, calibration_id: str) -> list[AcceptanceDocument]:
        """Return the runs that judged a calibration, newest first."""
        ...
