"""Drift checks on disk: one file each, never changed; the corrections they led to are named in them."""

import json
import math
import re
from dataclasses import dataclass
from pathlib import Path

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.calibrate.drift_values import DriftCheck, EyeDrift
from foveacam_pipeline.calibrate.new_file import write_new
from foveacam_server.errors import NotFound
from foveacam_server.runtime.documents import deg, rounded
from foveacam_server.runtime.store import Document

_ID = re.compile(r"drf-[0-9a-f]{1,32}")


@dataclass(frozen=True, slots=True, kw_only=True)
class DriftRecords:
    """The drift checks of one data directory."""

    folder: Path

    def add(self, document: Document) -> None:
        """Write one down."""
        write_new(self.folder / f"{document['id']}.json", json.dumps(document, indent=1, allow_nan=False))

    def get(self, check_id: str) -> Document:
        """Return one or raise `NotFound`."""
        path = self.folder / f"{check_id}.json"
        if not _ID.fullmatch(check_id) or not path.is_file():
            raise NotFound(f"there is no drift check {check_id}; see /api/v1/drift_checks", asked=check_id)
        return _read(path)

    def every(self) -> list[Document]:
        """Return all, newest first; a file that cannot be read is passed over."""
        found = []
        for path in self.folder.glob("drf-*.json"):
            try:
                found.append(_read(path))
            except InvalidInput:
                continue
        return sorted(found, key=lambda document: str(document["created_utc"]), reverse=True)


def drift_document(check: DriftCheck, *, check_id: str, created_utc: str) -> Document:
    """Return a check as REST shows it, before anything was made of it."""
    return {
        "id": check_id,
        "created_utc": created_utc,
        "calibration_id": check.calibration_id,
        "looks": check.looks,
        "applied": False,
        "new_calibration_id": None,
        "eyes": [_eye(role, check.eye(role)) for role in (Role.LEFT, Role.RIGHT)],
        "vergence_known": check.vergence_known,
        "locked": check.locked,
        "residual_px": rounded(check.residual_px, 3),
        "duration_s": round(check.duration_s, 3),
        "detail": check.detail,
    }


def _eye(role: Role, drift: EyeDrift) -> Document:
    shift_x_rad, shift_y_rad = drift.turn.shift_rad
    grow_x, grow_y, _ = drift.turn.stretch
    sigma_rad = math.hypot(*drift.shift_sigma_rad) / math.sqrt(2.0)
    return {
        "eye": role.value,
        "shift_x_deg": deg(shift_x_rad),
        "shift_y_deg": deg(shift_y_rad),
        "rotation_deg": deg(drift.turn.turn_rad[2]),
        "scale": round(1.0 + (grow_x + grow_y) / 2.0, 6),
        "sigma_deg": rounded(math.degrees(sigma_rad), 6),
        "significant": drift.significant,
    }


def _read(path: Path) -> Document:
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InvalidInput(f"{path} cannot be read ({error}); delete it and check the drift again") from error
    if not isinstance(document, dict) or "created_utc" not in document:
        raise InvalidInput(f"{path} is no drift check; delete it and check the drift again")
    return document
