"""Whether the calibration in force still holds, from what ordinary fixations leave: told all the time."""

import threading

from foveacam_pipeline.calibrate.drift.health import HealthMonitor, HealthReport, HealthVerdict, report_health
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.values import Fixation
from foveacam_server.api.models import HealthDocument
from foveacam_server.runtime.documents import rounded
from foveacam_server.runtime.events import EventLevel, EventLog


class CalibrationHealth:
    """Collects fixations; starts anew when another calibration comes into force."""

    def __init__(self, events: EventLog) -> None:
        self._events = events
        self._lock = threading.Lock()
        self._checkup: HealthMonitor | None = None

    def begin(self, calibration: Calibration) -> None:
        """Forget what was known: `calibration` is in force from now on."""
        with self._lock:
            self._checkup = HealthMonitor(calibration)
        self._tell(report_health(()))

    def add(self, fixation: Fixation, calibration: Calibration) -> None:
        """Take a fixation; one made with a calibration that is no longer in force says nothing."""
        with self._lock:
            if self._checkup is None or self._checkup.calibration_id != calibration.id:
                return
            before = self._checkup.health
            self._checkup.add(fixation)
            health = self._checkup.health
        if health != before:
            self._tell(health)

    def describe(self) -> HealthDocument:
        """Return the verdict so far."""
        with self._lock:
            return _describe(health_of(()) if self._checkup is None else self._checkup.health)

    def _tell(self, health: HealthReport) -> None:
        level = EventLevel.WARNING if health.verdict is HealthVerdict.RECALIBRATE else EventLevel.INFO
        data = _describe(health).as_json()
        self._events.emit("calibration.health", health.detail, level=level, data=data)


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
