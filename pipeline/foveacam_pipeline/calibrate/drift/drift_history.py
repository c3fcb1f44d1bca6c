"""The history of drift checks: one line a check, in a file that is only ever added to."""

import json
import os
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import BinaryIO

from pydantic import TypeAdapter

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.drift.drift_values import DriftCheck
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
        with self._path.open("ab+") as file:
            if file.tell() and not _ends_with_newline(file):
                file.write(b"\n")  # after a line that was cut off
            file.write(json.dumps(line, allow_nan=False).encode("utf-8") + b"\n")
            file.flush()
            os.fsync(file.fileno())
        return record

    def records(self) -> list[DriftRecord]:
        """Return all checks, oldest first; a line that was cut off is left out."""
        if not self._path.exists():
            return []
        lines = enumerate(self._path.read_text(encoding="utf-8").splitlines(), start=1)
        found = (self._parsed(line, number) for number, line in lines if line)
        return [record for record in found if record is not None]

    def find(self, record_id: str) -> DriftRecord:
        """Return one check by its id."""
        for record in self.records():
            if record.id == record_id:
                return record
        raise InvalidInput(
            f"drift check {record_id!r} is not in {self._path}; list the checks and give one's id"
        )

    def _parsed(self, line: str, number: int) -> DriftRecord | None:
        """Return the check of a line; None when the machine stopped in the middle of writing it."""
        try:
            document = json.loads(line)
        except json.JSONDecodeError:
            return None
        try:
            if (document["format"], document["version"]) != (FORMAT, VERSION):
                raise ValueError(f"not of version {VERSION}")
            return DriftRecord(
                id=document["id"],
                created_utc=document["created_utc"],
                check=TypeAdapter(DriftCheck).validate_json(json.dumps(document["check"])),
                new_calibration_id=document["new_calibration_id"],
            )
        except (ValueError, KeyError, TypeError) as error:
            raise InvalidInput(
                f"{self._path}, line {number}: not a drift check that can be read ({type(error).__name__}); "
                "restore the file or move it away"
            ) from error


def _ends_with_newline(file: BinaryIO) -> bool:
    file.seek(-1, os.SEEK_END)
    return file.read(1) == b"\n"
