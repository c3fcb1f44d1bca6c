"""Runs trigger tests as jobs, restores the cameras' settings and stores the results."""

import logging
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from foveacam_hardware.contract import Camera, Role
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.job_table import Job
from foveacam_server.foundation.jobs import JobContext, JobRunner
from foveacam_server.foundation.names import new_id, utc_now
from foveacam_server.foundation.quantities import rounded
from foveacam_server.foundation.whole_file import write_document
from foveacam_server.resources.devices.cameras import trigger_test as test
from foveacam_server.resources.devices.cameras.schema import EyeTestDocument, TriggerTestDocument
from foveacam_server.resources.devices.cameras.service import CameraSettingsService
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.hardware_commands import answer_of
from foveacam_server.rig.ports import AssembledRig

KIND = "camera.self_test"
URL = "/api/v1/cameras/self_tests"
EYES = (Role.LEFT, Role.RIGHT)
STEPS = 3
LONGEST_STEP_S = 60.0
"""Timeout of a test step; exposures may be long, and each step waits for two."""

T = TypeVar("T")

_log = logging.getLogger(__name__)


class TriggerTests:
    """Queues and runs tests and stores their results."""

    def __init__(
        self,
        folder: Path,
        *,
        cameras: CameraSettingsService,
        hardware: HardwareThread,
        jobs: JobRunner,
        events: EventLog,
    ) -> None:
        self._folder = folder
        self._cameras = cameras
        self._hardware = hardware
        self._jobs = jobs
        self._events = events
        jobs.handle(KIND, self._work)

    def submit(self, *, idempotency_key: str | None = None) -> Job:
        """Queue a test of both eyes; raise `NotConnected` while no rig is open."""
        self._hardware.check_open()
        return self._jobs.submit(KIND, idempotency_key=idempotency_key)

    def get(self, test_id: str) -> TriggerTestDocument:
        """Return the result of a test by its id or raise `NotFound`."""
        for known in self.every():
            if known.id == test_id:
                return known
        raise NotFound(f"there is no trigger test {test_id}; see {URL}", asked=test_id)

    def every(self) -> list[TriggerTestDocument]:
        """Return the results of all tests, newest first."""
        paths = sorted(self._folder.glob("*.json"), reverse=True)
        return [found for path in paths if (found := _read(path)) is not None]

    def newest(self) -> TriggerTestDocument:
        """Return the newest test; before the first, a document with both eyes `untested`."""
        for known in self.every()[:1]:
            return known
        untested = [
            test.EyeTestResult(role=role, verdict=test.TriggerVerdict.UNTESTED, detail="not tested yet")
            for role in EYES
        ]
        return _describe("", "", untested)

    def _work(self, context: JobContext) -> str:
        with self._hardware.session(f"trigger test {context.job.id}", cancelled=context.cancelled):
            found = self._test(context)
        result = _describe(new_id("trg"), utc_now(), found)
        self._write(result)
        verdicts = ", ".join(f"{eye.role.value}: {eye.verdict.value}" for eye in found)
        self._events.emit("camera.self_test", f"trigger test: {verdicts}", data=result)
        return f"{URL}/{result.id}"

    def _test(self, context: JobContext) -> list[test.EyeTestResult]:
        before = self._run_on_rig(
            lambda rig: {eye.role: eye.settings for eye in _eyes(rig)}, "the cameras' settings"
        )
        try:
            software = {}
            for step, role in enumerate(EYES):
                context.check()
                context.progress(step, total=STEPS, note=f"a command to the {role.value} camera")
                software[role] = self._run_on_rig(_by_software(role), f"a command to the {role.value} camera")
            context.check()
            context.progress(len(EYES), total=STEPS, note="one pulse of the controller")
            pulses = self._pulse()
        finally:
            pending = self._run_on_rig(
                lambda rig: test.put_back(_eyes(rig), before), "the settings of before"
            )
            self._cameras.restore_when_back(pending)
        context.progress(STEPS, total=STEPS)
        return [
            test.verdict_of(role, software[role], None if pulses is None else pulses[role]) for role in EYES
        ]

    def _pulse(self) -> dict[Role, test.TriggerProbe] | None:
        """Give one pulse, unless the stop is engaged: the trigger lines then stay untested."""
        if self._hardware.halted:
            return None
        gaze = self._hardware.gaze
        return self._run_on_rig(lambda rig: test.probe_by_pulse(rig, _eyes(rig), gaze=gaze), "a pulse")

    def _run_on_rig(self, work: Callable[[AssembledRig], T], asked: str) -> T:
        return answer_of(self._hardware.submit(work), asked=asked, within_s=LONGEST_STEP_S)

    def _write(self, result: TriggerTestDocument) -> None:
        path = self._folder / f"{result.created_utc.replace(':', '')}-{result.id}.json"
        write_document(path, result.as_json(), what="the trigger test")


def _read(path: Path) -> TriggerTestDocument | None:
    try:
        return TriggerTestDocument.model_validate_json(path.read_bytes())
    except (OSError, ValueError) as error:
        _log.warning("%s is passed over: %s", path, error)
        return None


def _eyes(rig: AssembledRig) -> tuple[Camera, Camera]:
    return rig.left, rig.right


def _by_software(role: Role) -> Callable[[AssembledRig], test.TriggerProbe]:
    def probe(rig: AssembledRig) -> test.TriggerProbe:
        return test.probe_by_software(rig, rig.left if role is Role.LEFT else rig.right)

    return probe


def _describe(test_id: str, created_utc: str, eyes: list[test.EyeTestResult]) -> TriggerTestDocument:
    return TriggerTestDocument(
        id=test_id,
        created_utc=created_utc,
        eyes=[
            EyeTestDocument(
                eye="left" if eye.role is Role.LEFT else "right",
                verdict=eye.verdict.value,
                detail=eye.detail,
                software_ms=rounded(eye.software_ms, 2),
                hardware_ms=rounded(eye.hardware_ms, 2),
            )
            for eye in eyes
        ],
    )
