"""Runs calibration steps as jobs: in one session's folder, with the rig through the hardware thread."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Protocol

from foveacam_hardware.contract import (
    Binning,
    Busy,
    Clock,
    InvalidInput,
    PanTiltPose,
    Role,
)
from foveacam_pipeline.storage.disk import disk_fault, is_disk_exhausted
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.job_table import Job
from foveacam_server.foundation.jobs import JobContext, JobRunner
from foveacam_server.foundation.schema import RequestModel
from foveacam_server.resources.calibrating.sessions.job_watcher import CalibrationJobWatcher
from foveacam_server.resources.calibrating.sessions.options import (
    STEPS,
    AllRun,
    FitRun,
    MirrorsOptions,
    MirrorsRun,
    Run,
    WideRun,
)
from foveacam_server.resources.calibrating.sessions.sessions import CalibrationSession, SessionCollection
from foveacam_server.resources.calibrating.sessions.step_environment import (
    CalibrationRegistry,
    ExclusiveRig,
    StepEnvironment,
)
from foveacam_server.rig import refusals
from foveacam_server.rig.exclusive_pan_tilt import exclusive_pan_tilt
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.ports import CalibrationInForce, PictureSink
from foveacam_server.rig.refusals import no_pan_tilt
from foveacam_server.rig.settle_times import SettleTime
from foveacam_server.rig.status import RigStatus

SESSIONS_URL = "/api/v1/calibration_sessions"


class StepJobRequest(RequestModel):
    """Request of a step's job: the session that it works in, and the step."""

    session_id: str
    run: Run


class RigCalibrations(CalibrationRegistry, CalibrationInForce, Protocol):
    """The calibrations of the rig and the one in force."""


class SettleTimeInUse(Protocol):
    """The settle time of the rig."""

    @property
    def in_use(self) -> SettleTime | None:
        """The measured settle time in use; None: the rig file's is."""
        ...

    def apply(self, time: SettleTime, hardware: HardwareThread) -> None:
        """Put a measured settle time in use, now and at every start."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationJobTools:
    """Services that the jobs of calibration steps need."""

    hardware: HardwareThread
    calibration: RigCalibrations
    jobs: JobRunner
    sink: PictureSink
    events: EventLog
    clock: Clock
    settling: SettleTimeInUse


class CalibrationRuns:
    """Queues and runs steps; knows the session of each job."""

    def __init__(self, sessions: SessionCollection, tools: CalibrationJobTools) -> None:
        self._sessions = sessions
        self._tools = tools
        self._jobs: dict[str, list[str]] = {}
        for step in STEPS:
            tools.jobs.handle(f"calibration.{step}", self._work)

    def submit(self, session_id: str, run: Run, *, idempotency_key: str | None = None) -> Job:
        """Queue a step; raise at once where it cannot run now."""
        session = self._sessions.get(session_id)
        self._check(session, run)
        request = StepJobRequest(session_id=session_id, run=run)
        job = self._tools.jobs.submit(f"calibration.{run.step}", request, idempotency_key=idempotency_key)
        self._jobs.setdefault(session_id, []).append(job.id)
        return job

    def running(self, session_id: str) -> str | None:
        """Return the id of a session's running or queued job; None without one."""
        open_jobs = [known for known in self._jobs.get(session_id, []) if not self._ended(known)]
        return open_jobs[0] if open_jobs else None

    def check_idle(self, session_id: str, asked: str) -> None:
        """Raise `Busy` while a job works in a session."""
        job_id = self.running(session_id)
        if job_id is not None:
            raise Busy(
                f"asked to {asked}: job {job_id} works in session {session_id}",
                asked=asked,
                found=f"job {job_id} works in it",
                remedy="wait for it, or cancel it",
            )

    def _ended(self, job_id: str) -> bool:
        return self._tools.jobs.get(job_id).state.ended

    def _check(self, session: CalibrationSession, run: Run) -> None:
        status = self._tools.hardware.status
        if status.rig_id is None:
            raise refusals.not_open(status)
        if session.head.rig_id != status.rig_id:
            raise InvalidInput(
                f"session {session.id} belongs to rig {session.head.rig_id!r}, this is rig {status.rig_id!r}",
                asked=f"a step in session {session.id}",
                found=f"it belongs to rig {session.head.rig_id!r}",
                remedy="begin a session of this rig",
            )
        if isinstance(run, FitRun):
            return  # a fit needs no rig
        if self._tools.hardware.halted:
            raise refusals.stopped()
        if not isinstance(run, WideRun):
            self._tools.hardware.check_may_move()
        if isinstance(run, MirrorsRun | AllRun):
            self._check_sweep(run.options if isinstance(run, MirrorsRun) else run.options.mirrors, status)

    def _check_sweep(self, options: MirrorsOptions, status: RigStatus) -> None:
        self._environment(status).sweep_stations(options.stations)
        if status.pan_tilt is None:
            raise no_pan_tilt("sweep the mirrors")

    def _work(self, context: JobContext) -> str:
        from foveacam_server.resources.calibrating.sessions.steps import (
            run_step,  # importing fits and pictures takes seconds
        )

        request = context.job.parse_request(StepJobRequest)
        session = self._sessions.get(request.session_id)
        watch = CalibrationJobWatcher(
            context,
            session_id=session.id,
            sink=self._tools.sink,
            events=self._tools.events,
            clock=self._tools.clock,
        )
        before = self._present_pose()
        environment = self._environment(self._tools.hardware.status, context)
        try:
            run_step(
                session, request.run, environment=environment, registry=self._tools.calibration, watch=watch
            )
        except OSError as error:
            if not is_disk_exhausted(error):
                raise
            what = f"a step of calibration session {session.id}"
            raise disk_fault(error, what=what, folder=session.folder, again="then run it again") from error
        finally:
            self._release_by_hand()
        self._turn_back(before, environment)
        return f"{SESSIONS_URL}/{session.id}"

    def _environment(self, status: RigStatus, context: JobContext | None = None) -> StepEnvironment:
        @contextmanager
        def use(what: str, *, binning: Binning | None = 1) -> Iterator[ExclusiveRig]:
            cancelled = context.cancelled if context is not None else _never
            with self._tools.hardware.session(what, cancelled=cancelled, binning=binning) as head:
                yield ExclusiveRig(
                    head=head, pan_tilt=exclusive_pan_tilt(self._tools.hardware, cancelled=cancelled)
                )

        return StepEnvironment(
            rig_id=status.rig_id or "",
            baseline_m=status.baseline_m or 0.0,
            stations=status.stations,
            clock=self._tools.clock,
            serials={camera.role: camera.info.serial for camera in status.cameras},
            fovea_settings=next((c.settings for c in status.cameras if c.role is Role.LEFT), None),
            max_v=status.max_v,
            markers=status.markers,
            use=use,
            wait_after_moves=lambda time: self._tools.settling.apply(time, self._tools.hardware),
        )

    def _present_pose(self) -> PanTiltPose | None:
        status = self._tools.hardware.status.pan_tilt
        return status.state.pose if status is not None and status.moves_itself else None

    def _release_by_hand(self) -> None:
        """Clear the pose to which the operator was asked to turn a pan-tilt by hand."""
        status = self._tools.hardware.status.pan_tilt
        if status is not None and not status.moves_itself and status.state.connected:
            self._tools.hardware.hold_pan_tilt()

    def _turn_back(self, before: PanTiltPose | None, environment: StepEnvironment) -> None:
        """Turn the rig back to its pose before the job."""
        status = self._tools.hardware.status.pan_tilt
        if before is None or status is None or status.state.pose == before:
            return
        with environment.use("turning back") as rig:
            if rig.pan_tilt is not None:
                rig.pan_tilt.move_to(before)


def _never() -> bool:
    return False
