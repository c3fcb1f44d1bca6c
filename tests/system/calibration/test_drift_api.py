"""A drift check over REST: one shot into the scene, applied when it is sure and asked for."""

import math
from collections.abc import Iterator

import pytest

from foveacam_hardware.contract import Role
from foveacam_pipeline.models.content import content_id
from tests.support.scenes.marker_room import bench_with, make_grey
from tests.support.servers.running_server import PATIENCE_S, Running, running

pytestmark = pytest.mark.timeout(300)


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    """A server before a wall with texture."""
    folder = tmp_path_factory.mktemp("wall")
    with running(folder / "data", scene=bench_with(folder, "back wall")) as found:
        yield found


@pytest.fixture(scope="module", autouse=True)
def _grey(server: Running) -> None:
    rig = server.rig  # its devices belong to one thread: an exposure that is under way would be lost
    server.services.hardware.submit(lambda _: make_grey(rig)).result(PATIENCE_S)


def test_drift_check_is_refused_while_the_stop_is_engaged(server: Running) -> None:
    server.post("/stop")
    try:
        refused = server.post("/drift_checks", {})
        assert (refused.status_code, refused.json()["type"]) == (409, "/problems/stopped")
    finally:
        server.http.delete("/api/v1/stop")


def test_ordinary_fixations_tell_the_health_of_the_calibration(server: Running) -> None:
    before = server.last_event
    verged = 0
    for x_px, y_px in ((x, y) for y in (610, 540, 680) for x in (800, 700, 720, 880, 650)):
        found = server.fixate({"pixel": {"x_px": float(x_px), "y_px": float(y_px)}, "depth": False})
        verged += found["state"] == "verged"
        if verged == 5:
            break
    health = server.get("/calibrations/health").json()
    assert health["fixations"] == verged == 5
    assert health["verdict"] == "good"
    assert 0.0 < health["score"] < 2.0
    assert server.get("/calibrations/current").json()["health"] == health
    assert server.get("/rig").json()["calibration"]["health"] == health
    assert server.wait_for_event("calibration.health", after=before)["fixations"] >= 1


def test_another_calibration_begins_without_a_verdict(server: Running) -> None:
    current = server.get("/calibrations/current").json()["id"]
    document = server.get(f"/calibrations/{current}/file").json()
    renamed = {**document, "calibration": {**document["calibration"], "label": "anew"}}
    renamed["hash"] = content_id(renamed["calibration"])
    imported = server.post("/calibrations/import", renamed).json()["id"]
    server.post(f"/calibrations/{imported}/activate")
    try:
        assert server.get("/calibrations/health").json()["verdict"] == "unknown"
    finally:
        server.post(f"/calibrations/{current}/activate")


def test_knock_is_corrected_and_told(server: Running) -> None:
    before = server.get("/calibrations/current").json()
    turn_rad = (math.radians(0.1), math.radians(-0.15), 0.0)
    server.truth.world.faults.drift_step_rad = {Role.LEFT: turn_rad, Role.RIGHT: turn_rad}
    try:
        answer = server.post("/drift_checks", {"apply": True}, Prefer="wait=60")
        assert answer.status_code == 200, answer.text
        found = answer.json()
        assert found["applied"], found["detail"]
        assert found["locked"]
        assert found["looks"] > 0
        assert found["calibration_id"] == before["id"]
        assert [eye["eye"] for eye in found["eyes"]] == ["left", "right"]
        for eye in found["eyes"]:
            assert eye["shift_x_deg"] == pytest.approx(-0.15, abs=0.02)  # 10 fovea px
        current = server.get("/calibrations/current").json()
        assert current["id"] == found["new_calibration_id"]
        assert (current["origin"], current["parent_id"]) == ("corrected", before["id"])
        assert server.get(f"/drift_checks/{found['id']}").json() == found
        assert server.get("/drift_checks").json()[0] == found
        assert server.get("/views/calibration_wide/snapshot.jpg").status_code == 200
    finally:
        server.truth.world.faults.drift_step_rad = {}
        server.post(f"/calibrations/{before['id']}/activate")


def test_drift_that_was_seen_is_drawn_over_time(server: Running) -> None:
    assert server.get("/drift_checks/trend.png").content.startswith(b"\x89PNG")
