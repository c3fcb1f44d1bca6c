"""The planner by REST, on an application of its own: it needs no rig, and its figures are the study's."""

import base64
import itertools
import json
import math
import struct
import time
from collections.abc import Iterator
from contextlib import closing
from typing import Any

import cv2
import httpx
import numpy as np
import pytest
from fastapi import FastAPI
from numpy.typing import NDArray

from foveacam_pipeline.study.visibility.obstacles import RandomObstacles
from foveacam_pipeline.study.visibility.standoff import standoff_ring
from foveacam_server.doors import error_handlers
from foveacam_server.foundation.computing.compute_queue import ComputeQueue
from foveacam_server.foundation.http.answers import BODY_BYTES
from foveacam_server.foundation.http.provided import ServiceRegistry
from foveacam_server.resources.studying.planner import routes
from foveacam_server.resources.studying.planner.maps import MOST_VERTICES
from tests.support.scenes.obstacle_quadrature import success_by_quadrature
from tests.support.servers.local_server import serving
from tests.support.servers.persons import install_persons

Json = dict[str, Any]  # Any: JSON documents

RING: Json = {"feature_mm": 20.0, "px_per_deg": 502.0, "pixels": 20.0, "d_min_m": 8.0, "near_error_m": 0.2}
CLUTTER: Json = {"occupancy": 0.02, "radius_m": 0.5}
SQUARE = [[20.0, 20.0], [24.0, 20.0], [24.0, 24.0], [20.0, 24.0], [20.0, 20.0]]


@pytest.fixture(scope="module")
def http() -> Iterator[httpx.Client]:
    app = FastAPI()
    error_handlers.install(app)
    app.include_router(routes.router, max_body_size=BODY_BYTES)
    install_persons(app)
    with (
        closing(ComputeQueue()) as computing,
        serving(app) as port,
        httpx.Client(base_url=f"http://127.0.0.1:{port}/planner", timeout=60.0, trust_env=False) as client,
    ):
        app.state.provided = ServiceRegistry({ComputeQueue: computing})
        yield client


def post(http: httpx.Client, path: str, **body: object) -> Json:
    answer = http.post(path, json=body)
    assert answer.status_code == 200, answer.text
    return dict(answer.json())


def refused(http: httpx.Client, path: str, **body: object) -> str:
    answer = http.post(path, json=body)
    assert (answer.status_code, answer.headers["Content-Type"]) == (422, "application/problem+json")
    return str(answer.json()["detail"])


def feature(kind: str, geometry: str, coordinates: object) -> Json:
    return {
        "type": "Feature",
        "properties": {"kind": kind},
        "geometry": {"type": geometry, "coordinates": coordinates},
    }


def collection(*features: Json) -> Json:
    return {"type": "FeatureCollection", "features": list(features)}


def png(image: NDArray[np.uint8]) -> str:
    return base64.b64encode(cv2.imencode(".png", image)[1].tobytes()).decode()


def test_the_ring_and_its_chances_are_those_of_the_paper(http: httpx.Client) -> None:
    found = post(http, "/standoff", ring=RING, clutter=CLUTTER, domain_m2=40_000.0)

    theta_rad = math.radians(20.0 / 502.0)
    d_max_m = 0.02 / (2.0 * math.tan(theta_rad / 2.0))
    assert found["ring"]["outer_m"] == pytest.approx(d_max_m, rel=1e-12)
    assert found["ring"]["inner_m"] == pytest.approx(8.2)
    assert found["ring"]["area_m2"] == pytest.approx(math.pi * (d_max_m**2 - 8.2**2))
    clutter, expected = RandomObstacles(**CLUTTER), standoff_ring(8.2, d_max_m)
    assert found["success"] == pytest.approx(success_by_quadrature(expected, clutter, domain_m2=40_000.0))
    assert found["clear_at_outer"] == pytest.approx(0.98 ** (d_max_m + math.pi * 0.25))
    assert found["expected_area_m2"] == pytest.approx(40_000.0 * found["success"])


def test_the_slope_is_that_of_the_curve_and_the_curve_holds_the_present_point(http: httpx.Client) -> None:
    near, far = (
        post(http, "/standoff", ring=RING | {"feature_mm": size_mm}, clutter=CLUTTER, domain_m2=40_000.0)
        for size_mm in (20.0, 20.001)
    )
    rise = (far["success"] - near["success"]) / (far["ring"]["d_max_m"] - near["ring"]["d_max_m"])
    assert near["success_slope_per_m"] == pytest.approx(rise, rel=1e-3)
    curve = near["curve"]
    assert curve["d_max_m"][-1] == pytest.approx(math.sqrt(40_000.0 / math.pi))
    assert all(b >= a for a, b in itertools.pairwise(curve["success"]))
    between = np.interp(near["ring"]["d_max_m"], curve["d_max_m"], curve["success"])
    assert between == pytest.approx(near["success"], abs=2e-4)  # straight between points 0.9 m apart


def test_the_sign_of_the_depth_error_is_as_asked(http: httpx.Client) -> None:
    inner_m = {
        bound: post(http, "/standoff", ring=RING | {"bound": bound})["ring"]["inner_m"]
        for bound in ("inflated", "plain", "as_printed")
    }
    assert inner_m == pytest.approx({"inflated": 8.2, "plain": 8.0, "as_printed": 7.8})


def test_no_place_at_all_is_an_answer_in_words(http: httpx.Client) -> None:
    wide = RING | {"px_per_deg": 55.0}
    found = post(http, "/standoff", ring=wide, clutter=CLUTTER)
    assert found["ring"]["empty"]
    assert "(8.2 m) is at or beyond D_max (3.151 m): no place is left" in found["ring"]["empty_because"]
    assert (found["success"], found["success_slope_per_m"], found["ring"]["area_m2"]) == (0.0, 0.0, 0.0)
    ground = post(http, "/map", kind="open", size_m=60.0)["map"]
    on_map = post(http, "/regions", map=ground, ring=wide)
    assert (on_map["areas"]["multi_m2"], on_map["empty_because"]) == (0.0, found["ring"]["empty_because"])


def test_a_ring_beyond_the_map_is_said_to_be_there(http: httpx.Client) -> None:
    ground = post(http, "/map", kind="open", size_m=10.0)["map"]
    found = post(http, "/regions", map=ground, ring=RING)
    assert not found["ring"]["empty"]
    assert "nothing of it is left on this map" in found["empty_because"]


def test_open_ground_leaves_the_whole_ring(http: httpx.Client) -> None:
    ground = post(http, "/map", kind="open", size_m=70.0)["map"]
    found = post(http, "/regions", map=ground, ring=RING, points_m=[[35, 35], [35, 50], [50, 35], [1, 1]])
    assert found["areas"]["multi_m2"] == pytest.approx(found["ring"]["area_m2"], rel=1e-9)
    assert found["regions"][0]["ring_share"] == pytest.approx(1.0)
    assert [point["targets"] for point in found["points"]] == [[], [0], [0], []]


def test_a_map_by_lot_is_that_of_its_seed_and_comes_back_from_its_regions(http: httpx.Client) -> None:
    first, again, other = (post(http, "/map", kind="random", seed=seed) for seed in (3, 3, 4))
    assert first == again != other
    assert (first["obstacles"], len(first["targets_m"])) == (40, 5)
    found = post(http, "/regions", map=first["map"], ring=RING)
    areas = found["areas"]
    own_m2 = [region["area_m2"] for region in found["regions"]]
    assert areas["weighted_m2"] == pytest.approx(sum(own_m2))
    assert areas["single_m2"] == pytest.approx(sum(own_m2) / 5)
    assert max(own_m2) < areas["multi_m2"] < areas["weighted_m2"]
    assert post(http, "/map", kind="geojson", document=found["geojson"]) == first


def test_an_obstacle_hides_what_is_behind_it(http: httpx.Client) -> None:
    bounds = feature("bounds", "Polygon", [[[0, 0], [60, 0], [60, 60], [0, 60], [0, 0]]])
    ground = collection(bounds, feature("", "Polygon", [SQUARE]), feature("target", "Point", [30.0, 22.0]))
    points_m = [[15.0, 22.0], [45.0, 22.0], [22.0, 22.0]]
    found = post(http, "/regions", map=ground, ring=RING | {"d_min_m": 4.0}, points_m=points_m)
    assert [point["targets"] for point in found["points"]] == [[], [0], []]
    moved = post(http, "/regions", map=ground, targets_m=[[10.0, 22.0]], ring=RING, points_m=points_m)
    assert [point["targets"] for point in moved["points"]] == [[], [], []]


def test_a_picture_becomes_a_map_by_its_scale(http: httpx.Client) -> None:
    image = np.full((100, 200), 255, np.uint8)
    image[60:80, 20:60] = 0
    found = post(http, "/map", kind="picture", picture_base64=png(image), m_per_px=0.5)
    assert found["bounds_m"] == [0.0, 0.0, 100.0, 50.0]
    assert (found["obstacles"], found["obstacle_m2"]) == (1, pytest.approx(20.0 * 10.0))
    corners = np.array(found["map"]["features"][1]["geometry"]["coordinates"][0])
    assert corners.min(axis=0).tolist() == [10.0, 10.0]  # the picture's lower edge is y = 0
    jpeg = base64.b64encode(cv2.imencode(".jpg", image)[1].tobytes()).decode()
    again = post(http, "/map", kind="picture", picture_base64=jpeg, m_per_px=0.5)
    assert again["obstacle_m2"] == pytest.approx(200.0, rel=0.02)


def test_what_a_picture_leaves_transparent_is_free(http: httpx.Client) -> None:
    image = np.zeros((100, 200, 4), np.uint8)  # black all over, as drawing programs store transparency
    image[60:80, 20:60, 3] = 255
    found = post(http, "/map", kind="picture", picture_base64=png(image), m_per_px=0.5)
    assert (found["obstacles"], found["obstacle_m2"]) == (1, pytest.approx(20.0 * 10.0))


def test_metres_a_unit_are_those_of_the_request(http: httpx.Client) -> None:
    document = collection(feature("", "Polygon", [SQUARE]), feature("target", "Point", [30.0, 22.0]))
    found = post(http, "/map", kind="geojson", document=document, m_per_unit=0.5)
    assert (found["obstacle_m2"], found["targets_m"]) == (pytest.approx(4.0), [[15.0, 11.0]])


CROSSED = collection(feature("", "Polygon", [[[0, 0], [4, 4], [4, 0], [0, 4], [0, 0]]]))
INSIDE = collection(feature("", "Polygon", [SQUARE]), feature("target", "Point", [22.0, 22.0]))
DEGREES = CROSSED | {"crs": {"properties": {"name": "urn:ogc:def:crs:OGC:1.3:CRS84"}}}
PALE = png(np.full((8, 8), 255, np.uint8))
HUGE = base64.b64encode(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + struct.pack(">II", 60_000, 60_000)).decode()
CUT = base64.b64encode(base64.b64decode(PALE)[:30]).decode()
DEEP = json.loads("[" * 900 + "]" * 900)
NESTED = collection(feature("", "Polygon", DEEP))
NOISE = png(np.random.default_rng(40).integers(0, 2, (250, 250), np.uint8) * np.uint8(255))
ROUND = [[math.cos(n * 1e-3), math.sin(n * 1e-3)] for n in range(2 * MOST_VERTICES + 1)]

WHEEL_CORNERS = [[math.cos(math.tau * n / 6000), math.sin(math.tau * n / 6000)] for n in (*range(6000), 0)]
WHEEL = collection(
    feature("bounds", "Polygon", [[[-9, -9], [9, -9], [9, 9], [-9, 9], [-9, -9]]]),
    feature("", "Polygon", [WHEEL_CORNERS]),
)


@pytest.mark.parametrize(
    ("path", "body", "words"),
    [
        (
            "/standoff",
            {"clutter": {"occupancy": 1.5}},
            "clutter.occupancy is 1.5; needed is a value of at most 1",
        ),
        ("/standoff", {"ring": {"d_min_m": -1.0}}, "ring.d_min_m is -1.0; needed is a value of at least 0"),
        ("/standoff", {"ring": {"px_per_deg": 0.01, "pixels": 20.0}}, "less than 180° is possible"),
        ("/standoff", {"ring": RING, "domain_m2": 100.0}, "a domain of 100 m² was given"),
        ("/standoff", {"ring": {"feature_mm": "20"}}, "needed is a number"),
        ("/map", {"kind": "geojson", "document": CROSSED}, "without crossing itself"),
        ("/map", {"kind": "geojson", "document": INSIDE}, "target 0 at (22, 22) m is inside obstacle 0"),
        ("/map", {"kind": "geojson", "document": DEGREES}, "degrees of longitude and latitude"),
        ("/map", {"kind": "geojson", "document": {}}, "a map is a FeatureCollection"),
        ("/map", {"kind": "geojson", "document": collection(feature("target", "Point", []))}, "RFC 7946"),
        ("/map", {"kind": "geojson", "document": collection(feature("", "Polygon", [ROUND]))}, "simplify it"),
        (
            "/map",
            {"kind": "geojson", "document": collection(feature("", "Polygon", DEEP))},
            "nested too deeply",
        ),
        ("/map", {"kind": "geojson", "document": {"features": [[]] * 600_000}}, "200,000 are the most"),
        ("/map", {"kind": "picture", "picture_base64": PALE}, "the picture has no scale; give m_per_px"),
        ("/map", {"kind": "picture", "picture_base64": HUGE, "m_per_px": 1.0}, "60000 x 60000 px was given"),
        ("/map", {"kind": "picture", "picture_base64": CUT, "m_per_px": 1.0}, "it may be cut short"),
        ("/map", {"kind": "picture", "picture_base64": "R0lGODlh", "m_per_px": 1.0}, "neither PNG nor JPEG"),
        ("/map", {"kind": "picture", "picture_base64": "?", "m_per_px": 1.0}, "no base64 text"),
        (
            "/map",
            {"kind": "picture", "picture_base64": NOISE, "m_per_px": 1.0},
            "corners; 20,000 are the most",
        ),
        ("/map", {"kind": "random", "size_m": 1.0, "targets": 50}, "smaller obstacles, or a larger map"),
        ("/regions", {"map": collection(feature("", "Polygon", [SQUARE]))}, "place at least one"),
        ("/regions", {"map": INSIDE, "targets_m": [[23.0, 21.0]]}, "target 0 at (23, 21) m is inside"),
        ("/regions", {"map": INSIDE, "targets_m": [[1e5, 0.0]]}, "is outside the map"),
        ("/regions", {"map": WHEEL, "targets_m": [[0.0, 3.0]] * 50}, "16 targets are the most on such a map"),
    ],
)
def test_what_cannot_be_used_is_refused_in_a_sentence(
    http: httpx.Client, path: str, body: Json, words: str
) -> None:
    assert words in refused(http, path, **body)


def test_the_ring_takes_less_than_a_tenth_of_a_second_of_work(http: httpx.Client) -> None:
    def worked_s() -> float:
        began_s = time.process_time()  # of this whole process, the server in it
        post(http, "/standoff", ring=RING, clutter=CLUTTER)
        return time.process_time() - began_s

    assert min(worked_s() for _ in range(5)) < 0.1
