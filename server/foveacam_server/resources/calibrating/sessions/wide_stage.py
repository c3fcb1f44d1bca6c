"""The stored result of stage 1: its description, its lens, its thumbnails. It imports no fitting code."""

import hashlib
import re
from functools import lru_cache
from pathlib import Path

from pydantic import BaseModel

from foveacam_hardware.contract import NotCalibrated, Role
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_server.foundation.errors import NotFound
from foveacam_server.resources.calibrating.sessions.options import LensModel
from foveacam_server.resources.calibrating.sessions.schema import BoardDocument, WideStageDocument
from foveacam_server.resources.calibrating.sessions.sessions import VIEWS, CalibrationSession, SessionFile


class WideResult(BaseModel):
    """Result of stage 1. `views_id`: of the views that it was computed from; `model`: the one asked for."""

    views_id: str | None = None
    board: BoardDocument
    model: LensModel | None = None
    lens: Intrinsics | None
    wide: WideStageDocument


RESULT = SessionFile(name="wide-result.json", schema=WideResult)
_VIEW_ID = re.compile(r"[0-9a-f]{1,64}")


def describe_wide(session: CalibrationSession, *, url: str) -> tuple[BoardDocument, WideStageDocument] | None:
    """Return the document of the board and stage 1; None before any view was taken.

    While views are being taken the newest are returned without a fit.
    """
    found = session.read(RESULT)
    if (session.folder / VIEWS).is_file():
        views = views_id(session.folder)
        if found is None or found.views_id != views:
            found = _unfitted(session.folder, views)
    if found is None:
        return None
    samples = [
        sample.model_copy(update={"thumbnail_url": f"{url}/wide_samples/{sample.id}.jpg"})
        for sample in found.wide.samples
    ]
    return found.board, found.wide.model_copy(update={"samples": samples})


def views_id(folder: Path, file: str = VIEWS) -> str:
    """Return the hash of the file of views, which stays the same when the folder is copied."""
    return hashlib.sha256((folder / file).read_bytes()).hexdigest()[:16]


@lru_cache(maxsize=4)
def _unfitted(folder: Path, views: str) -> WideResult:
    from foveacam_server.resources.calibrating.sessions.wide_step import (
        unfitted_result,  # board detection is slow to import
    )

    return unfitted_result(folder, views)


def lens_of(session: CalibrationSession) -> Intrinsics:
    """Return the fitted lens of stage 1; raise `NotCalibrated` before there is one."""
    found = session.read(RESULT)
    if found is None or found.lens is None:
        raise NotCalibrated(
            f"session {session.id}: the wide camera is not calibrated yet",
            asked="a step that looks through the wide camera",
            found="no calibrated wide camera",
            remedy="run the step wide first",
        )
    return found.lens


def thumbnail_path(session: CalibrationSession, sample_id: str, role: Role = Role.WIDE) -> Path:
    """Return the path of the thumbnail of a camera's view or raise `NotFound`."""
    path = session.folder / role.value / f"{sample_id}.jpg"
    if not _VIEW_ID.fullmatch(sample_id) or not path.is_file():
        raise no_view(session, sample_id)
    return path


def no_view(session: CalibrationSession, sample_id: str) -> NotFound:
    """Return the error for a view that does not exist."""
    return NotFound(f"session {session.id} has no view {sample_id} of the board", asked=sample_id)
