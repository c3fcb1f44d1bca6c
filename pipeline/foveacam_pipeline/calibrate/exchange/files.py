"""Device bundles of the authors' application as JSON documents; invalid ones are refused by name."""

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.exchange.canonical import Json
from foveacam_pipeline.calibrate.exchange.documents import DeviceConfig, ExportedRecord
from foveacam_pipeline.calibrate.exchange.record import (
    LETTER_OF,
    LETTERS,
    ExchangeRecord,
    RecordKind,
    checked_date,
    parsed,
)

BUNDLE_SCHEMA = "fovea-device-config@1"

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DeviceBundle:
    """A rig's settings with all its records.

    `config`: the document, unchanged; `settings`: its parsed form.
    """

    config: Mapping[str, Json]
    records: tuple[ExchangeRecord, ...]

    @property
    def settings(self) -> DeviceConfig:
        """The operator's settings."""
        return parsed(DeviceConfig, self.config, what="device bundle")


def bundle_document(bundle: DeviceBundle, *, exported: datetime) -> dict[str, Json]:
    """Return the document of a bundle."""
    document: dict[str, Json] = {"schema": BUNDLE_SCHEMA, "exported": date_text(exported)}
    document["config"] = bundle.config
    document["records"] = [_exported(record) for record in bundle.records]
    return document


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
    bundle = DeviceBundle(
        config=_mapping(document, "config", what=what),
        records=tuple(
            _from_export(_as_mapping(item, what=f"{what}: records.{k}"), what=f"{what}: records.{k}")
            for k, item in enumerate(records)
        ),
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
