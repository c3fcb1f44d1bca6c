"""Base class of the documents of requests and answers."""

from typing import Any, TypeAlias

from pydantic import BaseModel, ConfigDict, SerializerFunctionWrapHandler, model_serializer

from foveacam_client.measured import measured_text, shortened

JsonObject: TypeAlias = dict[str, Any]
"""An object whose names the API leaves open; Any: its values too."""

_DESCRIBING = ("id", "name", "label", "holder", "kind", "role", "state", "basis", "verdict", "points")
"""Fields by which a document with an id is described, in this order."""
_MEASURED = ("distance", "length", "baseline")
"""Lengths that are described with their standard errors."""


class Document(BaseModel):
    """A document; fields that were never set and have no value are not sent."""

    model_config = ConfigDict(protected_namespaces=())

    @model_serializer(mode="wrap")
    def _without_unset_nulls(self, serialize: SerializerFunctionWrapHandler) -> JsonObject:
        content: JsonObject = serialize(self)
        return {
            name: value
            for name, value in content.items()
            if value is not None or name in self.model_fields_set
        }

    def __repr__(self) -> str:
        if "id" not in type(self).model_fields:
            return super().__repr__()
        return f"{type(self).__name__}({', '.join(self._description())})"

    def __str__(self) -> str:
        return repr(self)

    def _description(self) -> list[str]:
        """Return what tells this document from others: id, state, measured lengths, basis."""
        values = {name: getattr(self, name) for name in _DESCRIBING if name in type(self).model_fields}
        parts = [f"{name}={_value_text(value)}" for name, value in values.items() if value not in (None, "")]
        for noun in _MEASURED:
            value_m = getattr(self, f"{noun}_m", None)
            if value_m is not None:
                sigma_m = getattr(self, f"{noun}_sigma_m", None)
                parts.insert(1, f"{noun}={measured_text(value_m, sigma_m, 'm')}")
        return parts


def _value_text(value: object) -> str:
    if isinstance(value, str):
        return repr(shortened(value))
    return f"{len(value)} items" if isinstance(value, list) else str(value)
