"""The document of the REST interface cut short: to draw all of it takes the browser ten seconds."""

import json
import re
from typing import Any

from playwright.sync_api import Route

Json = dict[str, Any]  # Any: parts of an OpenAPI document
_SCHEMA = re.compile(r'"#/components/schemas/([^"]+)"')


def shortened(document: Json, *kept: str) -> Json:
    """Return the document with these paths alone, and the schemas that they refer to."""
    paths = {path: document["paths"][path] for path in kept}
    components = document["components"]
    rest = {name: part for name, part in components.items() if name != "schemas"}
    schemas = _needed(components["schemas"], json.dumps([paths, rest]))
    return document | {"paths": paths, "components": rest | {"schemas": schemas}}


def _needed(schemas: Json, text: str) -> Json:
    """Return the schemas that a text refers to, and those that they refer to."""
    found: Json = {}
    names = set(_SCHEMA.findall(text))
    while names:
        found |= {name: schemas[name] for name in names}
        names = set(_SCHEMA.findall(json.dumps(found))) - found.keys()
    return found


def describe_in_short(route: Route, *kept: str) -> None:
    """Answer with the server's own document, of which these paths are left."""
    route.fulfill(json=shortened(route.fetch().json(), *kept))
