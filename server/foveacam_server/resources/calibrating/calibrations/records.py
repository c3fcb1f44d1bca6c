"""Serves the rig's calibrations: description, comparison, import and export, report, health."""

from functools import lru_cache

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.records.compare import compare, comparison_picture
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.resources.calibrating.calibrations.health import CalibrationHealth
from foveacam_server.resources.calibrating.calibrations.measured_data import (
    MeasuredAcceptances,
    MeasuredDrift,
    MeasuredSessions,
)
from foveacam_server.resources.calibrating.calibrations.record_files import (
    FileFormat,
    ImportFacts,
    calibration_of,
    export_bytes,
)
from foveacam_server.resources.calibrating.calibrations.schema import (
    CalibrationDocument,
    ComparisonDocument,
    HealthDocument,
)
from foveacam_server.resources.calibrating.calibrations.service import CalibrationService
from foveacam_server.rig import refusals
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.status import RigStatus

COMPARE_URL = "/api/v1/calibrations/compare.png"


class CalibrationRecords:
    """The calibrations of this rig: describe, compare, import, export, report."""

    def __init__(
        self,
        calibration: CalibrationService,
        *,
        sessions: MeasuredSessions,
        drift: MeasuredDrift,
        acceptances: MeasuredAcceptances,
        hardware: HardwareThread,
        health: CalibrationHealth,
    ) -> None:
        self._service = calibration
        self._sessions = sessions
        self._drift = drift
        self._acceptances = acceptances
        self._hardware = hardware
        self._health = health
        self._picture = lru_cache(maxsize=8)(self._draw)

    def describe(self, calibration: Calibration) -> CalibrationDocument:
        """Return a calibration's document; with its health if it is in force."""
        current = self._service.current is calibration
        return CalibrationDocument.of(
            calibration,
            kept=self._service.is_kept(calibration.id),
            current=current,
            health=self.health() if current else None,
        )

    def health(self) -> HealthDocument:
        """Return the health of the calibration in force, from the residuals of ordinary fixations."""
        return self._health.describe()

    def compare(self, a: str, b: str) -> ComparisonDocument:
        """Return the differences of two calibrations, in pixels."""
        return ComparisonDocument.of(
            compare(self._service.get(a), self._service.get(b)), picture_url=f"{COMPARE_URL}?a={a}&b={b}"
        )

    def compare_picture(self, a: str, b: str) -> bytes:
        """Return a PNG of the differences of two calibrations over the field."""
        return self._picture(a, b)

    def file(self, calibration_id: str, file_format: FileFormat) -> bytes:
        """Return the content of a calibration's file."""
        return export_bytes(self._service.get(calibration_id), file_format, sessions=self._sessions)

    def import_file(self, document: object, *, distance_m: float | None) -> CalibrationDocument:
        """Store the calibration of an uploaded file."""
        status = self._hardware.status
        if status.rig_id is None:
            raise refusals.not_open(status)
        calibration = calibration_of(document, _facts(status, distance_m=distance_m))
        self._service.add(calibration)
        return self.describe(calibration)

    def report(self, calibration_id: str) -> str:
        """Return the report of a calibration as one HTML page."""
        from foveacam_server.resources.calibrating.calibrations.reports import (
            report_page,  # importing the figures takes seconds
        )

        return report_page(
            self._service.get(calibration_id),
            sessions=self._sessions,
            drift=self._drift,
            acceptances=self._acceptances,
        )

    def _draw(self, a: str, b: str) -> bytes:
        return comparison_picture(compare(self._service.get(a), self._service.get(b)))


def _facts(status: RigStatus, *, distance_m: float | None) -> ImportFacts:
    sizes = {
        camera.role: (camera.width, camera.height)
        for camera in status.cameras
        if camera.width is not None and camera.height is not None
    }
    facts = ImportFacts(rig_id=status.rig_id or "", distance_m=distance_m)
    return ImportFacts(
        rig_id=facts.rig_id,
        distance_m=distance_m,
        baseline_m=facts.baseline_m if status.baseline_m is None else status.baseline_m,
        fovea_size=sizes.get(Role.LEFT, facts.fovea_size),
        wide_size=sizes.get(Role.WIDE),
    )
