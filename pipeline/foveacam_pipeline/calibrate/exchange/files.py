"""Reading and writing of the authors' files: single records, stored records and device bundles.

Invalid files are refused by name; existing files are never overwritten.
"""

import json
import logging
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import NoReturn

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.exchange.canonical import Json
from foveacam_pipeline.calibrate.exchange.documents import DeviceConfig, ExportedRecord, StoredRecord
from foveacam_pipeline.calibrate.exchange.record import (
    LETTER_OF,
    LETTERS,
    ExchangeRecord,
    RecordKind,
    checked_date,
    parsed,
)
from foveacam_pipeline.calibrate.records.new_file import write_new

RECORD_SCHEMA = "fovea-calibration-record@1"
BUNDLE_SCHEMA = "fovea-device-config@1"
LARGEST_BYTES = 64 * 2**20
"""Maximum size of a file that is read; a record of 1000 poses has about 2 MB."""

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DeviceBundle:
    """A rig's settings with all its records.

    `config`: the document, unchanged; `settings`: its parsed form. `triple`: hash of its three cameras' keys.
    """

    config: Mapping[str, Json]
    records: tuple[ExchangeRecord, ...]
    triple: str | None = None

    @property
    def settings(self) -> DeviceConfig:
        """The operator's settings."""
        return parsed(DeviceConfig, self.config, what="device bundle")


def read_record(path: Path) -> ExchangeRecord:
    """Read a record that was exported, or one from the store of the authors' application."""
    return record_from(_read(path), what=str(path))


def read_bundle(path: Path) -> DeviceBundle:
    """Read a device bundle."""
    return bundle_from(_read(path), what=str(path))


def write_record(record: ExchangeRecord, path: Path, *, exported: datetime) -> None:
    """Write a record as the authors' application exports it; `path` must be free."""
    write_new(path, _text(record_document(record, exported=exported)))


def write_bundle(bundle: DeviceBundle, path: Path, *, exported: datetime) -> None:
    """Write a device bundle; `path` must be free."""
    write_new(path, _text(bundle_document(bundle, exported=exported)))


def record_document(record: ExchangeRecord, *, exported: datetime) -> dict[str, Json]:
    """Return the export document of a record."""
    return {"schema": RECORD_SCHEMA, "exported": date_text(exported), "record": _exported(record)}


def bundle_document(bundle: DeviceBundle, *, exported: datetime) -> dict[str, Json]:
    """Return the document of a bundle."""
    document: dict[str, Json] = {"schema": BUNDLE_SCHEMA, "exported": date_text(exported)}
    if bundle.triple is not None:
        document["sourceTripleHash"] = bundle.triple
    document["config"] = bundle.config
    document["records"] = [_exported(record) for record in bundle.records]
    return document


def record_from(document: Mapping[str, Json], *, what: str) -> ExchangeRecord:
    """Return the record of an export document or of a stored one; `what` names it in refusals."""
    if document.get("schema") == RECORD_SCHEMA:
        return _from_export(_mapping(document, "record", what=what), what=what)
    if "schema" not in document and "inner" in document and "outer" in document:
        return _from_store(document, what=what)
    raise InvalidInput(
        f"{what}: a document {RECORD_SCHEMA!r} is needed, {document.get('schema')!r} was found; "
        "give the file of a calibration record"
    )


def bundle_from(document: Mapping[str, Json], *, what: str) -> DeviceBundle:
    """Return the bundle of its document; raise InvalidInput when any record is invalid."""
    if document.get("schema") != BUNDLE_SCHEMA:
        raise InvalidInput(
            f"{what}: a document {BUNDLE_SCHEMA!r} is needed, {document.get('schema')!r} was found; "
            "give the file of a device bundle"
        )
    records = document.get("records")
    if not isinstance(records, list):
        raise InvalidInput(f"{what}: records: a list is needed; give the file as it was exported")
    triple = document.get("sourceTripleHash")
    bundle = DeviceBundle(
        config=_mapping(document, "config", what=what),
        records=tuple(
            _from_export(_as_mapping(item, what=f"{what}: records.{k}"), what=f"{what}: records.{k}")
            for k, item in enumerate(records)
        ),
        triple=triple if isinstance(triple, str) else None,
    )
    parsed(DeviceConfig, bundle.config, what=f"{what}: config")
    return bundle


def date_text(moment: datetime) -> str:
    """Return a date as the authors' application writes it: UTC, milliseconds, Z."""
    return moment.astimezone(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def _from_export(document: Mapping[str, Json], *, what: str) -> ExchangeRecord:
    facts = parsed(ExportedRecord, document, what=what)
    inner = _mapping(document, "inner", what=what)
    record = ExchangeRecord(
        kind=_kind(inner, what=what),
        inner=inner,
        created_utc=checked_date(facts.created, what=what),
        label=facts.label,
        sources=tuple(facts.sources or ()),
        role=LETTERS[facts.role] if facts.role else None,
        stated_id=facts.id,
    )
    return _checked(record, what=what)


def _from_store(document: Mapping[str, Json], *, what: str) -> ExchangeRecord:
    facts = parsed(StoredRecord, document, what=what)
    inner = _mapping(document, "inner", what=what)
    roles = {association.role for association in facts.outer.associations if association.role}
    record = ExchangeRecord(
        kind=_kind(inner, what=what),
        inner=inner,
        created_utc=checked_date(facts.outer.created, what=what),
        label=facts.outer.label,
        sources=tuple(facts.outer.sources or ()),
        role=LETTERS[roles.pop()] if len(roles) == 1 else None,
        associations=tuple(facts.outer.associations),
        stated_id=facts.id,
    )
    return _checked(record, what=what)


def _checked(record: ExchangeRecord, *, what: str) -> ExchangeRecord:
    """Return the record; raise InvalidInput unless all of it can be parsed."""
    try:
        _ = record.extrinsic() if record.kind is RecordKind.EXTRINSIC else record.intrinsic()
    except InvalidInput as error:
        raise InvalidInput(f"{what}: {error}") from error
    if record.warning:
        logger.warning("%s: %s", what, record.warning)
    return record


def _kind(inner: Mapping[str, Json], *, what: str) -> RecordKind:
    kind = inner.get("kind")
    if kind not in {known.value for known in RecordKind}:
        raise InvalidInput(
            f"{what}: inner.kind: extrinsic or intrinsic is needed, {kind!r} was found; "
            "give the file as it was exported"
        )
    return RecordKind(str(kind))


def _exported(record: ExchangeRecord) -> dict[str, Json]:
    document: dict[str, Json] = {"id": record.id, "inner": record.inner, "created": record.created_utc}
    if record.label is not None:
        document["label"] = record.label
    if record.sources:
        document["sources"] = list(record.sources)
    if record.role is not None:
        document["role"] = LETTER_OF[record.role]
    return document


def _mapping(document: Mapping[str, Json], key: str, *, what: str) -> Mapping[str, Json]:
    return _as_mapping(document.get(key), what=f"{what}: {key}")


def _as_mapping(value: Json, *, what: str) -> Mapping[str, Json]:
    if not isinstance(value, Mapping):
        raise InvalidInput(f"{what}: an object is needed; give the file as it was exported")
    return value


def _text(document: Mapping[str, Json]) -> str:
    return json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _read(path: Path) -> Mapping[str, Json]:
    try:
        if path.stat().st_size > LARGEST_BYTES:
            raise InvalidInput(
                f"{path} has {path.stat().st_size} bytes, a record has {LARGEST_BYTES} at most; "
                "give the file of a record"
            )
        document = json.loads(path.read_text(encoding="utf-8"), parse_constant=_refuse_constant)
    except FileNotFoundError as error:
        raise InvalidInput(f"there is no file {path}; give the path of an exported record") from error
    except (OSError, ValueError, RecursionError) as error:
        raise InvalidInput(
            f"{path} cannot be read as JSON ({error}); it is damaged or cut off, export it again"
        ) from error
    return _as_mapping(document, what=str(path))


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is no number")
