"""REST documents of a calibration session and of its mirror sweeps, read from the session's folder."""

import math
from collections.abc import Callable
from functools import lru_cache, partial
from pathlib import Path

from foveacam_hardware.contract import FoveaError, NotCalibrated, Role
from foveacam_pipeline.calibrate.records.aggregate import sweep_paths
from foveacam_pipeline.calibrate.settle.settle_report import load_settle
from foveacam_pipeline.calibrate.sweep.sweep import Sweep, SweepPose
from foveacam_pipeline.calibrate.sweep.sweep_file import load_sweep
from foveacam_server.foundation.store import Document
from foveacam_server.resources.calibration_sessions.pictures import picture_bytes, picture_documents
from foveacam_server.resources.calibration_sessions.sessions import (
    CHECK,
    DRIFT,
    FIT,
    SETTLE,
    SETTLE_REPORT,
    CalibrationSession,
    SessionCollection,
)
from foveacam_server.resources.calibration_sessions.wide_documents import wide_documents
from foveacam_server.rig.settle_times import SettleTime


def session_document(
    session: CalibrationSession,
    *,
    url: str,
    running: str | None,
    in_use: SettleTime | None = None,
) -> Document:
    """Return a session as a REST document; a part that cannot be read is null and named in `problems`.

    `in_use`: the measured settle time in use, of whichever session.
    """
    head = session.head
    problems: list[str] = []

    def part(read: Callable[[], object]) -> object:
        try:
            return read()
        except FoveaError as error:
            problems.append(str(error))
            return None

    wide = part(lambda: wide_documents(session, url=url))
    board, stage = wide if isinstance(wide, tuple) else (None, None)
    sweeps = [part(partial(sweep_document, path)) for path in sweep_paths(session.folder)]
    return {
        "id": head.id,
        "label": head.label,
        "rig_id": head.rig_id,
        "created_utc": head.created_utc,
        "bytes": session.bytes,
        "board": board,
        "wide": stage,
        "sweeps": [sweep for sweep in sweeps if sweep is not None],
        "fit": part(lambda: session.read(FIT)),
        "closing": part(lambda: session.read(DRIFT)),
        "settle": part(lambda: _settle(session, in_use)),
        "check": part(lambda: session.read(CHECK)),
        "pictures": picture_documents(session, url=url),
        "calibrations": list(head.calibrations),
        "running": running,
        "problems": problems,
    }


class SessionReader:
    """Reads what reports and exports of calibrations need of their sessions, each by its id."""

    def __init__(self, sessions: SessionCollection) -> None:
        self._sessions = sessions

    def sweeps(self, session_id: str) -> tuple[Path, ...]:
        """Return the files of a session's mirror sweeps or raise `NotFound`."""
        return sweep_paths(self._sessions.get(session_id).folder)

    def document(self, session_id: str) -> Document:
        """Return a session as a REST document or raise `NotFound`."""
        return session_document(self._sessions.get(session_id), url="", running=None)

    def pictures(self, session_id: str, *, fitted: bool) -> dict[str, bytes]:
        """Return a session's pictures as PNGs by name or raise `NotFound`."""
        return picture_bytes(self._sessions.get(session_id), fitted=fitted)


def _settle(session: CalibrationSession, in_use: SettleTime | None) -> Document | None:
    found = session.read(SETTLE)
    if found is None:
        return None
    mine = (session.id, found.get("settle_us"))
    return found | {"applied": in_use is not None and (in_use.session_id, in_use.settle_us) == mine}


WAITING = "waiting"


def sweep_document(path: Path) -> Document:
    """Return one sweep as a REST document; raise `InvalidInput` for a damaged file."""
    state = path.stat()
    return _document(path, state.st_mtime_ns, state.st_size)


@lru_cache(maxsize=64)
def _document(path: Path, changed_ns: int, size: int) -> Document:
    """Return the document of a sweep file in this state; cached, for the page polls every second."""
    del changed_ns, size
    sweep = load_sweep(path)
    return {
        "station": sweep.header.station.name,
        "distance_m": sweep.header.station.distance_m,
        "nodes": sweep.header.plan.columns * sweep.header.plan.rows,
        "done": len(sweep.poses),
        "poses": pose_documents(sweep),
    }


def pose_documents(sweep: Sweep) -> list[Document]:
    """Return every planned pose, in the order of measuring."""
    visited = {pose.index: pose for pose in sweep.poses}
    documents = []
    for index, (ax_rad, ay_rad) in enumerate(sweep.header.plan.nodes_rad().tolist()):
        pose = visited.get(index)
        documents.append(
            {
                "index": index,
                "ax_deg": round(math.degrees(ax_rad), 4),
                "ay_deg": round(math.degrees(ay_rad), 4),
                "left": eye_state(pose, Role.LEFT),
                "right": eye_state(pose, Role.RIGHT),
                "left_reason": None if pose is None else pose.refusal(Role.LEFT),
                "right_reason": None if pose is None else pose.refusal(Role.RIGHT),
            }
        )
    return documents


def eye_state(pose: SweepPose | None, role: Role) -> str:
    """Return the state of one eye at a pose: waiting, refused, rim or centred."""
    if pose is None:
        return WAITING
    measured = pose.eye(role)
    if measured is None:
        return "refused"
    return "rim" if measured.rim else "centred"


def measured_time(session: CalibrationSession) -> SettleTime:
    """Return the settle time that a session measured; raise `NotCalibrated` before it has."""
    settle_us = (session.read(SETTLE) or {}).get("settle_us")
    if settle_us is None:
        raise NotCalibrated(
            f"session {session.id} has not measured how the mirrors settle; run the step settle first",
            asked="the measured settle time in use",
            found="no settle time was measured",
            remedy="run the step settle first",
        )
    report = load_settle(session.folder / SETTLE_REPORT)
    return SettleTime(
        rig_id=report.rig_id,
        settle_us=int(settle_us),
        measured_utc=report.created_utc,
        session_id=session.id,
        low_pass_hz=report.low_pass_hz,
    )
