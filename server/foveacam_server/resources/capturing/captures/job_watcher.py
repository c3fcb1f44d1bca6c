"""Reports a running capture (progress as events, frames as views), and applies pause and cancel."""

import threading
from dataclasses import dataclass, field

from foveacam_hardware.contract import Clock, Frame, Role, StereoVolts
from foveacam_pipeline.capture.run import CapturePhase, CaptureReport
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.jobs import JobContext
from foveacam_server.foundation.report_pace import EVENTS_NS, ReportPace
from foveacam_server.resources.capturing.captures.schema import (
    CaptureProgress,
    CaptureProgressEvent,
    LiveState,
)
from foveacam_server.rig.live_views import OverlayOf
from foveacam_server.rig.ports import PictureSink


@dataclass(slots=True, kw_only=True)
class LiveCapture:
    """A queued, running or paused capture; written by its job, read by requests."""

    id: str
    name: str
    job_id: str
    report: CaptureReport | None = None
    manual_action: str = ""
    """Manual action that the operator is asked for before the capture continues."""
    pausing: threading.Event = field(default_factory=threading.Event)

    @property
    def state(self) -> LiveState:
        """The state that REST shows."""
        if self.report is None:
            return "starting"
        return "paused" if self.report.phase is CapturePhase.PAUSED else "running"


class CaptureJobWatcher:
    """Implements `CaptureWatcher` for one job."""

    def __init__(
        self,
        context: JobContext,
        live: LiveCapture,
        *,
        sink: PictureSink,
        overlay: OverlayOf,
        events: EventLog,
        clock: Clock,
    ) -> None:
        self._context = context
        self._live = live
        self._sink = sink
        self._overlay = overlay
        self._events = events
        self._pace = ReportPace(clock, period_ns=EVENTS_NS)
        self._phase: CapturePhase | None = None
        self._gaze: StereoVolts | None = None

    def progress(self, report: CaptureReport) -> None:
        """Report the progress, at most once per period except at a change of phase and at the end."""
        turned = report.phase is not self._phase
        self._live.report = report
        if not self._pace.is_due(at_once=turned or report.stored >= report.total):
            return
        if turned:
            self._context.stage()
        self._phase = report.phase
        note = self._live.manual_action or report.note or _progress_words(report)
        self._context.progress(report.done, total=report.total, note=note, left_s=report.left_s)
        self._events.emit(
            "capture.progress",
            f"{self._live.name}: {report.done} of {report.total}, {note}",
            data=CaptureProgressEvent(
                **dict(CaptureProgress.of(report)),
                capture_id=self._live.id,
                job_id=self._live.job_id,
                state=self._live.state,
                wish=self._live.manual_action,
            ),
        )

    def cancelled(self) -> bool:
        """Return whether the job was cancelled."""
        return self._context.cancelled()

    def paused(self) -> bool:
        """Return whether the capture is to pause."""
        if not self._live.pausing.is_set():
            self._live.manual_action = ""
            return False
        return True

    def ask_operator(self, request: str) -> None:
        """Pause until the operator has done `request` by hand and continues the capture."""
        self._live.manual_action = request
        self._live.pausing.set()

    def show_frames(self, frames: tuple[Frame, ...]) -> None:
        """Show captured frames in the live views."""
        volts = {frame.role: frame.volts for frame in frames if frame.volts is not None}
        if Role.LEFT in volts and Role.RIGHT in volts:
            self._gaze = StereoVolts(left=volts[Role.LEFT], right=volts[Role.RIGHT])
        for frame in frames:
            gaze = self._gaze if frame.role is Role.WIDE else None
            meta = None if gaze is None else self._overlay(gaze)
            self._sink.publish_frame(frame, meta=meta)


def _progress_words(report: CaptureReport) -> str:
    words = [report.phase.value]
    if report.written_bytes:
        words.append(f"{report.written_bytes / 1e6:.0f} MB at {report.bytes_per_s / 1e6:.1f} MB/s")
    return ", ".join(words)
