"""The HTML report of a calibration from its session, pictures and drift checks."""

from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.foundation.errors import NotFound
from foveacam_server.resources.calibrating.calibrations.measured_data import (
    MeasuredAcceptances,
    MeasuredDrift,
    MeasuredSessions,
)
from foveacam_server.resources.calibrating.report.page import report_html
from foveacam_server.resources.calibrating.sessions.schema import SessionDocument


def report_page(
    calibration: Calibration,
    *,
    sessions: MeasuredSessions,
    drift: MeasuredDrift,
    acceptances: MeasuredAcceptances,
) -> str:
    """Return one self-contained HTML page; it names the parts that are missing."""
    facts = _session_of(calibration, sessions)
    pictures: dict[str, bytes] = {}
    if facts is not None and calibration.session_id is not None:
        pictures = sessions.pictures(calibration.session_id, fitted=facts.fit is not None)
    return report_html(
        calibration,
        session=facts,
        pictures=pictures,
        drift=drift.of(calibration.id),
        acceptances=acceptances.of(calibration.id),
    )


def _session_of(calibration: Calibration, sessions: MeasuredSessions) -> SessionDocument | None:
    """Return the session's measurements, without a fit that made another calibration; None when unknown."""
    if calibration.session_id is None:
        return None
    try:
        facts = sessions.describe(calibration.session_id)
    except NotFound:
        return None
    if facts.fit is None or calibration.parent_id is not None or facts.fit.calibration_id == calibration.id:
        return facts
    return facts.model_copy(update={"fit": None, "check": None})
