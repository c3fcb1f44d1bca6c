"""Faults by REST: listed with what to do, dismissed for everybody, told by events."""

from typing import Any

from foveacam_server.foundation.events import EventLevel
from foveacam_server.rig.schema import DeviceName, DeviceProblemDocument
from tests.support.servers.running_server import Running


def lose(server: Running, device: str) -> None:
    problem = DeviceProblemDocument(device=device, detail="it does not answer", remedy="check its cable")
    server.services.events.emit("device.fault", f"{device}: gone", level=EventLevel.ERROR, data=problem)


def recover(server: Running, device: str) -> None:
    server.services.events.emit("device.recovered", f"{device} is back", data=DeviceName(device=device))


def rows(server: Running) -> dict[str, dict[str, Any]]:  # Any: a JSON document
    return {row["name"]: row for row in server.get("/faults").json()}


def newest_id(server: Running) -> int:
    found: int = server.get("/events/recent", limit=1).json()[-1]["id"]
    return found


def test_faults_are_listed_with_what_to_do_and_dismissed_for_everybody(api_server: Running) -> None:
    api_server.http.delete("/api/v1/faults")
    lose(api_server, "gripper")
    lose(api_server, "lamp")
    recover(api_server, "lamp")

    listed = rows(api_server)
    assert listed["gripper"]["present"] and listed["gripper"]["remedy"] == "check its cable"
    assert not listed["lamp"]["present"]

    before = newest_id(api_server)
    over = api_server.http.delete("/api/v1/faults")
    assert over.json() == {"ids": [listed["lamp"]["id"]]}
    assert api_server.wait_for_event("fault.dismissed", after=before) == over.json()
    assert "lamp" not in rows(api_server)

    one = api_server.http.delete(f"/api/v1/faults/{listed['gripper']['id']}")
    again = api_server.http.delete(f"/api/v1/faults/{listed['gripper']['id']}")
    assert (one.status_code, again.status_code) == (204, 404)
    assert "gripper" not in rows(api_server)


def test_a_job_that_fails_is_listed_with_its_reason(api_server: Running) -> None:
    def fail(_: object) -> str:
        raise RuntimeError("a mistake")

    api_server.services.jobs.handle("mistake", fail, parallel=True)
    before = newest_id(api_server)
    api_server.services.jobs.submit("mistake")

    told = api_server.wait_for_event("fault.changed", after=before)
    row = rows(api_server)["mistake"]
    assert row == told
    assert (row["scope"], row["present"], row["count"]) == ("job", False, 1)
    assert "did not foresee" in row["what"]
    assert "log" in row["remedy"]
    api_server.http.delete(f"/api/v1/faults/{row['id']}")
