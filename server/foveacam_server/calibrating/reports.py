"""The report of a calibration from what is kept of it: its session, its pictures, its drift checks."""

from pathlib import Path

from foveacam_hardware.contract import FoveaError
from foveacam_pipeline.calibrate.report import (
    DriftFacts,
    SessionFacts,
    drift_facts,
    report_html,
    session_facts,
)
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.calibrating.documents import session_document
from foveacam_server.calibrating.drift_records import DriftRecords
from foveacam_server.calibrating.pictures import MEASURED, TITLES
from foveacam_server.calibrating.sessions import CalibrationSession, SessionCollection


def report_page(calibration: Calibration, *, sessions: SessionCollection, drift: DriftRecords) -> str:
    """Return one self-contained HTML page; what is not kept is said to be missing."""
    session = _session_of(calibration, sessions)
    told = None if session is None else _facts(session, calibration)
    return report_html(
        calibration,
        session=told,
        pictures={}
        if session is None
        else _pictures(session, fitted=told is not None and told.fit is not None),
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
    """Return what was measured; a fit of the same data that made another calibration is left out."""
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
    """Return the checks of this calibration and the one that it came of, oldest first."""
    mine = [
        document
        for document in drift.every()
        if calibration.id in (document["calibration_id"], document["new_calibration_id"])
    ]
    return [drift_facts(document) for document in reversed(mine)]
