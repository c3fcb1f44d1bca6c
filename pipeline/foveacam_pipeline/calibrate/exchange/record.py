"""One calibration record of the authors' application: what was measured, and what is known about it.

The inner document is kept as it came, every field of it, for its hash is the record's name.
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
    Association,
    ExtrinsicInner,
    IntrinsicInner,
)

LETTERS = {"L": Role.LEFT, "C": Role.WIDE, "R": Role.RIGHT}
LETTER_OF = {role: letter for letter, role in LETTERS.items()}
_Parsed = TypeVar("_Parsed", bound=BaseModel)


class RecordKind(StrEnum):
    """What a record holds."""

    EXTRINSIC = "extrinsic"
    """The poses of one eye."""
    INTRINSIC = "intrinsic"
    """The solve of one camera."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ExchangeRecord:
    """A record. `inner` is its immutable part; `created_utc` ISO 8601.

    `role`: which camera it is of, None when the file does not say. `sources`: ids of what it was combined
    from. `stated_id`: the id that its file gave.
    """

    kind: RecordKind
    inner: Mapping[str, Json]
    created_utc: str
    label: str | None = None
    sources: tuple[str, ...] = ()
    role: Role | None = None
    associations: tuple[Association, ...] = ()
    stated_id: str | None = None

    @property
    def id(self) -> str:
        """Name of the record: the hash of its inner document."""
        return record_id(self.inner)

    @property
    def warning(self) -> str | None:
        """What an importer must tell: the file names another id than its content has."""
        if self.stated_id is None or self.stated_id == self.id:
            return None
        return f"the file says {self.stated_id}, its content is {self.id}; it counts as the latter"

    def check(self, *, kind: RecordKind, role: Role) -> None:
        """Raise InvalidInput unless the record is of this kind, and of this camera as far as it says."""
        if self.kind is not kind:
            raise InvalidInput(
                f"record {self.id} is {self.kind.value}, {kind.value} is needed here; give the other record"
            )
        if self.role is not None and self.role is not role:
            raise InvalidInput(
                f"record {self.id} is of the {self.role.value} camera, one of the {role.value} camera is "
                "needed here; give the records in their places"
            )

    def check_camera(self, key: str) -> None:
        """Raise InvalidInput when the record is bound to cameras, but not to the one with this key."""
        keys = sorted({association.camera_key for association in self.associations})
        if keys and key not in keys:
            raise InvalidInput(
                f"record {self.id} belongs to {', '.join(keys)}, this camera is {key}; "
                "give the record of this camera"
            )

    def extrinsic(self) -> ExtrinsicInner:
        """Return the poses; raise InvalidInput when they are not as they should be."""
        return parsed(ExtrinsicInner, self.inner, what=f"record {self.id}")

    def intrinsic(self) -> IntrinsicInner:
        """Return the solve; raise InvalidInput when it is not as it should be."""
        return parsed(IntrinsicInner, self.inner, what=f"record {self.id}")


def parsed(model: type[_Parsed], document: object, *, what: str) -> _Parsed:
    """Return a document in the shape of a model, or raise InvalidInput naming the first thing amiss."""
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
