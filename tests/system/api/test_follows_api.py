"""Followed targets by REST."""

import re
from collections.abc import Iterator

import pytest

from foveacam_hardware.contract import PARKED
from foveacam_pipeline.capture.dataset import Dataset
from foveacam_pipeline.track.follow import MOST_TARGETS
from foveacam_server.foundation.store import Document
from foveacam_server.rig.schema import FollowMark
from tests.support.servers import server_state
from tests.support.servers.running_server import API, CENTRE, Running

pytestmark = [pytest.mark.timeout(300), pytest.mark.usefixtures("grey")]
SHELF = {"pixel": {"x_px": 800.0, "y_px": 610.0}}
"""So near to the other target that the mirrors rest soon: a swing in an exposure is rendered many times."""


@pytest.fixture(scope="module", autouse=True)
def ended(api_server: Running) -> Iterator[None]:
    """Follow nothing afterwards."""
    yield
    follow_nothing(api_server)


def follow_nothing(server: Running) -> None:
    server.http.delete(f"{API}/follows").raise_for_status()
    server_state.end_jobs(server.http)


def followed(server: Running, body: object = CENTRE) -> str:
    """Follow a target and return its id once the foveae have seen it."""
    answer = server.post("/follows", body)
    assert answer.status_code == 201, answer.text
    follow_id = str(answer.json()["id"])
    seen_more_often(server, follow_id, than=1)
    return follow_id


def test_bad_requests_are_told(api_server: Running) -> None:
    assert api_server.post("/follows", {}).status_code == 422
    both = api_server.post("/follows", {**CENTRE, "target_id": "tgt-1"})
    assert (both.status_code, "found both" in both.json()["detail"]) == (422, True)
    assert api_server.post("/follows", {"target_id": "tgt-1"}).status_code == 404
    assert api_server.post("/follows", {"pixel": {"x_px": 5000.0, "y_px": 1.0}}).status_code == 422
    assert api_server.get("/follows/fol-1/trail").status_code == 404
    nothing = api_server.post("/follows/rounds", {"name": "round"})
    assert (nothing.status_code, "no target is followed" in nothing.json()["detail"]) == (409, True)


def test_a_target_is_followed_marked_changed_and_let_go(api_server: Running) -> None:
    follow_id = followed(api_server)
    found = api_server.get(f"/follows/{follow_id}").json()
    assert found["state"] == "followed"
    assert re.fullmatch(r"Followed \d+", found["label"])
    assert (found["x_px"], found["y_px"]) == pytest.approx((720.0, 540.0), abs=3.0)
    truth = api_server.truth.depth_at(720.0, 540.0, api_server.rig.clock.now_ns())
    assert truth is not None
    assert found["distance_m"] == pytest.approx(truth.range_m, rel=0.02)
    assert found["speed_m_s"] < 0.5
    trail = api_server.get(f"/follows/{follow_id}/trail").json()
    assert len(trail) >= 2
    assert trail[-1]["z_m"] == pytest.approx(found["point_rig_m"][2], rel=0.02)

    (mark,) = marks(api_server)
    assert (mark.id, mark.state) == (follow_id, "followed")
    assert mark.x_px == pytest.approx(720.0, abs=3.0)

    change = {"label": "poster", "tracker": "filter", "priority": 2.0}
    answer = api_server.http.patch(f"{API}/follows/{follow_id}", json=change).json()
    assert {name: answer[name] for name in change} == change
    found = seen_more_often(api_server, follow_id, than=answer["hits"] + 1)
    assert (found["state"], found["tracker"], found["label"]) == ("followed", "filter", "poster")

    assert api_server.http.delete(f"{API}/follows/{follow_id}").status_code == 204
    assert api_server.get("/follows").json() == []
    assert api_server.get(f"/follows/{follow_id}").status_code == 404
    assert marks(api_server) == []


def marks(server: Running) -> list[FollowMark]:
    """Return what the wide view draws over the followed targets."""
    overlay = server.services.overlay.of(server.services.hardware.gaze)
    assert overlay is not None
    return overlay.follows


def test_what_cannot_be_verged_on_is_let_go_with_the_reason(api_server: Running) -> None:
    newest = api_server.get("/events/recent", limit=1).json()[-1]["id"]
    assert (
        api_server.post("/follows", {"pixel": {"x_px": 420.0, "y_px": 300.0}}).status_code == 201
    )  # bare wall
    ended = api_server.wait_for_event("follow.ended", after=newest)
    assert "both foveae must see a target" in ended["reason"]


def test_a_search_for_another_target_leaves_every_second_look_to_those_followed(api_server: Running) -> None:
    follow_id = followed(api_server)
    newest = api_server.get("/events/recent", limit=1).json()[-1]["id"]
    looks = api_server.get(f"/follows/{follow_id}").json()["looks"]
    api_server.post("/follows", {"pixel": {"x_px": 420.0, "y_px": 300.0}}).raise_for_status()  # bare wall
    api_server.wait_for_event("follow.ended", after=newest)
    found = api_server.get(f"/follows/{follow_id}").json()
    assert found["state"] == "followed"
    assert found["looks"] - looks >= 6  # without sharing, one or two that were under way
    follow_nothing(api_server)


def test_two_targets_share_the_foveae_with_a_fixation_and_a_round_until_the_stop(api_server: Running) -> None:
    target_id = api_server.fixate({**CENTRE, "depth": False, "label": "the poster"})["target_id"]
    first, second = followed(api_server, {"target_id": target_id}), followed(api_server, SHELF)
    assert api_server.get(f"/follows/{first}").json()["label"] == "the poster"
    before = {
        follow_id: api_server.get(f"/follows/{follow_id}").json()["hits"] for follow_id in (first, second)
    }
    assert api_server.fixate({**CENTRE, "depth": False})["state"] == "verged"
    for follow_id, hits in before.items():
        seen_more_often(api_server, follow_id, than=hits)

    check_round(api_server, first, second)
    seen_more_often(api_server, first, than=api_server.get(f"/follows/{first}").json()["hits"])

    api_server.post("/stop")
    try:
        api_server.poll("/follows", lambda found: not found)
        assert api_server.post("/follows", CENTRE).status_code == 409
    finally:
        api_server.http.delete(f"{API}/stop")


def seen_more_often(server: Running, follow_id: str, *, than: int) -> Document:
    """Return a followed target once the foveae have seen it more often."""
    return server.poll(f"/follows/{follow_id}", lambda found: found.get("hits", 0) > than)


def check_round(server: Running, first: str, second: str) -> None:
    """Take a round of both targets, and check that it is a dataset whose name is taken."""
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
        assert point.left.shape == point.wide.shape == (540, 720)  # working binning
        assert point.pose.volts not in (None, PARKED)
    again = server.post("/follows/rounds", {"name": "round"})
    assert (again.status_code, "already" in again.json()["detail"]) == (422, True)


def test_more_targets_than_can_be_followed_are_refused(api_server: Running) -> None:
    follow_nothing(api_server)
    for _ in range(MOST_TARGETS):
        assert api_server.post("/follows", CENTRE).status_code == 201
    refused = api_server.post("/follows", CENTRE)
    assert (refused.status_code, f"{MOST_TARGETS} targets" in refused.json()["detail"]) == (409, True)
