"""Numbers at the bounds that the REST interface states are computed with, or refused in short words."""

import copy
import math
import re
from collections.abc import Iterator, Sequence
from typing import Any

import pytest

from tests.support.servers.running_server import API, Running

pytestmark = pytest.mark.timeout(300)

Json = Any  # Any: a part of a JSON document
Way = tuple[str | int, ...]

STOPPED = ("POST", "/fixations")
"""Tried while the stop is engaged: the numbers are checked, and nothing is looked at."""
AHEAD = {"ax_deg": 0.0, "ay_deg": 0.0}
GRID = {"kind": "grid", "columns": 2, "rows": 2, "centre_ax_deg": 0.0, "centre_ay_deg": 0.0}
HALVES = {"half_width_deg": 1.0, "half_height_deg": 1.0}
SET_POINT = {"ax_deg": 1.0, "ay_deg": 1.0, "distance_m": 5.0, "shift_deg": 0.1}
RING = {"feature_mm": 20.0, "px_per_deg": 502.0, "pixels": 1.0, "d_min_m": 1.0, "near_error_m": 0.1}
POINTS = [{"view": "wide", "x_px": 700.0, "y_px": 500.0}]
PLAN = {"exposures_ms": [5.0], "stack_frames": 1, "rail_positions_mm": [0.0], "points": {**GRID, **HALVES}}
RANDOM = {
    "kind": "random",
    "seed": 1,
    "size_m": 60.0,
    "obstacles": 5,
    "targets": 1,
    "smallest_radius_m": 0.6,
    "largest_radius_m": 1.8,
    "agent_radius_m": 0.3,
}
MAP = {
    "type": "FeatureCollection",
    "features": [
        {
            "type": "Feature",
            "properties": {"kind": "target"},
            "geometry": {"type": "Point", "coordinates": [5.0, 5.0]},
        }
    ],
}
BODIES: Sequence[tuple[str, str, Json]] = [
    (
        "PATCH",
        "/cameras/{role}",
        {"exposure_ms": 8.0, "gain_db": 1.0, "black_level": 1.0, "frame_rate_hz": 30.0},
    ),
    ("POST", "/mirrors/steer", {"direction": AHEAD, "distance_m": 4.0}),
    ("POST", "/measurements", {"kind": "point", "points": POINTS}),
    ("POST", "/pan_tilt/moves", {"pan_deg": 0.0, "tilt_deg": 0.0}),
    ("POST", "/rail/moves", {"position_mm": 0.0}),
    ("POST", "/captures/estimates", {"plan": PLAN, "distance_m": 5.0}),
    ("POST", "/captures/estimates", {"plan": {"points": GRID}}),
    (
        "POST",
        "/captures/estimates",
        {
            "plan": {
                "points": {"kind": "set_points", "points": [SET_POINT]},
                "verging": {"mode": "given", "distance_m": 5.0},
            }
        },
    ),
    (
        "POST",
        "/planner/standoff",
        {"ring": RING, "clutter": {"occupancy": 0.1, "radius_m": 0.5}, "domain_m2": 1e6},
    ),
    ("POST", "/planner/map", RANDOM),
    ("POST", "/planner/map", {"kind": "open", "size_m": 60.0}),
    ("POST", "/planner/map", {"kind": "geojson", "document": MAP, "m_per_unit": 1.0}),
    (
        "POST",
        "/planner/regions",
        {
            "map": MAP,
            "targets_m": [[5.0, 5.0]],
            "ring": RING,
            "agent_radius_m": 0.3,
            "points_m": [[1.0, 1.0]],
        },
    ),
    ("POST", "/fixations", {"pixel": {"x_px": 700.0, "y_px": 500.0}}),
    (
        "POST",
        "/fixations",
        {"rectangle": {"x_px": 700.0, "y_px": 500.0, "width_px": 50.0, "height_px": 50.0}},
    ),
    ("POST", "/fixations", {"direction": AHEAD, "within": {"nearest_m": 1.0, "farthest_m": 10.0}}),
]


class Interface:
    """The OpenAPI document, and what it says of the numbers of a body."""

    def __init__(self, document: Json) -> None:
        self._document = document

    def body(self, method: str, path: str) -> Json:
        content = self._document["paths"][API + path][method.lower()]["requestBody"]["content"]
        return content["application/json"]["schema"]

    def numbers(self, schema: Json, value: Json, way: Way = ()) -> Iterator[tuple[Way, tuple[float, float]]]:
        """Yield the way to every number of a body, and its least and greatest value."""
        for part in self._parts(schema):
            if isinstance(value, dict):
                for name in value.keys() & part.get("properties", {}).keys():
                    yield from self.numbers(part["properties"][name], value[name], (*way, name))
            elif isinstance(value, list) and isinstance(part.get("items"), dict):
                for index, item in enumerate(value):
                    yield from self.numbers(part["items"], item, (*way, index))
            elif part.get("type") in ("number", "integer") and not isinstance(value, str | list):
                yield way, ends(part)

    def _parts(self, schema: Json) -> Iterator[Json]:
        """Yield what a schema may be, with references followed."""
        if "$ref" in schema:
            name = schema["$ref"].rsplit("/", 1)[1]
            yield from self._parts(self._document["components"]["schemas"][name])
        for part in (*schema.get("anyOf", ()), *schema.get("oneOf", ())):
            yield from self._parts(part)
        yield schema


def ends(schema: Json) -> tuple[float, float]:
    """Return the least and the greatest number that a schema allows."""
    low = schema.get("minimum")
    high = schema.get("maximum")
    low = math.nextafter(schema["exclusiveMinimum"], math.inf) if low is None else low
    high = math.nextafter(schema["exclusiveMaximum"], -math.inf) if high is None else high
    return (int(low), int(high)) if schema["type"] == "integer" else (low, high)


def changed(body: Json, way: Way, number: float) -> Json:
    """Return a body with another number at one place."""
    found = inner = copy.deepcopy(body)
    for step in way[:-1]:
        inner = inner[step]
    inner[way[-1]] = number
    return found


@pytest.fixture(scope="module")
def interface(api_server: Running) -> Interface:
    return Interface(api_server.http.get("/openapi.json").json())


@pytest.mark.parametrize(
    ("method", "path", "body"), BODIES, ids=[f"{path} {next(iter(body))}" for _, path, body in BODIES]
)
def test_numbers_at_their_bounds_are_computed_with_or_refused_in_short_words(
    api_server: Running, interface: Interface, method: str, path: str, body: Json
) -> None:
    tried = dict(interface.numbers(interface.body(method, path), body))
    assert tried
    if (method, path) == STOPPED:
        api_server.post("/stop")
    url = API + path.replace("{role}", "wide")
    for way, (low, high) in tried.items():
        for number in (low, high):
            answer = api_server.http.request(method, url, json=changed(body, way, number))
            told = f"{way} = {number}: {answer.status_code} {answer.text[:300]}"
            assert answer.status_code < 500 or answer.json()["type"] == "/problems/not-connected", told
            assert not re.search(r"\d{25}", answer.json().get("detail", "")), told
    if (method, path) == STOPPED:
        api_server.http.delete(f"{API}/stop")


@pytest.mark.parametrize("number", [-1e6, 1e6])
def test_a_wide_pixel_at_the_bounds_has_no_depth(api_server: Running, number: float) -> None:
    assert api_server.get("/depth", x_px=number, y_px=number).status_code == 422


def test_a_number_beyond_its_bound_is_refused_with_the_bound(api_server: Running) -> None:
    answer = api_server.http.patch(f"{API}/cameras/wide", json={"exposure_ms": 1e308})

    assert (answer.status_code, answer.json()["type"]) == (422, "/problems/invalid-input")
    assert answer.json()["detail"] == "exposure_ms is 1e+308; needed is a value of at most 3600000."
