"""Followed targets by REST."""

import pytest

from foveacam_hardware.contract import PARKED
from foveacam_pipeline.capture.dataset import Dataset
from foveacam_pipeline.track.follow import MOST_TARGETS
from tests.system import server_state
from tests.system.conftest import API, CENTRE, Running

pytestmark = pytest.mark.timeout(300)
TEXTURED = {"pixel": {"x_px": 860.0, "y_px": 900.0}}
"""The yellow book."""


@pytest.fixture(autouse=True)
def nothing_followed(server: Running) -> None:
    server.http.delete(f"{API}/follows").raise_for_status()
    server_state.end_jobs(server.http)


def followed(server: Running, body: object = CENTRE) -> str:
    """Follow a target and return its id once the foveae have seen it."""
    answer = server.post("/follows", body)
    assert answer.status_code == 201, answer.text
    follow_id = str(answer.json()["id"])
    server.poll(f"/follows/{follow_id}", lambda found: found.get("hits", 0) > 1)
    return follow_id


def test_a_target_is_followed_with_its_position_until_it_is_let_go(server: Running) -> None:
    follow_id = followed(server)
    found = server.get(f"/follows/{follow_id}").json()
    assert found["state"] == "followed"
    assert found["label"] == "Followed 1"
    assert (found["x_px"], found["y_px"]) == pytest.approx((720.0, 540.0), abs=3.0)
    truth = server.truth.depth_at(720.0, 540.0, server.rig.clock.now_ns())
    assert truth is not None
    assert found["distance_m"] == pytest.approx(truth.range_m, rel=0.02)
    assert found["speed_m_s"] < 0.5
    trail = server.get(f"/follows/{follow_id}/trail").json()
    assert len(trail) >= 2
    assert trail[-1]["z_m"] == pytest.approx(found["point_rig_m"][2], rel=0.02)

    assert server.http.delete(f"{API}/follows/{follow_id}").status_code == 204
    assert server.get("/follows").json() == []
    assert server.get(f"/follows/{follow_id}").status_code == 404


def test_the_wide_view_marks_what_is_followed(server: Running) -> None:
    follow_id = followed(server)
    overlay = server.services.overlay.of(server.services.hardware.gaze)
    assert overlay is not None
    assert [(mark.id, mark.state) for mark in overlay.follows] == [(follow_id, "followed")]
    assert overlay.follows[0].x_px == pytest.approx(720.0, abs=3.0)
    server.http.delete(f"{API}/follows")
    overlay = server.services.overlay.of(server.services.hardware.gaze)
    assert overlay is not None
    assert overlay.follows == []


def test_two_targets_share_the_foveae_and_a_fixation_comes_between(server: Running) -> None:
    first, second = followed(server), followed(server, TEXTURED)
    before = server.get(f"/follows/{first}").json()["hits"]
    assert server.fixate({**CENTRE, "depth": False})["state"] == "verged"
    for follow_id in (first, second):
        server.poll(f"/follows/{follow_id}", lambda found: found["hits"] > before + 2)


def test_label_tracker_and_priority_are_changed_while_it_is_followed(server: Running) -> None:
    follow_id = followed(server)
    change = {"label": "poster", "tracker": "filter", "priority": 2.0}
    answer = server.http.patch(f"{API}/follows/{follow_id}", json=change).json()
    assert {name: answer[name] for name in change} == change
    hits = answer["hits"]
    found = server.poll(f"/follows/{follow_id}", lambda now: now["hits"] > hits + 2)
    assert (found["state"], found["tracker"], found["label"]) == ("followed", "filter", "poster")


def test_a_stored_target_is_followed_by_its_id_and_keeps_its_name(server: Running) -> None:
    target_id = server.fixate({**CENTRE, "depth": False, "label": "the poster"})["target_id"]
    follow_id = followed(server, {"target_id": target_id})
    assert server.get(f"/follows/{follow_id}").json()["label"] == "the poster"


def test_what_cannot_be_verged_on_is_let_go_with_the_reason(server: Running) -> None:
    newest = server.get("/events/recent", limit=1).json()[-1]["id"]
    assert server.post("/follows", {"pixel": {"x_px": 420.0, "y_px": 300.0}}).status_code == 201  # bare wall
    ended = server.wait_for_event("follow.ended", after=newest)
    assert "both foveae must see a target" in ended["reason"]


def test_the_stop_ends_following(server: Running) -> None:
    followed(server)
    server.post("/stop")
    try:
        server.poll("/follows", lambda found: not found)
        assert server.post("/follows", CENTRE).status_code == 409
    finally:
        server.http.delete(f"{API}/stop")


def test_a_round_captures_all_targets_as_a_dataset_while_they_are_followed(server: Running) -> None:
    nothing = server.post("/follows/rounds", {"name": "round"})
    assert (nothing.status_code, "no target is followed" in nothing.json()["detail"]) == (409, True)
    first, second = followed(server), followed(server, TEXTURED)
    answer = server.post("/follows/rounds", {"name": "round", "label": "both"}, Prefer="wait=60")
    assert answer.status_code == 200, answer.text
    taken = answer.json()
    assert (taken["name"], taken["targets"]) == ("round", 2)
    assert server.get(f"/captures/{taken['capture_id']}").json()["state"] == "complete"

    dataset = Dataset.open(server.captures / "round")
    known = dataset.document.header.conditions["targets"]
    assert isinstance(known, list)
    assert [one["id"] for one in known if isinstance(one, dict)] == [first, second]
    assert len(dataset) == 2
    for point in dataset:
        assert point.left.shape == point.wide.shape == (1080, 1440, 3)
        assert point.pose.volts not in (None, PARKED)
    again = server.post("/follows/rounds", {"name": "round"})
    assert (again.status_code, "already" in again.json()["detail"]) == (422, True)
    hits = server.get(f"/follows/{first}").json()["hits"]
    server.poll(f"/follows/{first}", lambda found: found["hits"] > hits)


def test_bad_requests_are_told(server: Running) -> None:
    assert server.post("/follows", {}).status_code == 422
    both = server.post("/follows", {**CENTRE, "target_id": "tgt-1"})
    assert (both.status_code, "found both" in both.json()["detail"]) == (422, True)
    assert server.post("/follows", {"target_id": "tgt-1"}).status_code == 404
    assert server.post("/follows", {"pixel": {"x_px": 5000.0, "y_px": 1.0}}).status_code == 422
    assert server.get("/follows/fol-1/trail").status_code == 404
    for _ in range(MOST_TARGETS):
        assert server.post("/follows", CENTRE).status_code == 201
    refused = server.post("/follows", CENTRE)
    assert (refused.status_code, f"{MOST_TARGETS} targets" in refused.json()["detail"]) == (409, True)
