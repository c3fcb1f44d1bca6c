"""Calibration record of the authors' application: the inner document of measurements, and its metadata.

The inner document is preserved with every field, because its hash is the record's id.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.calibrate.exchange.canonical import Json, record_id
from foveacam_pipeline.calibrate.exchange.documents import (
    ExtrinsicInner,
    IntrinsicInner,
)

LETTERS = {"L": Role.LEFT, "C": Role.WIDE, "R": Role.RIGHT}
LETTER_OF = {role: letter for letter, role in LETTERS.items()}
_Parsed = TypeVar("_Parsed", bound=BaseModel)


class RecordKind(StrEnum):
    """Kind of a record."""

    EXTRINSIC = "extrinsic"
    """The poses of one eye."""
    INTRINSIC = "intrinsic"
    """The solve of one camera."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ExchangeRecord:
    """A record. `inner`: its immutable part; `created_utc`: ISO 8601.

    `role`: its camera, None when the file does not give it. `sources`: ids of the records it was combined
    from. `stated_id`: the id in its file.
    """

    kind: RecordKind
    inner: Mapping[str, Json]
    created_utc: str
    label: str | None = None
    sources: tuple[str, ...] = ()
    role: Role | None = None
    stated_id: str | None = None

    @property
    def id(self) -> str:
        """Id of the record: the hash of its inner document."""
        return record_id(self.inner)

    @property
    def warning(self) -> str | None:
        """Warning when the id in the file differs from the hash of its content; else None."""
        if self.stated_id is None or self.stated_id == self.id:
            return None
        return f"the file says {self.stated_id}, its content is {self.id}; it counts as the latter"

    def check(self, *, kind: RecordKind, role: Role) -> None:
        """Raise InvalidInput unless the record is of this kind and, if it names a camera, of this one."""
        if self.kind is not kind:
            raise InvalidInput(
                f"record {self.id} is {self.kind.value}, {kind.value} is needed here; give the other record"
            )
        if self.role is not None and self.role is not role:
            raise InvalidInput(
                f"record {self.id} is of the {self.role.value} camera, one of the {role.value} camera is "
                "needed here; give the records in their places"
            )

    def extrinsic(self) -> ExtrinsicInner:
        """Return the poses; raise InvalidInput when they are invalid."""
        return parsed(ExtrinsicInner, self.inner, what=f"record {self.id}")

    def intrinsic(self) -> IntrinsicInner:
        """Return the solve; raise InvalidInput when it is invalid."""
        return parsed(IntrinsicInner, self.inner, what=f"record {self.id}")


def parsed(model: type[_Parsed], document: object, *, what: str) -> _Parsed:
    """Return a document parsed as a model, or raise InvalidInput naming the first invalid field."""
    try:
        return model.model_validate(document)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"]) or "the document"
        raise InvalidInput(f"{what}: {where}: {first['msg']}; give the file as it was exported") from error


def checked_date(text: str, *, what: str) -> str:
    """Return an ISO 8601 date with its time zone, or raise InvalidInput."""
    try:
        zoned = datetime.fromisoformat(text).tzinfo is not None
    except ValueError:
        zoned = False
    if not zoned:
        raise InvalidInput(f"{what}: date {text!r} is not like 2026-01-31T12:00:00.000Z; correct it")
    return text
