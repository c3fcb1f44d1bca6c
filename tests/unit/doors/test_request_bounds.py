"""Every number that a request may carry has two finite bounds, and every list a greatest length."""

import math
from collections.abc import Iterator
from typing import Any

import pytest

from foveacam_server.app import create_app
from foveacam_server.foundation.settings import Settings

Schema = dict[str, Any]  # Any: a part of a JSON document
LOWER, UPPER = ("minimum", "exclusiveMinimum"), ("maximum", "exclusiveMaximum")
METHODS = ("get", "put", "post", "patch", "delete", "head", "options", "trace")


@pytest.fixture(scope="module")
def document() -> Schema:
    return create_app(Settings(viewer=False)).openapi()


def unbounded(document: Schema) -> list[str]:
    """Return where in the requests a number lacks a bound, or a list a greatest length."""
    return [f"{where}: {lack}" for where, schema in requested(document) for lack in lacks(schema)]


def requested(document: Schema) -> Iterator[tuple[str, Schema]]:
    """Yield every schema that a request's parameters and bodies hold, however deep, with the way to it."""
    for path, item in document["paths"].items():
        for method in METHODS:
            if method not in item:
                continue
            name = f"{method.upper()} {path}"
            for parameter in (*item.get("parameters", ()), *item[method].get("parameters", ())):
                where = f"{name} {parameter['in']} {parameter['name']}"
                yield from parts(document, parameter["schema"], where, frozenset())
            for media, content in item[method].get("requestBody", {}).get("content", {}).items():
                yield from parts(document, content.get("schema", {}), f"{name} {media}", frozenset())


def parts(
    document: Schema, schema: Schema, where: str, within: frozenset[str]
) -> Iterator[tuple[str, Schema]]:
    """Yield a schema and all that it is made of; `within`: references that are being followed."""
    yield where, schema
    reference = schema.get("$ref")
    if reference is not None and reference not in within:
        found = document
        for name in reference.removeprefix("#/").split("/"):
            found = found[name]
        yield from parts(document, found, where, within | {reference})
    for key in ("anyOf", "oneOf", "allOf", "prefixItems"):
        for number, part in enumerate(schema.get(key, ())):
            place = f"{where}[{number}]" if key == "prefixItems" else where
            yield from parts(document, part, place, within)
    for key, mark in (("items", "[]"), ("additionalProperties", ".*")):
        if isinstance(schema.get(key), dict):
            yield from parts(document, schema[key], where + mark, within)
    for key in ("properties", "patternProperties"):
        for name, part in schema.get(key, {}).items():
            yield from parts(document, part, f"{where}.{name}", within)


def lacks(schema: Schema) -> Iterator[str]:
    """Yield what bounds a schema itself lacks."""
    kinds = schema.get("type", ())
    kinds = {kinds} if isinstance(kinds, str) else set(kinds)
    if kinds & {"number", "integer"} and not {"enum", "const"} & schema.keys():
        for side in (LOWER, UPPER):
            if not any(math.isfinite(schema.get(key, math.inf)) for key in side):
                yield f"no finite {side[0]}"
    if "array" in kinds and "maxItems" not in schema and "prefixItems" not in schema:
        yield "no maxItems"


def test_every_number_and_list_of_a_request_is_bounded(document: Schema) -> None:
    assert unbounded(document) == []


def test_the_walk_reaches_the_numbers_of_requests(document: Schema) -> None:
    reached = {where for where, schema in requested(document) if schema.get("type") in ("number", "integer")}

    assert len(reached) >= 100
    body = "application/json"
    assert {
        f"PATCH /api/v1/cameras/{{role}} {body}.exposure_ms",
        f"POST /api/v1/captures {body}.plan.points.points[].ax_deg",
        f"POST /api/v1/planner/regions {body}.points_m[][]",
        "GET /api/v1/depth query x_px",
        "GET /api/v1/recordings/{recording_id}/frames/{role}/{index}.jpg path index",
    } <= reached


@pytest.mark.parametrize(
    ("schema", "where"),
    [
        ({"type": "number"}, ""),
        ({"type": ["integer", "null"], "minimum": 0, "maximum": 1e400}, ""),
        ({"anyOf": [{"type": "null"}, {"type": "integer", "minimum": 0}]}, ""),
        ({"type": "array", "maxItems": 2, "items": {"type": "number", "maximum": 1}}, "[]"),
        ({"type": "array", "prefixItems": [{"type": "number"}]}, "[0]"),
        ({"type": "object", "additionalProperties": {"type": "number"}}, ".*"),
        ({"type": "object", "properties": {"a": {"$ref": "#/components/schemas/Tree"}}}, ".a.high"),
        ({"type": "array", "items": {"type": "string"}}, ""),
    ],
)
def test_a_number_without_a_bound_is_named_by_the_way_to_it(schema: Schema, where: str) -> None:
    tree = {
        "type": "object",
        "properties": {"high": {"type": "number"}, "next": {"$ref": "#/components/schemas/Tree"}},
    }
    body = {"content": {"application/json": {"schema": schema}}}
    document = {
        "paths": {"/trees": {"post": {"requestBody": body}}},
        "components": {"schemas": {"Tree": tree}},
    }

    found = unbounded(document)

    assert found
    assert {line.split(":")[0] for line in found} == {f"POST /trees application/json{where}"}
