"""Reports the progress of a calibration step: progress and results as events, pictures as views."""

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Clock
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.jobs import JobContext
from foveacam_server.foundation.report_pace import EVENTS_NS, ReportPace
from foveacam_server.foundation.schema import ResponseModel
from foveacam_server.resources.calibrating.sessions.schema import (
    CalibrationFitted,
    EyeState,
    StepProgress,
    SweepPoseMeasured,
    WideSampleTaken,
)
from foveacam_server.rig.ports import PictureSink


class CalibrationJobWatcher:
    """Implements `StepWatcher` for one job of one session."""

    def __init__(
        self,
        context: JobContext,
        *,
        session_id: str | None,
        sink: PictureSink,
        events: EventLog,
        clock: Clock,
    ) -> None:
        self._context = context
        self._session_id = session_id
        self._sink = sink
        self._events = events
        self._clock = clock
        self._stage = ""
        self._pace = ReportPace(clock, period_ns=EVENTS_NS)

    def stage(self, name: str) -> None:
        """Start another step."""
        self._stage = name
        self._pace = ReportPace(self._clock, period_ns=EVENTS_NS)
        self._context.stage()

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        """Report `done` of `total`, at most once per period except at the end of a stage."""
        if not self._pace.is_due(at_once=done >= total):
            return
        self._context.progress(done, total=total, note=note)
        self._emit(
            "calibration.progress",
            f"{self._stage}: {done} of {total}" + (f", {note}" if note else ""),
            StepProgress(session_id=self._session_id, step=self._stage, done=done, total=total, note=note),
        )

    def cancelled(self) -> bool:
        """Return whether the job was cancelled."""
        return self._context.cancelled()

    def show(self, name: str, image: NDArray[np.uint8]) -> None:
        """Show an annotated picture in the view `calibration_<name>`."""
        self._sink.publish_picture(f"calibration_{name}", image, t_ns=self._clock.now_ns())

    def sample(self, sample_id: str) -> None:
        """Report a new view of the board."""
        self._emit(
            "calibration.sample",
            f"view {sample_id} of the board was taken",
            WideSampleTaken(session_id=self._session_id, id=sample_id),
        )

    def pose(self, station: str, *, index: int, left: EyeState, right: EyeState) -> None:
        """Report a pose that was measured."""
        self._emit(
            "calibration.pose",
            f"{station}, pose {index}: left {left}, right {right}",
            SweepPoseMeasured(
                session_id=self._session_id, station=station, index=index, left=left, right=right
            ),
        )

    def fitted(self, calibration: Calibration) -> None:
        """Report a new calibration."""
        self._emit(
            "calibration.fitted",
            f"calibration {calibration.id} ({calibration.label}) was fitted",
            CalibrationFitted(session_id=self._session_id, calibration_id=calibration.id),
        )

    def _emit(self, kind: str, message: str, data: ResponseModel) -> None:
        self._events.emit(kind, message, data=data)
