"""Bad input over REST: each refusal is a problem document that names thing, value, range, remedy."""

import logging
import logging.handlers
import queue
from typing import Any

import httpx
import pytest

from tests.support.servers.running_server import CENTRE, Running

pytestmark = pytest.mark.timeout(300)

PARALLEL = {"ax_deg": 0.0, "ay_deg": 0.0}


def problem(answer: httpx.Response, *, status: int, slug: str) -> dict[str, Any]:  # Any: a JSON document
    """Check the form of a problem document and return it."""
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    document: dict[str, Any] = answer.json()
    assert document["type"] == f"/problems/{slug}"
    assert document["status"] == status
    assert document["title"]
    assert document["instance"] == answer.url.path
    return document


@pytest.mark.parametrize(("x_px", "y_px"), [(1440.0, 10.0), (-1.0, 10.0), (10.0, 1080.0), (1e6, 0.0)])
def test_pixel_outside_the_image_names_the_allowed_range(
    api_server: Running, x_px: float, y_px: float
) -> None:
    found = problem(
        api_server.post("/fixations", {"pixel": {"x_px": x_px, "y_px": y_px}}),
        status=422,
        slug="out-of-range",
    )
    assert f"({x_px:g}, {y_px:g})" in found["detail"]
    assert "1439.5" in found["detail"]
    assert "1079.5" in found["detail"]


def test_direction_beyond_ten_degrees_names_the_angle_and_the_range(api_server: Running) -> None:
    body = {"direction": {"ax_deg": 10.5, "ay_deg": 0.0}}
    found = problem(api_server.post("/fixations", body), status=422, slug="out-of-range")
    assert found["asked"] == "ax_deg = 10.5"
    assert "-10 to 10 degrees" in found["found"]
    assert found["remedy"]


def test_steering_beyond_ten_degrees_is_refused_too(api_server: Running) -> None:
    body = {"direction": {"ax_deg": 0.0, "ay_deg": -11.0}}
    assert (
        "ay_deg = -11"
        in problem(api_server.post("/mirrors/steer", body), status=422, slug="out-of-range")["asked"]
    )


def test_direction_that_the_calibration_does_not_cover_is_refused(api_server: Running) -> None:
    body = {"direction": {"ax_deg": 9.99, "ay_deg": 9.99}}
    problem(api_server.post("/mirrors/steer", body), status=422, slug="out-of-range")


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity"])
def test_number_that_is_not_finite_is_refused(api_server: Running, number: str) -> None:
    answer = api_server.http.post(
        "/api/v1/fixations",
        content=f'{{"pixel": {{"x_px": {number}, "y_px": 5}}}}',
        headers={"Content-Type": "application/json"},
    )
    found = problem(answer, status=422, slug="invalid-input")
    assert "pixel.x_px" in found["detail"]
    assert "a finite number" in found["remedy"]


@pytest.mark.parametrize(
    ("body", "named"),
    [
        ({"pixel": {"x_px": "5", "y_px": 5}}, 'pixel.x_px is the text "5"; needed is a number'),
        ({"pixel": {"x_px": True, "y_px": 5}}, "pixel.x_px is true; needed is a number"),
        ({"pixel": {"x_px": 1e308, "y_px": 5}}, "1e+308; needed is a value of at most 1000000."),
        ({"pixel": {"x_px": 5}}, "pixel.y_px is missing"),
        ({"pixel": {"x_px": 5, "y_px": 5, "z_px": 5}}, "pixel.z_px is not known here"),
        ({"pixle": {"x_px": 5, "y_px": 5}}, "pixle is not known here"),
        ({**CENTRE, "depth": "yes"}, 'depth is the text "yes"; needed is true or false'),
        ([1, 2], "needed is an object"),
        ({}, "exactly one of pixel, rectangle and direction, found none"),
        ({**CENTRE, "direction": PARALLEL}, "found pixel and direction"),
    ],
)
def test_body_that_does_not_fit_is_told_in_plain_words(api_server: Running, body: object, named: str) -> None:
    assert named in problem(api_server.post("/fixations", body), status=422, slug="invalid-input")["detail"]


def test_body_that_is_not_sent_as_json_is_told_so(api_server: Running) -> None:
    headers = {"Content-Type": "text/plain"}
    answer = api_server.http.post("/api/v1/fixations", content="{}", headers=headers)
    found = problem(answer, status=422, slug="invalid-input")
    assert found["detail"] == "The body was not sent as JSON."
    assert "Content-Type: application/json" in found["remedy"]


def test_body_that_is_no_json_is_told_where(api_server: Running) -> None:
    headers = {"Content-Type": "application/json"}
    answer = api_server.http.post("/api/v1/fixations", content='{"pixel":\n  {]}', headers=headers)
    detail = problem(answer, status=422, slug="invalid-input")["detail"]
    assert detail.startswith("The body is not JSON: ")
    assert detail.endswith("at line 2, column 4.")


@pytest.mark.parametrize(
    ("content", "named"),
    [
        (b'{"pixel": "\xff"}', "byte 0xff at position 11 is not utf-8"),
        (b"[" * 200_000, "nested too deeply"),
        (b'{"pixel": ' + b"9" * 5000 + b"}", "a number of more than 4300 digits"),
    ],
)
def test_body_that_cannot_be_read_is_told_why(api_server: Running, content: bytes, named: str) -> None:
    headers = {"Content-Type": "application/json"}
    answer = api_server.http.post("/api/v1/fixations", content=content, headers=headers)
    found = problem(answer, status=400, slug="unreadable-body")
    assert named in found["detail"]
    assert found["remedy"]


def test_numbers_and_names_in_a_message_are_short(api_server: Running) -> None:
    huge = {"pixel": {"x_px": 10**400, "y_px": "y" * 10_000}, "n" * 10_000: [1.0] * 10_000}
    answer = api_server.post("/fixations", huge)
    assert "1e+400" in problem(answer, status=422, slug="invalid-input")["detail"]
    assert len(answer.content) < 1000


def test_many_failures_are_told_as_a_few(api_server: Running) -> None:
    answer = api_server.post("/fixations", {f"extra_{number}": 1 for number in range(1000)})
    assert "more failures follow" in problem(answer, status=422, slug="invalid-input")["detail"]
    assert len(answer.content) < 1000


def test_rectangle_without_area_is_refused(api_server: Running) -> None:
    body = {"rectangle": {"x_px": 10.0, "y_px": 10.0, "width_px": 0.0, "height_px": 5.0}}
    assert (
        "no area" in problem(api_server.post("/fixations", body), status=422, slug="out-of-range")["detail"]
    )


def test_distance_to_steer_to_must_be_positive(api_server: Running) -> None:
    body = {"direction": PARALLEL, "distance_m": -1.0}
    assert (
        "distance_m is -1.0"
        in problem(api_server.post("/mirrors/steer", body), status=422, slug="invalid-input")["detail"]
    )


@pytest.mark.parametrize("query", ["x_px=nan&y_px=1", "x_px=a&y_px=1", "y_px=1"])
def test_depth_query_that_does_not_fit_is_refused(api_server: Running, query: str) -> None:
    found = problem(api_server.http.get(f"/api/v1/depth?{query}"), status=422, slug="invalid-input")
    assert found["detail"].startswith("x_px is")


@pytest.mark.parametrize(
    "path",
    [
        "/fixations/fix-none",
        "/targets/tgt-none",
        "/clouds/cld-0",
        "/clouds/cld-0.ply",
        "/jobs/job-none",
        "/calibrations/none",
        "/calibrations/none/report",
        "/calibration_sessions/none",
        "/calibration_sessions/ses-0/pictures/loo.png",
        "/calibration_sessions/ses-0/wide_samples/..jpg",
        "/drift_checks/none",
        "/nothing",
        "/views/none/snapshot.jpg",
    ],
)
def test_what_does_not_exist_is_a_404_problem(api_server: Running, path: str) -> None:
    problem(api_server.get(path), status=404, slug="not-found")


def test_cloud_id_that_climbs_out_of_its_folder_is_refused(api_server: Running) -> None:
    answer = api_server.http.get("/api/v1/clouds/..%2F..%2Ffoveacam.sqlite")
    assert answer.status_code in (404, 422)


def test_wrong_method_names_the_right_ones(api_server: Running) -> None:
    answer = api_server.http.put("/api/v1/rig")
    found = problem(answer, status=405, slug="method-not-allowed")
    assert answer.headers["Allow"] == "GET, HEAD"
    assert "GET" in found["remedy"]
    assert api_server.http.patch("/api/v1/stop").headers["Allow"] == "GET, POST, DELETE, HEAD"


def test_error_that_nobody_foresaw_shows_no_insides_and_is_logged(
    api_server: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(limit: int) -> list[Any]:  # Any: never returned
        raise ZeroDivisionError(f"secret {limit}")

    logged: queue.Queue[logging.LogRecord] = queue.Queue()
    handler = logging.handlers.QueueHandler(logged)
    monkeypatch.setattr(api_server.services.jobs, "newest", broken)
    log = logging.getLogger("uvicorn.error")
    log.addHandler(handler)
    try:
        found = problem(api_server.get("/jobs"), status=500, slug="internal")
        told = logged.get(timeout=10.0).getMessage()
    finally:
        log.removeHandler(handler)
    assert "secret" not in str(found)
    assert "secret 50" in told
