"""Stage 1 of a session as a document, and the lens that it found, as they were kept."""

import hashlib
import re
from functools import lru_cache
from pathlib import Path

from foveacam_hardware.contract import NotCalibrated
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_server.calibrating.sessions import VIEWS, CalibrationSession
from foveacam_server.errors import NotFound
from foveacam_server.runtime.store import Document

RESULT = "wide-result.json"
THUMBNAILS = "wide"
"""What the procedure keeps its views in."""
_VIEW_ID = re.compile(r"[0-9a-f]{1,64}")


def wide_documents(session: CalibrationSession, *, url: str) -> tuple[Document | None, Document | None]:
    """Return the board and stage 1 as REST shows them; None before anything was measured.

    While views are being taken the newest are shown without a fit.
    """
    found = session.read(RESULT)
    if (session.folder / VIEWS).is_file():
        views = views_id(session.folder)
        if found is None or found.get("views_id") != views:
            found = _unfitted(session.folder, views)
    if found is None:
        return None, None
    stage = dict(found["wide"])
    stage["samples"] = [
        {**sample, "thumbnail_url": f"{url}/wide_samples/{sample['id']}.jpg"} for sample in stage["samples"]
    ]
    return found["board"], stage


def views_id(folder: Path) -> str:
    """Return what tells these views from others, wherever and whenever the folder is copied."""
    return hashlib.sha256((folder / VIEWS).read_bytes()).hexdigest()[:16]


@lru_cache(maxsize=4)
def _unfitted(folder: Path, views: str) -> Document:
    from foveacam_server.calibrating.wide_results import unfitted  # finding boards loads for a while

    return unfitted(folder, views)


def lens_of(session: CalibrationSession) -> Intrinsics:
    """Return the lens that stage 1 found; raise `NotCalibrated` before it has found one."""
    lens = (session.read(RESULT) or {}).get("lens")
    if lens is None:
        raise NotCalibrated(
            f"session {session.id}: the wide camera is not calibrated yet; run the step wide first",
            asked="a step that looks through the wide camera",
            found="no calibrated wide camera",
            remedy="run the step wide first",
        )
    return Intrinsics(**{**lens, "distortion": tuple(lens["distortion"])})


def thumbnail_path(session: CalibrationSession, sample_id: str) -> Path:
    """Return the file of a view's thumbnail or raise `NotFound`."""
    path = session.folder / THUMBNAILS / f"{sample_id}.jpg"
    if not _VIEW_ID.fullmatch(sample_id) or not path.is_file():
        raise no_view(session, sample_id)
    return path


def no_view(session: CalibrationSession, sample_id: str) -> NotFound:
    """Return the refusal of a view that there is not."""
    return NotFound(f"session {session.id} has no view {sample_id} of the board", asked=sample_id)
