"""The working binning by REST, who holds it back, and one look at full resolution for a fixation's cloud."""

from collections.abc import Iterator
from typing import Any

import pytest

from foveacam_hardware.contract import CameraSettings, InvalidInput, Role
from foveacam_pipeline.models.resolution import px_per_deg
from foveacam_server.resources.looking.clouds.shapes import MAX_POINTS
from tests.support.servers.running_server import Running

pytestmark = [pytest.mark.timeout(300), pytest.mark.usefixtures("binned")]

URL = "/rig/binning"
TEXTURED = {"pixel": {"x_px": 800.0, "y_px": 610.0}, "label": "the shelf"}


@pytest.fixture(scope="module")
def binned(api_server: Running, grey: None) -> Iterator[None]:
    """Let the rig work at binning 2, and afterwards as before."""
    before = api_server.get(URL).json()["working_binning"]
    choose(api_server, 2)
    yield
    choose(api_server, before)


@pytest.fixture(scope="module")
def fixation(api_server: Running, binned: None) -> dict[str, Any]:
    before = api_server.last_event
    found = api_server.fixate(TEXTURED)
    api_server.wait_for_event("cloud.created", after=before, of=found["id"])
    return found


def choose(server: Running, binning: int) -> dict[str, Any]:
    answer = server.http.put(f"/api/v1{URL}", json={"working_binning": binning})
    assert answer.status_code == 200, answer.text
    found: dict[str, Any] = answer.json()
    return found


def cloud_of(server: Running, fixation: dict[str, Any]) -> dict[str, Any]:
    cloud_id = server.get(f"/fixations/{fixation['id']}").json()["cloud_id"]
    found: dict[str, Any] = server.get(f"/clouds/{cloud_id}").json()
    return found


def test_a_switch_takes_effect_at_once_and_says_what_it_took(api_server: Running) -> None:
    before = api_server.last_event
    full = choose(api_server, 1)
    assert (full["working_binning"], full["in_force"], full["held_by"], full["problem"]) == (1, 1, None, None)
    assert 0.0 < full["switch_s"] < 10.0
    assert api_server.wait_for_event("rig.binning", after=before) == full
    half = choose(api_server, 2)
    assert (half["working_binning"], half["in_force"]) == (2, 2)
    assert api_server.get("/rig").json()["binning"] == api_server.get(URL).json() == half
    assert {camera["settings"]["binning"] for camera in api_server.get("/cameras").json()} == {2}


@pytest.mark.parametrize("body", [{"working_binning": 3}, {}, {"working_binning": "two"}])
def test_other_binnings_are_refused(api_server: Running, body: object) -> None:
    answer = api_server.http.put(f"/api/v1{URL}", json=body)
    assert (answer.status_code, answer.json()["type"]) == (422, "/problems/invalid-input")


def test_only_who_has_control_changes_it_or_orders_a_look(
    api_server: Running, fixation: dict[str, Any]
) -> None:
    token = api_server.post("/lease", {"holder": "somebody"}).json()["token"]
    try:
        refused = [
            api_server.http.put(f"/api/v1{URL}", json={"working_binning": 1}),
            api_server.post(f"/fixations/{fixation['id']}/full_resolution"),
        ]
    finally:
        api_server.http.delete("/api/v1/lease", headers={"X-Lease": token})
    assert [answer.status_code for answer in refused] == [409, 409]
    assert "somebody" in refused[0].json()["detail"]
    assert api_server.get(URL).json()["working_binning"] == 2


def test_what_a_camera_refuses_is_told_and_all_stay_as_they_were(
    api_server: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    left = api_server.rig.left
    configure = left.configure

    def refuse(settings: CameraSettings) -> CameraSettings:
        if settings.binning == 1:
            raise InvalidInput("camera left: asked for binning 1, and it has 2; use 2")
        return configure(settings)

    monkeypatch.setattr(left, "configure", refuse)
    refused = api_server.http.put(f"/api/v1{URL}", json={"working_binning": 1})
    assert refused.status_code == 422
    assert refused.json()["detail"] == "camera left: asked for binning 1, and it has 2; use 2"
    now = api_server.get(URL).json()
    assert (now["working_binning"], now["in_force"], now["problem"]) == (2, 2, None)


def test_each_camera_states_its_sensors_pixels_a_degree(api_server: Running) -> None:
    calibration = api_server.services.calibration.require()
    told = {camera["role"]: camera["px_per_deg"] for camera in api_server.get("/cameras").json()}
    # 100 mm and 10.9 mm on pixels of 3.45 um, Table 2; a fold changes a fovea's by its tilt
    assert told["wide"] == pytest.approx(55.1, abs=0.2)
    assert told["left"] == pytest.approx(506.0, rel=0.02)
    assert told["right"] == pytest.approx(px_per_deg(calibration, Role.RIGHT), abs=0.01)


def test_a_look_at_full_resolution_replaces_the_cloud_and_leaves_the_answer(
    api_server: Running, fixation: dict[str, Any]
) -> None:
    half = cloud_of(api_server, fixation)
    assert (half["look_width"], half["look_height"], half["depth_width"]) == (720, 540, 720)

    answer = api_server.post(f"/fixations/{fixation['id']}/full_resolution", Prefer="wait=60")
    assert answer.status_code == 200, answer.text
    full = answer.json()

    assert (full["look_width"], full["look_height"]) == (1440, 1080)
    assert (full["depth_width"], full["depth_height"]) == (1440, 1080)
    assert half["points"] < full["points"] <= 4 * MAX_POINTS
    assert full["points"] > 3 * half["points"]
    assert full["centre_rig_m"][2] == pytest.approx(half["centre_rig_m"][2], rel=0.05)
    assert cloud_of(api_server, fixation) == full
    after = api_server.get(f"/fixations/{fixation['id']}").json()
    assert (after["distance_m"], after["target_id"]) == (fixation["distance_m"], fixation["target_id"])
    assert api_server.get(URL).json()["working_binning"] == 2
    api_server.poll(URL, lambda now: now["in_force"] == 2)
    reading = api_server.get("/depth", x_px=800.0, y_px=610.0).json()
    assert reading["distance_m"] == pytest.approx(fixation["distance_m"], rel=0.02)


def test_the_earlier_cloud_counts_again_when_the_larger_is_removed(
    api_server: Running, fixation: dict[str, Any]
) -> None:
    answer = api_server.post(f"/fixations/{fixation['id']}/full_resolution", Prefer="wait=60")
    earlier = [c for c in api_server.get("/clouds").json() if c["fixation_id"] == fixation["id"]][1]
    assert api_server.http.delete(f"/api/v1/clouds/{answer.json()['id']}").status_code == 204
    assert cloud_of(api_server, fixation) == earlier
    target = next(t for t in api_server.get("/targets").json() if t["id"] == fixation["target_id"])
    assert target["cloud_id"] == earlier["id"]


def test_a_look_at_full_resolution_reports_progress_and_is_cancelled(
    api_server: Running, fixation: dict[str, Any]
) -> None:
    with api_server.services.hardware.session("a test", cancelled=lambda: False):
        waits = api_server.post(f"/fixations/{fixation['id']}/full_resolution")
        assert waits.status_code == 202
        busy = api_server.ended(waits.json())
    assert (busy["kind"], busy["progress"]["total"]) == ("full_resolution", 2)
    assert busy["progress"]["note"] == "look at full resolution"
    assert (busy["state"], busy["problem"]["type"]) == ("failed", "/problems/busy")

    before = len(api_server.get("/clouds").json())
    estimate = api_server.services.depth_backends.estimate

    def cancel_then_estimate(pair: Any) -> Any:  # noqa: ANN401 - passed on
        api_server.post(f"/jobs/{api_server.get('/jobs').json()[0]['id']}/cancel")
        return estimate(pair)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(api_server.services.depth_backends, "estimate", cancel_then_estimate)
        job = api_server.post(f"/fixations/{fixation['id']}/full_resolution").json()
        assert api_server.ended(job)["state"] == "cancelled"
    assert len(api_server.get("/clouds").json()) == before


def test_a_fixation_that_is_not_there_has_no_such_look(api_server: Running) -> None:
    missing = api_server.post("/fixations/fix-none/full_resolution")
    assert (missing.status_code, missing.json()["type"]) == (404, "/problems/not-found")


def test_a_recording_holds_a_switch_back_and_a_still_during_it_has_every_pixel(api_server: Running) -> None:
    recording = api_server.post("/recordings", {"name": "held"})
    assert recording.status_code in (201, 202), recording.text
    api_server.poll(URL, lambda now: now["in_force"] == 1 and now["held_by"] == "a recording")
    try:
        assert choose(api_server, 2)["held_by"] == "a recording"
        still = api_server.post("/stills", {"stack_frames": 1}, Prefer="wait=60")
        assert still.status_code == 200, still.text
        assert api_server.get(URL).json()["in_force"] == 1
    finally:
        api_server.post(f"/recordings/{api_server.get('/recordings').json()[0]['id']}/stop")
    api_server.poll(URL, lambda now: now["in_force"] == 2 and now["held_by"] is None)
