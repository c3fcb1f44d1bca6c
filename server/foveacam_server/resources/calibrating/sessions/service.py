"""Serves calibration sessions: their description and files, and their steps as jobs."""

from collections.abc import Sequence
from pathlib import Path

from foveacam_hardware.contract import Role
from foveacam_pipeline.storage.disk import disk_errors
from foveacam_server.foundation.job_table import Job
from foveacam_server.resources.calibrating.sessions.descriptions import describe_session, measured_time
from foveacam_server.resources.calibrating.sessions.options import Run
from foveacam_server.resources.calibrating.sessions.pictures import picture_path
from foveacam_server.resources.calibrating.sessions.runs import (
    SESSIONS_URL,
    CalibrationJobTools,
    CalibrationRuns,
)
from foveacam_server.resources.calibrating.sessions.schema import SessionDocument
from foveacam_server.resources.calibrating.sessions.sessions import CalibrationSession, SessionCollection
from foveacam_server.resources.calibrating.sessions.wide_stage import thumbnail_path
from foveacam_server.rig import refusals
from foveacam_server.rig.settle_times import SettleTime


class CalibrationSessionService:
    """The calibration sessions of this rig: create, describe, delete, run steps."""

    def __init__(self, sessions: SessionCollection, tools: CalibrationJobTools) -> None:
        self._sessions = sessions
        self._hardware = tools.hardware
        self._settling = tools.settling
        self._runs = CalibrationRuns(self._sessions, tools)

    def create(self, label: str) -> SessionDocument:
        """Create a session of this rig."""
        status = self._hardware.status
        if status.rig_id is None or status.baseline_m is None:
            raise refusals.not_open(status)
        return self._describe(
            self._sessions.create(label=label, rig_id=status.rig_id, baseline_m=status.baseline_m)
        )

    def combine(self, ids: Sequence[str], *, label: str | None) -> SessionDocument:
        """Create a session that combines the sweeps of several."""
        for one in ids:
            self._runs.check_idle(one, "put sessions together")
        return self._describe(self._sessions.combine(ids, label=label))

    def every(self) -> list[SessionDocument]:
        """Return all sessions, newest first."""
        return [self._describe(session) for session in self._sessions.every()]

    def get(self, session_id: str) -> SessionDocument:
        """Return a session by its id or raise `NotFound`."""
        return self._describe(self._sessions.get(session_id))

    def remove(self, session_id: str) -> None:
        """Delete a session; raise `Busy` while a job works in it."""
        self._runs.check_idle(session_id, "delete the session")
        self._sessions.remove(session_id)

    def submit(self, session_id: str, run: Run, *, idempotency_key: str | None = None) -> Job:
        """Queue a step."""
        return self._runs.submit(session_id, run, idempotency_key=idempotency_key)

    def remove_sample(self, session_id: str, sample_id: str) -> SessionDocument:
        """Remove a view of the board and fit the lens again."""
        from foveacam_server.resources.calibrating.sessions.wide_step import (
            remove_sample,  # fits and figures load for seconds
        )

        session = self._sessions.get(session_id)
        self._runs.check_idle(session_id, "remove a view")
        with disk_errors(f"the views of calibration session {session.id}", session.folder):
            remove_sample(session, sample_id)
        return self._describe(session)

    def remove_lens_sample(self, session_id: str, role: Role, sample_id: str) -> SessionDocument:
        """Remove a fovea's view of the board and fit its lens again."""
        from foveacam_server.resources.calibrating.sessions.lens_step import (
            remove_lens_sample,  # fits and figures load for seconds
        )

        session = self._sessions.get(session_id)
        self._runs.check_idle(session_id, "remove a view")
        with disk_errors(f"the views of calibration session {session.id}", session.folder):
            remove_lens_sample(session, role, sample_id)
        return self._describe(session)

    def settle_time(self, session_id: str) -> SettleTime:
        """Return the settle time that a session has measured; raise `NotCalibrated` before it has."""
        return measured_time(self._sessions.get(session_id))

    def thumbnail(self, session_id: str, sample_id: str, role: Role = Role.WIDE) -> Path:
        """Return the file of the thumbnail of a camera's view or raise `NotFound`."""
        return thumbnail_path(self._sessions.get(session_id), sample_id, role)

    def picture(self, session_id: str, name: str) -> Path:
        """Return the file of a picture or raise `NotFound`."""
        return picture_path(self._sessions.get(session_id), name)

    def _describe(self, session: CalibrationSession) -> SessionDocument:
        return describe_session(
            session,
            url=f"{SESSIONS_URL}/{session.id}",
            running=self._runs.running(session.id),
            in_use=self._settling.in_use,
        )
