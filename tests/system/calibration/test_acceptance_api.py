"""Acceptance over REST: a job on the server's rig, its result kept with report and pictures."""

from collections.abc import Iterator

import pytest

from foveacam_hardware.simulated_faults import SimulatedFaults
from tests.support.servers.calibration_server import CalibrationServer, calibration_server
from tests.support.servers.running_server import API

pytestmark = [pytest.mark.slow, pytest.mark.timeout(400)]

FEW = {"looks": 20, "wide_s": 2.0}


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Iterator[CalibrationServer]:
    """A server in the room with the markers."""
    with calibration_server(tmp_path_factory.mktemp("room")) as found:
        yield found


def test_a_run_is_a_job_whose_result_is_kept_with_report_and_pictures(room: CalibrationServer) -> None:
    server = room.server
    before = server.last_event
    asked = server.post("/acceptances", FEW)
    assert asked.status_code == 202, asked.text
    job = server.ended(asked.json())
    assert job["state"] == "succeeded", job
    found = server.get(job["result_url"].removeprefix(API)).json()
    assert found["complete"]
    assert [check["name"] for check in found["checks"]][:3] == ["devices", "triggers", "pictures"]
    assert server.wait_for_event("calibration.acceptance", after=before)["id"] == found["id"]
    assert server.get("/acceptances").json()[0] == found
    report = server.get(f"/acceptances/{found['id']}/report.html")
    assert report.headers["content-type"].startswith("text/html")
    assert found["id"] in report.text
    drawn = [check["picture"] for check in found["checks"] if check["picture"]]
    assert "pictures" in drawn
    for name in set(drawn):
        picture = server.get(f"/acceptances/{found['id']}/pictures/{name}.png")
        assert picture.content.startswith(b"\x89PNG")


def test_a_cancelled_run_keeps_its_checks(room: CalibrationServer) -> None:
    server = room.server
    before = server.last_event
    with room.held_at("calibration.progress"):
        job = server.post("/acceptances", FEW).json()
        server.wait_for_event("calibration.progress", after=before)
        assert server.post(f"/jobs/{job['id']}/cancel").status_code == 200
    assert server.ended(job)["state"] == "cancelled"
    newest = server.get("/acceptances").json()[0]
    assert not newest["complete"]
    assert not newest["accepted"]
    assert len(newest["checks"]) < 15


def test_a_fault_is_named_with_its_remedy(room: CalibrationServer) -> None:
    server = room.server
    faults = server.rig.breakable
    assert faults is not None
    faults.set_faults(SimulatedFaults(no_strobe=["left"]))
    try:
        job = server.ended(server.post("/acceptances", FEW).json())
    finally:
        faults.set_faults(SimulatedFaults())
    found = server.get(job["result_url"].removeprefix(API)).json()
    named = [finding for check in found["checks"] for finding in check["findings"]]
    assert [(each["fault"], each["subject"]) for each in named] == [("no_strobe", "left")]
    assert "strobe cable" in named[0]["remedy"]


def test_what_does_not_exist_is_said_to_be_unknown(room: CalibrationServer) -> None:
    server = room.server
    newest = server.get("/acceptances").json()[0]["id"]
    for url in (
        "/acceptances/accept-none",
        "/acceptances/accept-none/report.html",
        f"/acceptances/{newest}/pictures/none.png",
        "/acceptances/..%2F..%2Fsecret",
    ):
        answer = server.http.get(f"{API}{url}")
        assert answer.status_code == 404, url
    assert server.post("/acceptances", {"looks": 3}).status_code == 422


def test_a_run_is_refused_while_the_stop_is_engaged(room: CalibrationServer) -> None:
    server = room.server
    server.post("/stop")
    try:
        refused = server.post("/acceptances", FEW)
        assert (refused.status_code, refused.json()["type"]) == (409, "/problems/stopped")
    finally:
        server.http.delete("/api/v1/stop")
