"""The history of drift checks: one line a check, in a file that is only ever added to."""

import json
import os
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.drift_values import DriftCheck
from foveacam_pipeline.models.content import content_id, plain

FILE = "drift.jsonl"
FORMAT = "foveacam-drift-check"
VERSION = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class DriftRecord:
    """One check as it is kept. `created_utc`: ISO 8601. `new_calibration_id`: what it made, when applied."""

    id: str
    created_utc: str
    check: DriftCheck
    new_calibration_id: str | None = None

    @property
    def applied(self) -> bool:
        """Whether a calibration was made of it."""
        return self.new_calibration_id is not None

    @property
    def created(self) -> datetime:
        """When it was made, with its time zone."""
        return datetime.fromisoformat(self.created_utc)


class DriftHistory:
    """All checks of one rig's data folder."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / FILE

    def add(
        self, check: DriftCheck, *, created_utc: str, new_calibration_id: str | None = None
    ) -> DriftRecord:
        """Keep a check."""
        content = plain(check)
        record = DriftRecord(
            id=content_id([created_utc, content]),
            created_utc=created_utc,
            check=check,
            new_calibration_id=new_calibration_id,
        )
        line = {
            "format": FORMAT,
            "version": VERSION,
            "id": record.id,
            "created_utc": created_utc,
            "new_calibration_id": new_calibration_id,
            "check": content,
        }
        self._path.parent.mkdir(parents=True, exist_ok=True)
        with self._path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line, allow_nan=False) + "\n")
            file.flush()
            os.fsync(file.fileno())
        return record

    def records(self) -> list[DriftRecord]:
        """Return all checks, oldest first; a last line that was cut off is left out."""
        if not self._path.exists():
            return []
        lines = self._path.read_text(encoding="utf-8").split("\n")
        whole, rest = lines[:-1], lines[-1]
        records = [self._parsed(line, number) for number, line in enumerate(whole, start=1) if line]
        return records if not rest else [*records, *self._last(rest)]

    def find(self, record_id: str) -> DriftRecord:
        """Return one check by its id."""
        for record in self.records():
            if record.id == record_id:
                return record
        raise InvalidInput(
            f"drift check {record_id!r} is not in {self._path}; list the checks and give one's id"
        )

    def _last(self, line: str) -> list[DriftRecord]:
        try:
            return [self._parsed(line, 0)]
        except InvalidInput:
            return []  # the machine stopped in the middle of it

    def _parsed(self, line: str, number: int) -> DriftRecord:
        try:
            document = json.loads(line)
            if (document["format"], document["version"]) != (FORMAT, VERSION):
                raise InvalidInput(
                    f"{self._path}, line {number}: not a drift check of version {VERSION}; restore the file"
                )
            check = TypeAdapter(DriftCheck).validate_json(json.dumps(document["check"]))
            return DriftRecord(
                id=document["id"],
                created_utc=document["created_utc"],
                check=check,
                new_calibration_id=document["new_calibration_id"],
            )
        except (ValueError, KeyError, TypeError, ValidationError) as error:
            raise InvalidInput(
                f"{self._path}, line {number}: cannot be read ({type(error).__name__}); restore the file or "
                "move it away"
            ) from error
