"""The stored result of stage 1: its REST documents, its lens, its thumbnails. It imports no fitting code."""

import hashlib
import re
from functools import lru_cache
from pathlib import Path

from foveacam_hardware.contract import NotCalibrated
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.store import Document
from foveacam_server.resources.calibration_sessions.sessions import VIEWS, CalibrationSession

RESULT = "wide-result.json"
THUMBNAILS = "wide"
"""Folder of the views' thumbnails."""
_VIEW_ID = re.compile(r"[0-9a-f]{1,64}")


def wide_documents(session: CalibrationSession, *, url: str) -> tuple[Document | None, Document | None]:
    """Return the board and stage 1 as REST documents; None before any view was taken.

    While views are being taken the newest are returned without a fit.
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
    """Return the hash of the views' file, which stays the same when the folder is copied."""
    return hashlib.sha256((folder / VIEWS).read_bytes()).hexdigest()[:16]


@lru_cache(maxsize=4)
def _unfitted(folder: Path, views: str) -> Document:
    from foveacam_server.resources.calibration_sessions.wide_results import (
        unfitted_result,  # board detection is slow to import
    )

    return unfitted_result(folder, views)


def lens_of(session: CalibrationSession) -> Intrinsics:
    """Return the fitted lens of stage 1; raise `NotCalibrated` before there is one."""
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
    """Return the path of a view's thumbnail or raise `NotFound`."""
    path = session.folder / THUMBNAILS / f"{sample_id}.jpg"
    if not _VIEW_ID.fullmatch(sample_id) or not path.is_file():
        raise no_view(session, sample_id)
    return path


def no_view(session: CalibrationSession, sample_id: str) -> NotFound:
    """Return the error for a view that does not exist."""
    return NotFound(f"session {session.id} has no view {sample_id} of the board", asked=sample_id)
