"""A call of an operation before it is sent, and the job that a call has started."""

import uuid
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar
from urllib.parse import quote

from pydantic import BaseModel

from foveacam_client.document import Document
from foveacam_client.generated import models

ResultT = TypeVar("ResultT", bound=Document)

_SAFE = ("GET", "HEAD")
_KEY = "Idempotency-Key"


@dataclass(frozen=True, slots=True)
class Call:
    """An operation with its values; `path`: with the names of `path_values` in braces.

    `idempotent`: the operation takes an Idempotency-Key; without one given, each call gets its own. `also`:
    statuses other than success that come with the same document.
    """

    method: str
    path: str
    path_values: Mapping[str, object] = field(default_factory=dict)
    query: Mapping[str, object] = field(default_factory=dict)
    body: BaseModel | Mapping[str, object] | None = None
    content: bytes | None = None
    idempotent: bool = False
    idempotency_key: str | None = None
    also: tuple[int, ...] = ()

    @property
    def address(self) -> str:
        """The path with the values in it."""
        values = {name: quote(str(value), safe="") for name, value in self.path_values.items()}
        return self.path.format(**values)

    @property
    def set_query(self) -> dict[str, str]:
        """The values of the query that were given, as text."""
        return {name: _text(value) for name, value in self.query.items() if value is not None}

    @property
    def json_body(self) -> Any:  # noqa: ANN401 - a JSON document
        """The body as a JSON document; None without one."""
        return self.body.model_dump(mode="json") if isinstance(self.body, BaseModel) else self.body

    def headers(self) -> dict[str, str]:
        """Return the headers specific to this call."""
        headers = {} if self.content is None else {"Content-Type": "application/octet-stream"}
        return {**headers, _KEY: self.idempotency_key or uuid.uuid4().hex} if self.idempotent else headers

    @property
    def repeatable(self) -> bool:
        """Whether the call is idempotent, so that it may be retried."""
        return self.method in _SAFE or self.idempotent


@dataclass(frozen=True, slots=True)
class StartedJob(Generic[ResultT]):
    """A job accepted by the server, with the type of its result."""

    job: models.JobDocument
    result: type[ResultT]

    @property
    def id(self) -> str:
        """The job's id."""
        return self.job.id


def _text(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
