"""Base class of the documents of requests and answers."""

from typing import Any, TypeAlias

from pydantic import BaseModel, ConfigDict, SerializerFunctionWrapHandler, model_serializer

JsonObject: TypeAlias = dict[str, Any]
"""An object whose names the API leaves open; Any: its values too."""


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
