"""The settle time that a session has measured, read from what the step settle left there."""

from foveacam_hardware.contract import NotCalibrated
from foveacam_pipeline.calibrate.settle.settle_report import load_settle
from foveacam_server.calibrating.documents import SETTLE
from foveacam_server.calibrating.sessions import CalibrationSession
from foveacam_server.calibrating.settle_times import SettleTime

REPORT = "settle.json"


def measured_time(session: CalibrationSession) -> SettleTime:
    """Return the wait that follows from a session's settle report; raise `NotCalibrated` without one."""
    settle_us = (session.read(SETTLE) or {}).get("settle_us")
    if settle_us is None:
        raise NotCalibrated(
            f"session {session.id} has not measured how the mirrors settle; run the step settle first",
            asked="the measured settle time in use",
            found="no settle time was measured",
            remedy="run the step settle first",
        )
    report = load_settle(session.folder / REPORT)
    return SettleTime(
        rig_id=report.rig_id,
        settle_us=int(settle_us),
        measured_utc=report.created_utc,
        session_id=session.id,
        low_pass_hz=report.low_pass_hz,
    )
