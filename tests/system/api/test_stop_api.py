"""The stop by REST, and jobs that are cancelled."""

import threading
import time

import pytest

from foveacam_hardware.contract import PARKED
from tests.support.servers.running_server import API, CENTRE, PATIENCE_S, POLL_S, Running

pytestmark = [pytest.mark.timeout(300), pytest.mark.usefixtures("grey")]


def test_stop_parks_at_once_however_much_is_queued(api_server: Running) -> None:
    api_server.post("/mirrors/steer", {"direction": {"ax_deg": 4.0, "ay_deg": 2.0}})
    for _ in range(5):
        assert api_server.post("/fixations", {**CENTRE, "depth": False}).status_code == 202
    began, ended = threading.Event(), threading.Event()

    def keep_busy(rig: object) -> None:  # the thread that owns the rig, not the rig
        began.set()
        ended.wait(PATIENCE_S)

    kept = api_server.services.hardware.submit(keep_busy)
    assert began.wait(PATIENCE_S)
    try:
        answer = api_server.post("/stop").json()
        assert not kept.done()  # it has waited for nobody
        assert (answer["engaged"], answer["parked"]) == (True, True)
        ended.set()
        refused = api_server.post("/fixations", CENTRE)
        assert (refused.status_code, refused.json()["type"]) == (409, "/problems/stopped")
        assert (
            api_server.post("/mirrors/steer", {"direction": {"ax_deg": 0.0, "ay_deg": 0.0}}).status_code
            == 409
        )
        assert api_server.get("/stop").json()["engaged"]
        jobs = _wait_until_idle(api_server)
        assert {job["state"] for job in jobs[:5]} <= {"cancelled", "succeeded"}
        assert jobs[0]["state"] == "cancelled"
        assert api_server.rig.mirrors.state.volts == PARKED
    finally:
        ended.set()
        api_server.http.delete(f"{API}/stop")
    assert api_server.fixate({**CENTRE, "depth": False})["state"] == "verged"


def test_stop_needs_no_database(api_server: Running) -> None:
    with api_server.services.store.session() as session:
        session.connection().exec_driver_sql("BEGIN EXCLUSIVE")
        answer = api_server.post("/stop")
        assert (answer.json()["engaged"], answer.json()["parked"]) == (True, True)
        session.connection().exec_driver_sql("ROLLBACK")
    assert not api_server.http.delete(f"{API}/stop").json()["engaged"]


def test_cancelled_fixation_ends_as_cancelled(api_server: Running) -> None:
    first = api_server.post("/fixations", CENTRE).json()
    second = api_server.post("/fixations", CENTRE).json()
    assert api_server.post(f"/jobs/{second['id']}/cancel").status_code == 200
    _wait_until_idle(api_server)
    assert api_server.get(f"/jobs/{second['id']}").json()["state"] == "cancelled"
    assert api_server.get(f"/jobs/{first['id']}").json()["state"] == "succeeded"


def _wait_until_idle(server: Running) -> list[dict[str, str]]:
    end_s = time.monotonic() + PATIENCE_S
    while server.services.jobs.open_jobs:
        assert time.monotonic() < end_s, "a job never ended"
        time.sleep(POLL_S)
    jobs: list[dict[str, str]] = server.get("/jobs", limit=20).json()
    return jobs
