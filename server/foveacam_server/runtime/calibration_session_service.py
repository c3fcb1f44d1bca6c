"""Calibration sessions as the server offers them: documents, files, and runs as jobs."""

from collections.abc import Sequence
from pathlib import Path

from pydantic import BaseModel

from foveacam_pipeline.storage.disk import disk_errors
from foveacam_server.calibrating.documents import session_document
from foveacam_server.calibrating.pictures import picture_path
from foveacam_server.calibrating.sessions import CalibrationSession, SessionCollection
from foveacam_server.calibrating.settle_times import SettleTime, measured_time
from foveacam_server.calibrating.wide_documents import thumbnail_path
from foveacam_server.runtime import refusals
from foveacam_server.runtime.calibration_runs import SESSIONS_URL, CalibrationJobTools, CalibrationRuns
from foveacam_server.runtime.job_table import Job
from foveacam_server.runtime.store import Document


class CalibrationSessionService:
    """One door to the sessions of this rig."""

    def __init__(self, shelf: SessionCollection, equipment: CalibrationJobTools) -> None:
        self._shelf = shelf
        self._hardware = equipment.hardware
        self._settling = equipment.settling
        self._runs = CalibrationRuns(self._shelf, equipment)

    def create(self, label: str) -> Document:
        """Begin a session of this rig."""
        status = self._hardware.status
        if status.rig_id is None or status.baseline_m is None:
            raise refusals.not_open(status.problems)
        return self._document(
            self._shelf.create(label=label, rig_id=status.rig_id, baseline_m=status.baseline_m)
        )

    def combine(self, ids: Sequence[str], *, label: str | None) -> Document:
        """Begin a session with the sweeps of several."""
        for one in ids:
            self._runs.check_idle(one, "put sessions together")
        return self._document(self._shelf.combine(ids, label=label))

    def every(self) -> list[Document]:
        """Return all sessions, newest first."""
        return [self._document(session) for session in self._shelf.every()]

    def document(self, session_id: str) -> Document:
        """Return one session or raise `NotFound`."""
        return self._document(self._shelf.get(session_id))

    def at_url(self, url: str) -> Document:
        """Return the session that a job's result URL names."""
        return self.document(url.rsplit("/", 1)[1])

    def remove(self, session_id: str) -> None:
        """Delete a session; raise `Busy` while a job works in it."""
        self._runs.check_idle(session_id, "delete the session")
        self._shelf.remove(session_id)

    def submit(self, session_id: str, run: BaseModel, *, idempotency_key: str | None = None) -> Job:
        """Queue a step."""
        return self._runs.submit(session_id, run, idempotency_key=idempotency_key)

    def remove_sample(self, session_id: str, sample_id: str) -> Document:
        """Take a view of the board out of the fit of the lens."""
        from foveacam_server.calibrating.wide_results import remove_sample, samples_of
        from foveacam_server.calibrating.wide_step import (
            draw_wide_pictures,  # fits and figures load for seconds
        )

        session = self._shelf.get(session_id)
        self._runs.check_idle(session_id, "remove a view")
        with disk_errors(f"the views of calibration session {session.id}", session.folder):
            fits = remove_sample(session, sample_id)
            samples = samples_of(session)
            if samples is not None:
                draw_wide_pictures(session, samples, fits[0] if fits else None)
        return self._document(session)

    def settle_time(self, session_id: str) -> SettleTime:
        """Return the settle time that a session has measured; raise `NotCalibrated` before it has."""
        return measured_time(self._shelf.get(session_id))

    def thumbnail(self, session_id: str, sample_id: str) -> Path:
        """Return the file of a view's thumbnail or raise `NotFound`."""
        return thumbnail_path(self._shelf.get(session_id), sample_id)

    def picture(self, session_id: str, name: str) -> Path:
        """Return the file of a picture or raise `NotFound`."""
        return picture_path(self._shelf.get(session_id), name)

    def _document(self, session: CalibrationSession) -> Document:
        return session_document(
            session,
            url=f"{SESSIONS_URL}/{session.id}",
            running=self._runs.running(session.id),
            in_use=self._settling.in_use,
        )
