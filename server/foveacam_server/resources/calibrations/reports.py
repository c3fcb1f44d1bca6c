"""The HTML report of a calibration from its session, pictures and drift checks; two calibrations compared."""

from foveacam_pipeline.calibrate.records.compare import DifferenceSpread, compare, comparison_picture
from foveacam_pipeline.calibrate.report import (
    DriftFacts,
    SessionFacts,
    drift_facts,
    report_html,
    session_facts,
)
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.store import Document
from foveacam_server.resources.calibrations.measured_data import DriftDocuments, MeasuredSessions


def report_page(calibration: Calibration, *, sessions: MeasuredSessions, drift: DriftDocuments) -> str:
    """Return one self-contained HTML page; it names the parts that are missing."""
    document = _session_of(calibration, sessions)
    facts = None if document is None else _facts(document, calibration)
    pictures: dict[str, bytes] = {}
    if facts is not None and calibration.session_id is not None:
        pictures = sessions.pictures(calibration.session_id, fitted=facts.fit is not None)
    return report_html(calibration, session=facts, pictures=pictures, drift=_drift_of(calibration, drift))


def _session_of(calibration: Calibration, sessions: MeasuredSessions) -> Document | None:
    if calibration.session_id is None:
        return None
    try:
        return sessions.document(calibration.session_id)
    except NotFound:
        return None


def _facts(document: Document, calibration: Calibration) -> SessionFacts:
    """Return the session's measurements; without a fit that made another calibration."""
    fit = document["fit"]
    if fit is not None and calibration.parent_id is None and fit["calibration_id"] != calibration.id:
        document = document | {"fit": None, "check": None}
    return session_facts(document)


def _drift_of(calibration: Calibration, drift: DriftDocuments) -> list[DriftFacts]:
    """Return the drift checks that measured or made this calibration, oldest first."""
    mine = [
        document
        for document in drift.every()
        if calibration.id in (document["calibration_id"], document["new_calibration_id"])
    ]
    return [drift_facts(document) for document in reversed(mine)]


def compare_calibrations(a: Calibration, b: Calibration) -> tuple[Document, bytes]:
    """Return the differences of b from a as a document and as a PNG."""
    found = compare(a, b)
    document: Document = {
        "a": found.a,
        "b": found.b,
        "distance_m": found.distance_m,
        "pointing_difference_px": _spread(found.pointing),
        "epipolar_difference_px": _spread(found.epipolar),
        "disparity_difference_px": _spread(found.disparity),
        "wide_px": _spread(found.wide),
        "baseline_m": round(found.baseline_m, 7),
    }
    return document, comparison_picture(found)


def _spread(spread: DifferenceSpread) -> Document:
    return {"rms": round(spread.rms_px, 4), "max": round(spread.max_px, 4)}
