"""The HTML report of a calibration from its session, pictures and drift checks; two calibrations compared."""

from pathlib import Path

from foveacam_hardware.contract import FoveaError
from foveacam_pipeline.calibrate.records.compare import DifferenceSpread, compare, comparison_picture
from foveacam_pipeline.calibrate.report import (
    DriftFacts,
    SessionFacts,
    drift_facts,
    report_html,
    session_facts,
)
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.foundation.store import Document
from foveacam_server.resources.calibration_sessions.documents import session_document
from foveacam_server.resources.calibration_sessions.pictures import MEASURED, TITLES
from foveacam_server.resources.calibration_sessions.sessions import CalibrationSession, SessionCollection
from foveacam_server.resources.drift_checks.records import DriftRecords


def report_page(calibration: Calibration, *, sessions: SessionCollection, drift: DriftRecords) -> str:
    """Return one self-contained HTML page; it names the parts that are missing."""
    session = _session_of(calibration, sessions)
    facts = None if session is None else _facts(session, calibration)
    return report_html(
        calibration,
        session=facts,
        pictures={}
        if session is None
        else _pictures(session, fitted=facts is not None and facts.fit is not None),
        drift=_drift_of(calibration, drift),
    )


def _session_of(calibration: Calibration, sessions: SessionCollection) -> CalibrationSession | None:
    if calibration.session_id is None:
        return None
    try:
        return sessions.get(calibration.session_id)
    except FoveaError:
        return None


def _facts(session: CalibrationSession, calibration: Calibration) -> SessionFacts:
    """Return the session's measurements; without a fit that made another calibration."""
    document = session_document(session, url="", running=None)
    fit = document["fit"]
    if fit is not None and calibration.parent_id is None and fit["calibration_id"] != calibration.id:
        document = document | {"fit": None, "check": None}
    return session_facts(document)


def _pictures(session: CalibrationSession, *, fitted: bool) -> dict[str, bytes]:
    shown = TITLES if fitted else [name for name in TITLES if name in MEASURED]
    paths = {name: Path(session.folder / "pictures" / f"{name}.png") for name in shown}
    return {name: path.read_bytes() for name, path in paths.items() if path.is_file()}


def _drift_of(calibration: Calibration, drift: DriftRecords) -> list[DriftFacts]:
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
