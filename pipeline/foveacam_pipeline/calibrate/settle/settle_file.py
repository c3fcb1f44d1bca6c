"""The file of a settling report: JSON with format and version, written whole, then renamed."""

import json
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.settle.settle_values import SettleReport
from foveacam_pipeline.models.content import plain
from foveacam_pipeline.storage.disk import write_file

FORMAT = "foveacam-settle"
VERSION = 1


def save_settle(report: SettleReport, path: Path) -> None:
    """Write a report; one that was there is replaced."""
    document = {"format": FORMAT, "version": VERSION, "report": plain(report)}
    path.parent.mkdir(parents=True, exist_ok=True)
    write_file(path, json.dumps(document, allow_nan=False).encode("utf-8"))


def load_settle(path: Path) -> SettleReport:
    """Read a report; raise InvalidInput when it cannot be trusted."""
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise InvalidInput(
            f"settling report {path} cannot be read ({error}); measure how the mirrors settle again"
        ) from error
    if not isinstance(document, dict) or (document.get("format"), document.get("version")) != (
        FORMAT,
        VERSION,
    ):
        raise InvalidInput(f"{path}: not a settling report of version {VERSION}; give another file")
    try:
        return TypeAdapter(SettleReport).validate_json(json.dumps(document.get("report")))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise InvalidInput(
            f"settling report {path}: {where}: {first['msg']}; measure how the mirrors settle again"
        ) from error
