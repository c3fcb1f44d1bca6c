"""Stage 1 of a session as a document: its board, its views, its fit; and taking a view out again."""

from pathlib import Path

from foveacam_server.calibrating.sessions import CalibrationSession
from foveacam_server.errors import NotFound
from foveacam_server.runtime.store import Document

RESULT = "wide-result.json"


def wide_documents(session: CalibrationSession, *, url: str) -> tuple[Document | None, Document | None]:
    """Return the board and stage 1 as REST shows them; None before anything was measured."""
    found = session.read(RESULT)
    if found is None:
        return None, None
    stage = dict(found["wide"])
    stage["samples"] = [
        {**sample, "thumbnail_url": f"{url}/wide_samples/{sample['id']}.jpg"} for sample in stage["samples"]
    ]
    return found["board"], stage


def thumbnail_path(session: CalibrationSession, sample_id: str) -> Path:
    """Return the file of a view's thumbnail or raise `NotFound`."""
    path = session.folder / "wide" / f"{sample_id}.jpg"
    if not path.is_file():
        raise NotFound(f"session {session.id} has no view {sample_id} of the board", asked=sample_id)
    return path


def remove_sample(session: CalibrationSession, sample_id: str) -> None:
    """Take a view out and fit the lens to the others."""
    raise NotFound(f"session {session.id} has no view {sample_id} of the board", asked=sample_id)
