"""The drift checks of a data directory, described; the pipeline's `DriftHistory` stores them."""

import math
from pathlib import Path

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.drift.history import DriftHistory, DriftRecord, trend_picture
from foveacam_pipeline.calibrate.drift.values import DriftCheck, EyeDrift
from foveacam_pipeline.verge.aim import EYES
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.quantities import deg, rounded
from foveacam_server.resources.calibrating.drift_checks.schema import DriftCheckDocument, DriftEyeDocument
from foveacam_server.resources.calibrating.sessions.schema import eye_of


class DriftRecords:
    """Stores and describes drift checks."""

    def __init__(self, folder: Path) -> None:
        self._history = DriftHistory(folder)

    def add(
        self, check: DriftCheck, *, created_utc: str, new_calibration_id: str | None
    ) -> DriftCheckDocument:
        """Store a check and describe it."""
        return _describe(
            self._history.add(check, created_utc=created_utc, new_calibration_id=new_calibration_id)
        )

    def get(self, check_id: str) -> DriftCheckDocument:
        """Return one check or raise `NotFound`."""
        for record in self._history.records():
            if record.id == check_id:
                return _describe(record)
        raise NotFound(f"there is no drift check {check_id}; see /api/v1/drift_checks", asked=check_id)

    def every(self) -> list[DriftCheckDocument]:
        """Return all checks, newest first."""
        return [_describe(record) for record in reversed(self._history.records())]

    def of(self, calibration_id: str) -> list[DriftCheckDocument]:
        """Return the checks that measured or made a calibration, oldest first, for its report."""
        return [
            _describe(record)
            for record in self._history.records()
            if calibration_id in (record.check.calibration_id, record.new_calibration_id)
        ]

    def trend_picture(self) -> bytes:
        """Return a PNG of the drift over time; raise `NotFound` before the first check."""
        records = self._history.records()
        if not records:
            raise NotFound("the drift was not checked yet, so there is no trend; POST /api/v1/drift_checks")
        return trend_picture(records)


def _describe(record: DriftRecord) -> DriftCheckDocument:
    check = record.check
    return DriftCheckDocument(
        id=record.id,
        created_utc=record.created_utc,
        calibration_id=check.calibration_id,
        looks=check.looks,
        applied=record.applied,
        new_calibration_id=record.new_calibration_id,
        eyes=[_describe_eye(role, check.eye(role)) for role in EYES],
        vergence_known=check.vergence_known,
        locked=check.locked,
        residual_px=rounded(check.residual_px, 3),
        duration_s=round(check.duration_s, 3),
        detail=check.detail,
    )


def _describe_eye(role: Role, drift: EyeDrift) -> DriftEyeDocument:
    shift_x_rad, shift_y_rad = drift.turn.shift_rad
    grow_x, grow_y, _ = drift.turn.stretch
    sigma_rad = math.hypot(*drift.shift_sigma_rad) / math.sqrt(2.0)
    return DriftEyeDocument(
        eye=eye_of(role),
        shift_x_deg=deg(shift_x_rad),
        shift_y_deg=deg(shift_y_rad),
        rotation_deg=deg(drift.turn.turn_rad[2]),
        scale=round(1.0 + (grow_x + grow_y) / 2.0, 6),
        sigma_deg=rounded(math.degrees(sigma_rad), 6),
        significant=drift.significant,
    )
