"""Monitors whether the calibration in force still fits, from the residuals of ordinary fixations."""

import threading

from foveacam_pipeline.calibrate.drift.health import HealthMonitor, HealthReport, HealthVerdict, report_health
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.values import Fixation
from foveacam_server.foundation.events import EventLevel, EventLog
from foveacam_server.foundation.quantities import rounded
from foveacam_server.resources.calibrating.calibrations.schema import HealthDocument


class CalibrationHealth:
    """Collects fixations; starts again when another calibration comes into force."""

    def __init__(self, events: EventLog) -> None:
        self._events = events
        self._lock = threading.Lock()
        self._monitor: HealthMonitor | None = None

    def begin(self, calibration: Calibration) -> None:
        """Reset: `calibration` is in force from now on."""
        with self._lock:
            self._monitor = HealthMonitor(calibration)
        self._emit(report_health(()))

    def add(self, fixation: Fixation, calibration: Calibration) -> None:
        """Add a fixation; one made with a calibration that is no longer in force is ignored."""
        with self._lock:
            if self._monitor is None or self._monitor.calibration_id != calibration.id:
                return
            before = self._monitor.health
            self._monitor.add(fixation)
            health = self._monitor.health
        if health != before:
            self._emit(health)

    def describe(self) -> HealthDocument:
        """Return the present verdict."""
        with self._lock:
            return _describe(report_health(()) if self._monitor is None else self._monitor.health)

    def _emit(self, health: HealthReport) -> None:
        level = EventLevel.WARNING if health.verdict is HealthVerdict.RECALIBRATE else EventLevel.INFO
        self._events.emit("calibration.health", health.detail, level=level, data=_describe(health))


def _describe(health: HealthReport) -> HealthDocument:
    return HealthDocument(
        score=rounded(health.score, 3),
        verdict=health.verdict.value,
        fixations=health.fixations,
        vertical_px=rounded(health.vertical_px, 2),
        horizontal_px=rounded(health.horizontal_px, 2),
        rows_px=rounded(health.rows_px, 2),
        detail=health.detail,
    )
