"""Opens the services that measure and store calibrations, and that which tests the trigger."""

from dataclasses import dataclass

from foveacam_server.assembly.first_services import SharedServices
from foveacam_server.resources.calibration_sessions.descriptions import SessionReader
from foveacam_server.resources.calibration_sessions.runs import CalibrationJobTools
from foveacam_server.resources.calibration_sessions.service import CalibrationSessionService
from foveacam_server.resources.calibration_sessions.sessions import SessionCollection
from foveacam_server.resources.calibrations.records import CalibrationRecords
from foveacam_server.resources.cameras.trigger_tests import TriggerTests
from foveacam_server.resources.drift_checks.service import DriftChecks


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationServices:
    """Services that measure and store calibrations, and that which tests the trigger."""

    sessions: CalibrationSessionService
    drift: DriftChecks
    records: CalibrationRecords
    trigger_tests: TriggerTests


def open_calibration(shared: SharedServices) -> CalibrationServices:
    """Open them; they share what runs calibration jobs."""
    tools = CalibrationJobTools(
        hardware=shared.hardware,
        calibration=shared.knowledge.calibration,
        jobs=shared.jobs,
        sink=shared.displays.tap,
        events=shared.foundation.events,
        clock=shared.foundation.clock,
        settling=shared.knowledge.settling,
    )
    sessions, drift = (
        SessionCollection(shared.knowledge.folder / "sessions"),
        DriftChecks(shared.knowledge.folder / "drift", tools),
    )
    records = CalibrationRecords(
        shared.knowledge.calibration,
        sessions=SessionReader(sessions),
        drift=drift.records,
        hardware=shared.hardware,
        health=shared.knowledge.health,
    )
    return CalibrationServices(
        sessions=CalibrationSessionService(sessions, tools),
        drift=drift,
        records=records,
        trigger_tests=_trigger_tests(shared),
    )


def _trigger_tests(shared: SharedServices) -> TriggerTests:
    return TriggerTests(
        shared.knowledge.cameras_folder / "self_tests",
        cameras=shared.knowledge.cameras,
        hardware=shared.hardware,
        jobs=shared.jobs,
        events=shared.foundation.events,
    )
