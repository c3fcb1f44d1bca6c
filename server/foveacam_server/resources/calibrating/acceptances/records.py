"""The acceptance runs of a data directory: a folder each, with the result, its report and its pictures."""

import re
from pathlib import Path

from pydantic import ValidationError

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.accept.values import Acceptance
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.storage.disk import disk_errors, write_file
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.names import new_id
from foveacam_server.resources.calibrating.acceptances.schema import AcceptanceDocument

RESULT, REPORT = "acceptance.json", "report.html"
_NAME = re.compile(r"[a-z0-9_-]{1,64}")


class AcceptanceRecords:
    """Stores, lists and returns runs; the folders are the only record of them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def add(self, found: Acceptance, calibration: Calibration | None) -> AcceptanceDocument:
        """Store a run with its report; `calibration`: that was in force."""
        # a server's start has no use for reports and fits, which load slowly
        from foveacam_server.resources.calibrating.acceptances.report import report_html
        from foveacam_server.resources.calibrating.report.page import table2_rows
        from foveacam_server.resources.calibrating.sessions.settle_step import settled_axis

        document = AcceptanceDocument.of(found, acceptance_id=new_id("accept"))
        home = self.folder / document.id
        axes = () if found.settling is None else [settled_axis(axis) for axis in found.settling.axes]
        table2 = () if calibration is None else table2_rows(calibration, axes)
        report = report_html(document, pictures=found.pictures, table2=table2)
        with disk_errors("the acceptance run", home):
            home.mkdir(parents=True, exist_ok=True)
            for name, picture in found.pictures.items():
                write_file(home / f"{name}.png", picture)
            write_file(home / REPORT, report.encode("utf-8"))
            write_file(home / RESULT, document.model_dump_json(indent=1).encode("utf-8"))
        return document

    def every(self) -> list[AcceptanceDocument]:
        """Return all runs that can be read, newest first."""
        found = []
        for path in self.folder.glob(f"*/{RESULT}"):
            try:
                found.append(self._read(path))
            except InvalidInput:
                continue
        return sorted(found, key=lambda one: one.created_utc, reverse=True)

    def get(self, acceptance_id: str) -> AcceptanceDocument:
        """Return a run; raise `NotFound` for an unknown id, InvalidInput for a damaged file."""
        path = self._home(acceptance_id) / RESULT
        if not path.is_file():
            raise _unknown(acceptance_id)
        return self._read(path)

    def report(self, acceptance_id: str) -> bytes:
        """Return the HTML report of a run."""
        self.get(acceptance_id)
        return (self._home(acceptance_id) / REPORT).read_bytes()

    def picture(self, acceptance_id: str, name: str) -> bytes:
        """Return a picture of a run, PNG."""
        path = self._home(acceptance_id) / f"{name}.png"
        if not _NAME.fullmatch(name) or not path.is_file():
            raise NotFound(
                f"acceptance {acceptance_id} has no picture {name!r}; its checks name their pictures",
                asked=name,
            )
        return path.read_bytes()

    def of(self, calibration_id: str) -> list[AcceptanceDocument]:
        """Return the runs that judged a calibration, newest first."""
        return [one for one in self.every() if one.calibration_id == calibration_id]

    def _home(self, acceptance_id: str) -> Path:
        if not _NAME.fullmatch(acceptance_id):
            raise _unknown(acceptance_id)
        return self.folder / acceptance_id

    def _read(self, path: Path) -> AcceptanceDocument:
        try:
            return AcceptanceDocument.model_validate_json(path.read_bytes())
        except (OSError, ValidationError) as error:
            raise InvalidInput(
                f"acceptance run {path.parent.name} cannot be read", remedy="run it again"
            ) from error


def _unknown(acceptance_id: str) -> NotFound:
    return NotFound(
        f"there is no acceptance run {acceptance_id}; see /api/v1/acceptances", asked=acceptance_id
    )
