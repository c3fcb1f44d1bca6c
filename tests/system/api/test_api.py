"""The REST interface on the simulated rig: a fixation from click to cloud, and everything around it."""

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from foveacam_hardware.contract import Role
from foveacam_server.foundation.schema import ResponseModel
from tests.support.servers.running_server import CENTRE, Running

pytestmark = [pytest.mark.timeout(300), pytest.mark.usefixtures("grey")]


@pytest.fixture(scope="module")
def fixation(api_server: Running) -> dict[str, Any]:
    before = api_server.last_event
    found = api_server.fixate({"pixel": {"x_px": 800.0, "y_px": 610.0}, "label": "the shelf"})
    api_server.wait_for_event("cloud.created", after=before, of=found["id"])
    return found


def test_click_gives_the_true_distance_within_three_sigma(
    api_server: Running, fixation: dict[str, Any]
) -> None:
    assert fixation["state"] == "verged"
    seen = api_server.truth.depth_at(800.0, 610.0, api_server.services.clock.now_ns())
    assert seen is not None
    assert abs(fixation["distance_m"] - seen.range_m) <= 3.0 * fixation["distance_sigma_m"]


def test_fixation_is_kept_with_its_steps_and_its_shape(api_server: Running, fixation: dict[str, Any]) -> None:
    kept = api_server.get(f"/fixations/{fixation['id']}").json()
    assert kept["steps"] == fixation["steps"]
    assert kept["cloud_id"] is not None
    assert kept["request"]["label"] == "the shelf"


def test_verged_fixation_becomes_a_target(api_server: Running, fixation: dict[str, Any]) -> None:
    target = next(
        found for found in api_server.get("/targets").json() if found["id"] == fixation["target_id"]
    )
    assert target["label"] == "the shelf"
    assert target["distance_m"] == fixation["distance_m"]


def test_cloud_lies_around_the_fixated_point(api_server: Running, fixation: dict[str, Any]) -> None:
    cloud_id = api_server.get(f"/fixations/{fixation['id']}").json()["cloud_id"]
    cloud = api_server.get(f"/clouds/{cloud_id}").json()
    assert cloud["points"] > 1000
    assert cloud["z_min_m"] <= fixation["point_rig_m"][2] <= cloud["z_max_m"]
    ply = api_server.http.get(cloud["ply_url"])
    assert ply.content.startswith(b"ply\n")
    assert f"element vertex {cloud['points']}".encode() in ply.content
    assert api_server.http.get(cloud["glb_url"]).content.startswith(b"glTF")
    assert api_server.http.get(cloud["depth_url"]).content.startswith(b"\x89PNG")


def test_depth_at_the_clicked_pixel_is_the_fixations(api_server: Running, fixation: dict[str, Any]) -> None:
    depth = api_server.get("/depth", x_px=800.0, y_px=610.0).json()
    combined_m = math.hypot(depth["distance_sigma_m"], fixation["distance_sigma_m"])
    assert abs(depth["distance_m"] - fixation["distance_m"]) <= 3.0 * combined_m
    assert np.linalg.norm(depth["point_rig_m"]) == pytest.approx(depth["distance_m"], abs=1e-5)


def test_depth_where_nobody_looked_says_so(api_server: Running) -> None:
    answer = api_server.get("/depth", x_px=5.0, y_px=5.0)
    assert answer.status_code == 404
    assert "no fovea has looked there" in answer.json()["detail"]


def test_computed_views_have_pictures_after_a_fixation(api_server: Running, fixation: dict[str, Any]) -> None:
    assert fixation["state"] == "verged"
    for view in ("anaglyph", "difference", "depth"):
        assert api_server.get(f"/views/{view}/snapshot.jpg").status_code == 200


def test_direction_that_the_mirrors_do_not_cover_ends_as_out_of_range(api_server: Running) -> None:
    found = api_server.fixate({"direction": {"ax_deg": 9.99, "ay_deg": 9.99}})
    assert found["state"] == "out_of_range"
    assert found["distance_m"] is None
    assert found["target_id"] is None
    assert found["reason"]


def test_rectangle_is_fixated_at_its_texture(api_server: Running) -> None:
    box = {"x_px": 705.0, "y_px": 525.0, "width_px": 30.0, "height_px": 30.0}
    found = api_server.fixate({"rectangle": box, "depth": False})
    assert found["state"] == "verged"
    assert found["request"]["rectangle"] == box


def test_without_prefer_a_fixation_is_a_job_that_leads_to_its_result(api_server: Running) -> None:
    before = api_server.last_event
    answer = api_server.post("/fixations", {**CENTRE, "depth": False})
    assert answer.status_code == 202
    job = answer.json()
    assert answer.headers["Location"] == f"/api/v1/jobs/{job['id']}"
    done = api_server.wait_for_event("fixation.done", after=before)
    assert done["job_id"] == job["id"]
    ended = api_server.post(
        "/fixations", {**CENTRE, "depth": False}, Prefer="wait=60"
    )  # queued behind: it has ended
    assert ended.status_code == 200
    job = api_server.get(f"/jobs/{job['id']}").json()
    assert job["state"] == "succeeded"
    assert job["progress"]["done"] == job["progress"]["total"] == len(done["steps"])
    assert api_server.http.get(job["result_url"]).json()["id"] == done["id"]


def test_distance_is_told_as_it_becomes_known_once_a_look_at_most(api_server: Running) -> None:
    api_server.fixate({**CENTRE, "depth": False})
    before = api_server.last_event
    answer = api_server.fixate({**CENTRE, "depth": False})
    api_server.wait_for_event("fixation.done", after=before)
    events = [event for event in api_server.get("/events/recent", limit=200).json() if event["id"] > before]
    told = [event["data"] for event in events if event["kind"] == "fixation.estimate"]
    steps = [estimate["step"] for estimate in told]
    assert steps == sorted(set(steps)) and len(steps) <= len(answer["steps"]) + 1
    assert {estimate["fixation_id"] for estimate in told} <= {answer["id"]}
    last = api_server.get(f"/fixations/{answer['id']}/estimate").json()
    assert (last["distance_m"], last["step"]) == (answer["distance_m"], len(answer["steps"]))
    assert api_server.get("/fixations/estimates").json() == []
    assert api_server.get("/fixations/fix-none/estimate").status_code == 404
    assert told, "the place was looked at a moment ago"


def test_an_idempotency_key_is_of_one_request_which_is_the_same_job(api_server: Running) -> None:
    flat = {**CENTRE, "depth": False}
    first = api_server.post("/fixations", flat, Idempotency_Key="mine").json()
    again = api_server.post("/fixations", flat, Idempotency_Key="mine")
    other = api_server.post(
        "/fixations", {"direction": {"ax_deg": 1.0, "ay_deg": 0.0}}, Idempotency_Key="mine"
    )
    api_server.post(f"/jobs/{first['id']}/cancel")
    assert again.json()["id"] == first["id"]
    assert other.status_code == 422
    assert "already used" in other.json()["found"]


def test_target_can_be_renamed_looked_at_again_and_forgotten(api_server: Running) -> None:
    target_id = api_server.fixate({**CENTRE, "depth": False})["target_id"]
    assert (
        api_server.http.patch(f"/api/v1/targets/{target_id}", json={"label": "corner"}).json()["label"]
        == "corner"
    )
    again = api_server.post(f"/targets/{target_id}/fixate", Prefer="wait=60").json()
    assert again["target_id"] == target_id
    kept = api_server.get(f"/targets/{target_id}").json()
    assert (kept["label"], kept["fixation_id"]) == ("corner", again["id"])
    assert api_server.http.delete(f"/api/v1/targets/{target_id}").status_code == 204
    assert api_server.get(f"/targets/{target_id}").status_code == 404


def test_removed_cloud_takes_its_files_and_its_depth_along(api_server: Running) -> None:
    before = api_server.last_event
    fixation = api_server.fixate({"pixel": {"x_px": 700.0, "y_px": 600.0}})
    assert fixation["state"] == "verged"
    cloud = api_server.wait_for_event("cloud.created", after=before, of=fixation["id"])
    target = api_server.wait_for_event("target.updated", after=before, of=fixation["id"])
    assert (target["id"], target["cloud_id"]) == (fixation["target_id"], cloud["id"])
    assert api_server.http.delete(f"/api/v1/clouds/{cloud['id']}").status_code == 204
    assert api_server.http.get(cloud["ply_url"]).status_code == 404
    assert api_server.get(f"/fixations/{fixation['id']}").json()["cloud_id"] is None
    depth = api_server.get("/depth", x_px=700.0, y_px=600.0).json()
    assert depth.get("fixation_id") != fixation["id"]  # an earlier look may have seen that pixel too


def test_steering_open_loop_moves_both_eyes(api_server: Running) -> None:
    answer = api_server.post(
        "/mirrors/steer", {"direction": {"ax_deg": 3.0, "ay_deg": -2.0}, "distance_m": None}
    )
    assert answer.status_code == 200
    mirrors = answer.json()
    for eye in ("left", "right"):
        assert mirrors[eye]["ax_deg"] == pytest.approx(3.0, abs=0.01)  # DAC step 0.0006 degrees, pivots 0
        assert mirrors[eye]["ay_deg"] == pytest.approx(-2.0, abs=0.01)


def test_steering_to_a_distance_converges_the_eyes(api_server: Running) -> None:
    near = api_server.post(
        "/mirrors/steer", {"direction": {"ax_deg": 0.0, "ay_deg": 0.0}, "distance_m": 4.0}
    ).json()
    expected_deg = 2.0 * math.degrees(math.atan(0.1 / 4.0))
    assert near["left"]["ax_deg"] - near["right"]["ax_deg"] == pytest.approx(expected_deg, abs=0.02)


def test_rig_document_tells_cameras_mirrors_and_calibration(api_server: Running) -> None:
    rig = api_server.get("/rig").json()
    assert rig["state"] == "ready"
    assert [camera["role"] for camera in rig["cameras"]] == [role.value for role in Role]
    assert all(camera["connected"] for camera in rig["cameras"])
    assert rig["mirrors"]["enabled"]
    assert rig["calibration"]["rig_id"] == rig["rig_id"]
    assert rig["steering"]["ax_min_deg"] < -5.0 < 5.0 < rig["steering"]["ax_max_deg"]
    assert api_server.get("/cameras/left").json()["width"] == 1440


def test_current_calibration_is_among_all(api_server: Running) -> None:
    current = api_server.get("/calibrations/current").json()
    assert current["id"] in [known["id"] for known in api_server.get("/calibrations").json()]
    assert api_server.get(f"/calibrations/{current['id']}").json()["label"] == current["label"]


def test_lease_keeps_others_from_moving_and_names_its_holder(api_server: Running) -> None:
    token = api_server.post("/lease", {"holder": "Ada"}).json()["token"]
    try:
        refused = api_server.post("/fixations", CENTRE)
        assert refused.status_code == 409
        assert "Ada" in refused.json()["detail"]
        steered = api_server.post(
            "/mirrors/steer", {"direction": {"ax_deg": 0.0, "ay_deg": 0.0}}, X_Lease=token
        )
        assert steered.status_code == 200
        assert api_server.get("/lease").json()["holder"] == "Ada"
        assert api_server.http.put("/api/v1/lease", headers={"X-Lease": token}).status_code == 200
    finally:
        api_server.http.delete("/api/v1/lease", headers={"X-Lease": token})
    assert api_server.get("/lease").json()["holder"] is None


def test_lease_can_be_taken_over_and_that_is_written_down(api_server: Running) -> None:
    api_server.post("/lease", {"holder": "Ada"})
    assert api_server.post("/lease", {"holder": "Bob"}).status_code == 409
    token = api_server.post("/lease", {"holder": "Bob", "take_over": True}).json()["token"]
    newest = api_server.get("/events/recent", limit=1).json()[0]
    assert newest["kind"] == "lease.changed"
    assert newest["data"] == {"holder": "Bob", "before": "Ada"}
    assert api_server.http.delete("/api/v1/lease", headers={"X-Lease": token}).status_code == 204


class SecondOf(ResponseModel):
    n: int


def test_events_continue_where_a_client_left_off(api_server: Running) -> None:
    before = api_server.last_event
    api_server.services.events.emit("rig.state", "first")
    api_server.services.events.emit("rig.state", "second", data=SecondOf(n=2))
    assert api_server.wait_for_event("rig.state", after=before + 1) == {"n": 2}


def test_event_that_never_comes_is_missed_with_what_came_instead(api_server: Running) -> None:
    before = api_server.last_event
    api_server.services.events.emit("rig.state", "first")
    with pytest.raises(AssertionError, match=r"no event rig\.never within 1 s .*rig\.state \(1\)"):
        api_server.wait_for_event("rig.never", after=before, within_s=1.0)


def test_metrics_count_frames(api_server: Running) -> None:
    metrics = api_server.http.get("/metrics").text
    assert 'foveacam_camera_frames_total{camera="wide"}' in metrics
    assert "foveacam_rig_ready 1.0" in metrics


def test_metrics_time_the_parts_of_a_fixation_and_every_request(
    api_server: Running, fixation: dict[str, Any]
) -> None:
    api_server.get(f"/fixations/{fixation['id']}")
    api_server.http.request("INVENTED", "/nowhere")
    api_server.http.get("/views/wide/snapshot")
    metrics = api_server.http.get("/metrics").text
    for stage in ("queue", "look", "verge", "depth"):
        count = re.search(rf'foveacam_stage_seconds_count{{stage="{stage}"}} ([0-9.]+)', metrics)
        assert count is not None and float(count[1]) >= 1, stage
    answered = 'foveacam_request_seconds_count{method="GET",route="/fixations/{fixation_id}",status="200"}'
    assert answered in metrics
    assert 'method="other",route="other"' in metrics
    assert "INVENTED" not in metrics and "nowhere" not in metrics


def test_what_dashboard_and_alerts_ask_for_is_counted(api_server: Running) -> None:
    watching = Path(__file__).parents[3] / "docker" / "watching"
    dashboard = json.loads((watching / "dashboard.json").read_text())
    asked = [target["expr"] for panel in dashboard["panels"] for target in panel["targets"]]
    alerts = yaml.safe_load((watching / "alerts.yaml").read_text())
    asked += [rule["expr"] for group in alerts["groups"] for rule in group["rules"]]
    metrics = api_server.http.get("/metrics").text
    for expression in asked:
        for name in re.findall(r"foveacam_\w+", expression):
            assert re.search(rf"^{name}[ {{]", metrics, re.MULTILINE), name
        for stage in re.findall(r'stage="(\w+)"', expression):
            assert f'stage="{stage}"' in metrics


def test_health_and_readiness(api_server: Running) -> None:
    assert api_server.http.get("/healthz").json() == {"status": "ok"}
    assert api_server.http.get("/readyz").json() == {"ready": True, "problems": [], "start": None}
