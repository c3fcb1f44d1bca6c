"""`dataset.json`: the description of a dataset, with its calibration embedded."""

import json
import secrets
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from importlib.metadata import version as version_of
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, JsonValue, ValidationError

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.capture.dataset.images import ImageCodec
from foveacam_pipeline.capture.dataset.values import DatasetState
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.calibration_file import FORMAT as CALIBRATION_FORMAT
from foveacam_pipeline.models.calibration_file import VERSION as CALIBRATION_VERSION
from foveacam_pipeline.models.calibration_file import calibration_from
from foveacam_pipeline.models.content import content_id, plain
from foveacam_pipeline.storage.disk import write_file

DOCUMENT = "dataset.json"
FORMAT = "foveacam-dataset"
VERSION = 1
LICENCE = "all rights reserved"
"""The licence of a dataset for which none was chosen."""


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DatasetHeader:
    """The description of a dataset before its first point.

    `points`: number of points of the plan, all scans together. `plan`, `rig`, `conditions`: any JSON
    objects; `rig` names the devices. `licence`: an SPDX name or a sentence.
    """

    points: int
    plan: dict[str, JsonValue] = field(default_factory=dict)
    rig: dict[str, JsonValue] = field(default_factory=dict)
    conditions: dict[str, JsonValue] = field(default_factory=dict)
    calibration: Calibration | None = None
    label: str = ""
    licence: str = LICENCE
    codec: ImageCodec = ImageCodec.TIFF
    created_utc: str = field(default_factory=_now)
    id: str = field(default_factory=lambda: secrets.token_hex(8))

    @property
    def rig_id(self) -> str | None:
        """Id of the rig; None where the description has none."""
        found = self.rig.get("rig_id")
        return found if isinstance(found, str) else None


class _Document(BaseModel):
    model_config = ConfigDict(extra="ignore", strict=False, allow_inf_nan=False)

    id: Annotated[str, Field(min_length=1, max_length=100)]
    hash: str
    created_utc: datetime
    software: dict[str, str]
    points: Annotated[int, Field(gt=0)]
    codec: ImageCodec
    state: DatasetState
    why: str
    label: str
    licence: str
    rig: dict[str, JsonValue]
    conditions: dict[str, JsonValue]
    plan: dict[str, JsonValue]
    calibration: dict[str, JsonValue] | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DatasetDocument:
    """The content of `dataset.json`. `why`: why a partial dataset ended, in words.

    `stated_hash`: the hash of the permanent part as the file states it; None before it was written.
    """

    header: DatasetHeader
    software: dict[str, str]
    state: DatasetState
    why: str = ""
    stated_hash: str | None = None

    def with_state(self, state: DatasetState, why: str = "") -> "DatasetDocument":
        """Return a copy in another state."""
        return replace(self, state=state, why=why)

    def with_description(self, *, label: str | None = None, licence: str | None = None) -> "DatasetDocument":
        """Return a copy with another label or licence."""
        header = self.header
        label = header.label if label is None else label
        licence = header.licence if licence is None else licence
        return replace(self, header=replace(header, label=label, licence=licence))


def new_document(header: DatasetHeader) -> DatasetDocument:
    """Return the document of a new dataset."""
    if header.points <= 0:
        raise InvalidInput(f"a dataset of {header.points} points was asked for; plan one point or more")
    software = {"foveacam-duo": version_of("foveacam-duo")}
    return DatasetDocument(header=header, software=software, state=DatasetState.RUNNING)


def write_document(folder: Path, document: DatasetDocument) -> None:
    """Write `dataset.json` atomically. Raise OSError, or InvalidInput for values that JSON cannot express."""
    header = document.header
    try:
        content = {
            "format": FORMAT,
            "version": VERSION,
            "hash": permanent_hash(document),
            "state": document.state.value,
            "why": document.why,
            "label": header.label,
            "licence": header.licence,
            **_permanent(document),
            "calibration": None if header.calibration is None else calibration_document(header.calibration),
        }
        text = json.dumps(content, indent=1, allow_nan=False, ensure_ascii=False) + "\n"
    except (TypeError, ValueError) as error:
        raise InvalidInput(
            f"the dataset's plan, rig or conditions are no JSON ({error}); fix them"
        ) from error
    write_file(folder / DOCUMENT, text.encode("utf-8", "strict"))


def permanent_hash(document: DatasetDocument) -> str:
    """Return the hash of the permanent part of `dataset.json`: all but state, label and licence."""
    calibration = document.header.calibration
    lasting = plain(_permanent(document))
    return content_id({"lasting": lasting, "calibration": None if calibration is None else calibration.id})


def _permanent(document: DatasetDocument) -> dict[str, object]:
    header = document.header
    return {
        "id": header.id,
        "created_utc": header.created_utc,
        "software": document.software,
        "points": header.points,
        "codec": header.codec.value,
        "rig": header.rig,
        "conditions": header.conditions,
        "plan": header.plan,
    }


def read_document(folder: Path) -> DatasetDocument:
    """Read `dataset.json`; raise InvalidInput when it is missing, or of another format or version."""
    found = _json_of(folder / DOCUMENT)
    try:
        read = _Document.model_validate(found)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise InvalidInput(
            f"{folder / DOCUMENT}: {where}: {first['msg']}; restore the file from a copy"
        ) from error
    calibration = None
    if read.calibration is not None:
        calibration = calibration_from(read.calibration, what=f"in {folder / DOCUMENT}")
    header = DatasetHeader(
        points=read.points,
        plan=read.plan,
        rig=read.rig,
        conditions=read.conditions,
        calibration=calibration,
        label=read.label,
        licence=read.licence,
        codec=read.codec,
        created_utc=str(found["created_utc"]),
        id=read.id,
    )
    return DatasetDocument(
        header=header, software=read.software, state=read.state, why=read.why, stated_hash=read.hash
    )


def calibration_document(calibration: Calibration) -> dict[str, object]:
    """Return the content of the calibration's own file."""
    return {
        "format": CALIBRATION_FORMAT,
        "version": CALIBRATION_VERSION,
        "hash": calibration.id,
        "calibration": plain(calibration),
    }


def _json_of(path: Path) -> dict[str, Any]:  # Any: JSON of unknown shape, checked by _Document
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError) as error:
        raise InvalidInput(
            f"{path.parent} is no dataset: it has no {DOCUMENT}; give the folder of a dataset"
        ) from error
    except (OSError, ValueError, RecursionError) as error:
        raise InvalidInput(f"{path} cannot be read as JSON ({error}); restore it from a copy") from error
    if not isinstance(found, dict) or found.get("format") != FORMAT:
        raise InvalidInput(f"{path}: format {FORMAT!r} is needed; give the folder of a dataset")
    version = found.get("version")
    if version != VERSION:
        newer = isinstance(version, int) and version > VERSION
        raise InvalidInput(
            f"{path}: version {version!r} was found, this program reads {VERSION}",
            asked=f"version {VERSION}",
            found=f"version {version!r}",
            remedy="use a newer version of this program" if newer else "use the program that wrote it",
        )
    return found
