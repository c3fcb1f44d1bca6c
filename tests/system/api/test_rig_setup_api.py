"""Setting a rig up over REST, on the simulated bus: from found devices to another rig, without a restart."""

from pathlib import Path

import httpx
import pytest

from foveacam_hardware.rig_config import load_rig_config
from foveacam_server.foundation.store import Document
from tests.support.servers.running_server import API, CENTRE, Running

pytestmark = pytest.mark.timeout(180)

SETUP = f"{API}/rig/setup"


@pytest.fixture
def setup(api_server: Running) -> Running:
    """The server with a draft of nothing and the simulated rig open."""
    api_server.http.delete(f"{API}/stop")
    api_server.post("/rig/setup/draft", {"path": None})
    return api_server


def simulated_draft(server: Running, **changes: object) -> Document:
    """Return a draft with each found camera in its role."""
    found = server.get("/rig/setup/devices").json()
    chosen = [camera for camera in found["cameras"] if camera["kind"] == "simulated"]
    draft: Document = server.get("/rig/setup/draft").json()["draft"]
    draft["cameras"] = {camera["role"]: {"kind": camera["kind"], "name": camera["name"]} for camera in chosen}
    draft["mirrors"]["port"] = next(port["name"] for port in found["ports"] if port["controller"])
    return draft | changes


def put(server: Running, draft: Document) -> Document:
    answer = server.http.put(f"{SETUP}/draft", json=draft)
    assert answer.status_code == 200, answer.text
    described: Document = answer.json()
    return described


def save(server: Running, seen: str | None) -> httpx.Response:
    return server.http.put(f"{SETUP}/file", json={"hash": seen})


def test_devices_of_the_simulated_bus_have_makers_roles_and_pictures(setup: Running) -> None:
    found = setup.get("/rig/setup/devices").json()
    cameras = [camera for camera in found["cameras"] if camera["kind"] == "simulated"]
    assert [camera["role"] for camera in cameras] == ["wide", "left", "right"]
    assert all(camera["serial"].startswith("SIM-") and camera["in_use"] for camera in cameras)
    image = setup.get("/rig/setup/picture.jpg", kind="simulated", name="left")
    assert image.headers["Content-Type"] == "image/jpeg"
    assert image.content[:2] == b"\xff\xd8"
    missing = setup.get("/rig/setup/picture.jpg", kind="opencv", name="/etc/passwd")
    assert missing.status_code == 404


def test_conflicts_are_named_at_their_fields(setup: Running) -> None:
    draft = simulated_draft(setup)
    draft["cameras"]["wide"] = draft["cameras"]["left"]
    draft["mirrors"]["port"] = ""
    described = put(setup, draft)
    assert {fault["field"] for fault in described["faults"]} == {"cameras.wide", "mirrors.port"}
    refused = save(setup, None)
    assert refused.status_code == 422
    assert "cameras.wide" in refused.json()["detail"]


def test_rig_is_set_up_from_nothing_saved_undone_and_opened(setup: Running) -> None:
    described = put(setup, simulated_draft(setup, rig_id="bench-2", name="Bench 2"))
    assert (described["faults"], described["simulated"], described["file_exists"]) == ([], True, False)
    assert setup.get("/rig/setup/advice").json() == [] or all(
        advice["level"] != "problem" for advice in setup.get("/rig/setup/advice").json()
    )
    written = save(setup, None).json()
    path = Path(written["path"])
    assert load_rig_config(path).name == "Bench 2"
    by_hand = path.read_text(encoding="utf-8") + "# measured by hand\n"
    path.write_text(by_hand, encoding="utf-8")
    put(setup, simulated_draft(setup, rig_id="bench-2", name="Bench 3"))
    refused = save(setup, written["hash"])
    assert (refused.status_code, refused.json()["type"]) == (409, "/problems/edited-meanwhile")
    seen = setup.get("/rig/setup/file").json()
    assert "+# measured by hand" in seen["meanwhile"]
    saved = save(setup, seen["hash"]).json()
    assert "# measured by hand" in path.read_text(encoding="utf-8")

    opened = setup.post("/rig/setup/open", {"path": str(path)})
    assert [entry["open"] for entry in opened.json()["files"]] == [True]
    assert setup.get("/rig").json()["name"] == "Bench 3"
    undone = setup.post("/rig/setup/undo", {"hash": saved["hash"]}).json()
    assert path.read_text(encoding="utf-8") == by_hand
    assert undone["versions"] == 0
    fixated = setup.fixate({**CENTRE, "depth": False})
    assert fixated["distance_m"] is not None
    assert setup.post("/rig/setup/open", {"path": None}).json()["simulated"]


def test_rig_is_not_exchanged_under_a_recording(setup: Running) -> None:
    job = setup.post("/recordings", {"name": "under way"}).json()
    refused = setup.post("/rig/setup/open", {"path": None})
    assert (refused.status_code, refused.json()["found"]) == (409, "a job is using the rig")
    setup.post(f"/jobs/{job['id']}/cancel")
    setup.ended(job)


def test_steps_of_the_start_are_listed_and_done(setup: Running) -> None:
    steps = setup.get("/rig/start").json()["steps"]
    assert [step["device"] for step in steps] == [
        "rig",
        "calibration",
        "renderer",
        "mirrors",
        "wide",
        "left",
        "right",
        "pan_tilt",
        "rail",
    ]
    assert {step["state"] for step in steps} == {"done"}


def test_tries_answer_in_sentences_and_the_mirrors_step_only_for_the_holder(setup: Running) -> None:
    put(setup, simulated_draft(setup))
    tried = setup.post("/rig/setup/tries", {"device": "controller"}).json()
    assert tried["good"]
    assert tried["sentence"].startswith("The controller answers: FoveaCam")
    assert setup.post("/rig/setup/tries", {"device": "pan_tilt"}).json()["good"]

    order = {"confirmed": True}
    assert setup.post("/rig/setup/mirror_steps", {"confirmed": False}).status_code == 422
    assert setup.post("/rig/setup/mirror_steps", order).status_code == 409
    token = setup.post("/lease", {"holder": "ada"}).json()["token"]
    stepped = setup.post("/rig/setup/mirror_steps", order, X_Lease=token).json()
    setup.http.delete(f"{API}/lease", headers={"X-Lease": token})
    assert stepped["good"]
    assert "came back" in stepped["sentence"]


def test_rig_whose_devices_are_missing_opens_and_stays_at_the_steps_that_failed(setup: Running) -> None:
    draft = simulated_draft(setup, rig_id="absent", name="Absent")
    draft["cameras"] = {"wide": {"kind": "opencv", "name": "/dev/no-such-camera"}}
    draft["mirrors"]["port"] = "/dev/no-such-port"
    assert put(setup, draft)["faults"] == []
    path = save(setup, None).json()["path"]
    assert setup.post("/rig/setup/open", {"path": path}).status_code == 200

    steps = {step["device"]: step for step in setup.get("/rig/start").json()["steps"]}
    assert (steps["rig"]["state"], steps["mirrors"]["state"], steps["wide"]["state"]) == (
        "done",
        "failed",
        "failed",
    )
    assert "/dev/no-such-port" in steps["mirrors"]["detail"]
    assert steps["calibration"]["state"] == "failed"
    kinds = {camera["kind"] for camera in setup.get("/rig/setup/devices").json()["cameras"]}
    assert "simulated" not in kinds
    advice = {found["field"]: found for found in setup.get("/rig/setup/advice").json()}
    assert "not there" in advice["mirrors.port"]["found"]
    tried = setup.post("/rig/setup/tries", {"device": "controller"}).json()
    assert not tried["good"]
    assert setup.post("/rig/setup/open", {"path": None}).status_code == 200
    assert setup.get("/rig").json()["state"] == "ready"
