"""A drift check over REST: one shot into the scene, applied when it is sure and asked for."""

import pytest

from .conftest import Running

pytestmark = pytest.mark.timeout(300)


def test_rig_that_has_not_drifted_is_left_alone_and_told_so(server: Running) -> None:
    before = server.get("/calibrations/current").json()["id"]
    answer = server.post("/drift_checks", {"apply": True}, Prefer="wait=60")
    assert answer.status_code == 200, answer.text
    check = answer.json()
    assert check["calibration_id"] == before
    assert check["looks"] > 0
    assert [eye["eye"] for eye in check["eyes"]] == ["left", "right"]
    assert check["applied"] == (check["new_calibration_id"] is not None)
    assert server.get(f"/drift_checks/{check['id']}").json() == check
    assert server.get("/drift_checks").json()[0] == check
    assert server.get("/calibrations/current").json()["id"] == (check["new_calibration_id"] or before)
    assert server.get("/views/calibration_wide/snapshot.jpg").status_code == 200


def test_drift_check_is_refused_while_the_stop_is_engaged(server: Running) -> None:
    server.post("/stop")
    try:
        refused = server.post("/drift_checks", {})
        assert (refused.status_code, refused.json()["type"]) == (409, "/problems/stopped")
    finally:
        server.http.delete("/api/v1/stop")
