"""Opens the services that measure and store calibrations, and those that test the trigger."""

from dataclasses import dataclass

from foveacam_server.assembly.first_services import (
    DisplayServices,
    RigKnowledge,
    ServerFoundation,
)
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.resources.calibration_sessions.descriptions import SessionReader
from foveacam_server.resources.calibration_sessions.runs import CalibrationJobTools
from foveacam_server.resources.calibration_sessions.service import CalibrationSessionService
from foveacam_server.resources.calibration_sessions.sessions import SessionCollection
from foveacam_server.resources.calibrations.records import CalibrationRecords
from foveacam_server.resources.cameras.trigger_tests import TriggerTests
from foveacam_server.resources.drift_checks.service import DriftChecks
from foveacam_server.rig.hardware import HardwareThread


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationServices:
    """Services that measure and store calibrations."""

    sessions: CalibrationSessionService
    drift: DriftChecks
    records: CalibrationRecords


def open_calibration(
    foundation: ServerFoundation,
    knowledge: RigKnowledge,
    displays: DisplayServices,
    *,
    hardware: HardwareThread,
    jobs: JobRunner,
) -> CalibrationServices:
    """Open them; they share what runs calibration jobs."""
    tools = CalibrationJobTools(
        hardware=hardware,
        calibration=knowledge.calibration,
        jobs=jobs,
        sink=displays.tap,
        events=foundation.events,
        clock=foundation.clock,
        settling=knowledge.settling,
    )
    sessions, drift = (
        SessionCollection(knowledge.folder / "sessions"),
        DriftChecks(knowledge.folder / "drift", tools),
    )
    records = CalibrationRecords(
        knowledge.calibration,
        sessions=SessionReader(sessions),
        drift=drift.records,
        hardware=hardware,
        health=knowledge.health,
    )
    return CalibrationServices(
        sessions=CalibrationSessionService(sessions, tools), drift=drift, records=records
    )


def open_trigger_tests(
    foundation: ServerFoundation, knowledge: RigKnowledge, *, hardware: HardwareThread, jobs: JobRunner
) -> TriggerTests:
    """Open the tests of the trigger cables."""
    folder = knowledge.cameras_folder / "self_tests"
    return TriggerTests(
        folder, cameras=knowledge.cameras, hardware=hardware, jobs=jobs, events=foundation.events
    )
