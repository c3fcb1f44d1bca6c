"""Which steps of a session came to their end, and what they were told: a run that goes on leaves them out."""

from foveacam_server.calibrating.sessions import CalibrationSession
from foveacam_server.runtime.store import Document

FILE = "finished.json"


def finish(session: CalibrationSession, step: str, how: Document) -> None:
    """Write down that a step came to its end; `how`: what would make another run of it something else."""
    session.write(FILE, (session.read(FILE) or {}) | {step: how})


def finished(session: CalibrationSession, step: str) -> Document | None:
    """Return how a step came to its end; None when it did not yet."""
    found: Document | None = (session.read(FILE) or {}).get(step)
    return found
