"""The depth of the wide view over REST: fixations and a look around bring it, and it can be forgotten."""

import cv2
import numpy as np
import pytest

from tests.support.servers.running_server import Running

pytestmark = [pytest.mark.timeout(300), pytest.mark.usefixtures("grey")]
LOOKED_AT_LEAST_CELLS = 60
"""A fovea's field covers some 300 cells of 8 x 8 wide px; texture is needed."""


@pytest.fixture(autouse=True)
def _nothing_known(api_server: Running) -> None:
    assert api_server.http.delete("/api/v1/wide_depth").status_code == 204


def test_a_fixation_brings_depth_about_its_target(api_server: Running) -> None:
    after = api_server.last_event
    api_server.fixate()
    told = api_server.wait_for_event("wide_depth.changed", after=after)
    assert told["known_cells"] > LOOKED_AT_LEAST_CELLS
    known = api_server.get("/wide_depth").json()
    seen = api_server.truth.depth_at(720.0, 540.0, api_server.services.clock.now_ns())
    assert seen is not None
    assert known["nearest_m"] <= 1.001 * seen.point_rig_m[2]
    around = api_server.services.wide_depth.around(np.zeros(2), reach_tan=0.004)
    assert float(np.median(around.inverse_z_per_m)) == pytest.approx(1.0 / seen.point_rig_m[2], rel=0.01)


def test_a_look_around_that_is_cancelled_keeps_what_it_found(api_server: Running) -> None:
    after = api_server.last_event
    job = api_server.post("/wide_depth/surveys").json()
    assert api_server.get("/wide_depth").json()["survey_job_id"] == job["id"]
    while api_server.get(f"/jobs/{job['id']}").json()["progress"]["done"] < 2:
        api_server.wait_for_event("job.updated", after=api_server.last_event)
    api_server.post(f"/jobs/{job['id']}/cancel")
    told = api_server.wait_for_event("wide_depth.changed", after=after)
    assert told["known_cells"] > LOOKED_AT_LEAST_CELLS
    while api_server.get(f"/jobs/{job['id']}").json()["state"] == "cancelling":
        api_server.wait_for_event("job.updated", after=after)
    assert api_server.get(f"/jobs/{job['id']}").json()["state"] == "cancelled"
    assert api_server.wait_for_event("wide_depth.surveyed", after=after)["known_cells"] >= told["known_cells"]
    known = api_server.get("/wide_depth").json()
    assert 0.0 < known["surveyed_fraction"] < 1.0
    assert known["survey_job_id"] is None
    png = api_server.get("/wide_depth.png")
    picture = cv2.imdecode(np.frombuffer(png.content, np.uint8), cv2.IMREAD_COLOR)
    assert png.headers["content-type"] == "image/png"
    assert picture is not None
    assert picture.shape[0] == 4 * known["rows"]
    ply = api_server.get("/wide_depth.ply").content
    assert ply.startswith(b"ply\n")
    assert b"property float sigma" in ply[:800]


def test_what_is_forgotten_is_gone_and_points_are_refused_in_words(api_server: Running) -> None:
    known = api_server.get("/wide_depth").json()
    assert (known["known_cells"], known["nearest_m"]) == (0, None)
    refused = api_server.get("/wide_depth.ply")
    assert refused.status_code == 404
    assert "look around first" in refused.json()["detail"]


def test_a_look_around_is_refused_while_the_stop_is_engaged(api_server: Running) -> None:
    api_server.post("/stop")
    try:
        refused = api_server.post("/wide_depth/surveys")
        assert (refused.status_code, refused.json()["type"]) == (409, "/problems/stopped")
    finally:
        api_server.http.delete("/api/v1/stop")
