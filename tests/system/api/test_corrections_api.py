"""Corrections, reach and suggestions by REST on the simulated rig."""

import math
from typing import Any

import numpy as np
import pytest

from foveacam_pipeline.verge.values import Basis, DistanceBound, EyeView, Fixation, FixationState
from foveacam_server.resources.looking.fixations import service
from foveacam_server.resources.looking.fixations.schema import FixationDocument
from tests.support.servers.running_server import Running

pytestmark = [pytest.mark.timeout(300), pytest.mark.usefixtures("grey")]

POSTER = {"pixel": {"x_px": 812.0, "y_px": 420.0}, "depth": False}


@pytest.fixture(scope="module")
def fixation(api_server: Running) -> dict[str, Any]:
    return api_server.fixate({**POSTER, "label": "poster"})


def target_of(server: Running, fixation: dict[str, Any]) -> dict[str, Any]:
    return dict(server.get(f"/targets/{fixation['target_id']}").json())


def test_click_that_corrects_gives_its_target_the_new_answer(
    api_server: Running, fixation: dict[str, Any]
) -> None:
    again = api_server.fixate({**POSTER, "corrects": fixation["id"]})
    target = target_of(api_server, fixation)
    assert again["target_id"] == fixation["target_id"]
    assert (target["label"], target["fixation_id"]) == ("poster", again["id"])
    assert target["corrections"][-1]["kind"] == "click"
    assert target["corrections"][-1]["fixation_id"] == again["id"]


def test_a_click_may_name_the_wide_picture_that_it_was_made_on(api_server: Running) -> None:
    for frame_seq in (2**32 - 1, 0):  # the newest picture; one that is gone, which has no effect
        found = api_server.fixate({**POSTER, "frame_seq": frame_seq})
        assert found["basis"] == "both_foveae"
        assert found["request"]["frame_seq"] == frame_seq
    assert api_server.post("/fixations", {**POSTER, "frame_seq": -1}).status_code == 422


def test_farther_looks_at_the_same_pixel_beyond_the_answer(
    api_server: Running, fixation: dict[str, Any]
) -> None:
    path = f"/fixations/{fixation['id']}/corrections"
    found = api_server.post(path, {"direction": "farther"}, Prefer="wait=60").json()
    assert found["request"]["pixel"] == POSTER["pixel"]
    assert found["request"]["within"]["nearest_m"] > fixation["distance_m"]
    assert "farther" in [each["kind"] for each in target_of(api_server, fixation)["corrections"]]


def test_limits_make_a_target_without_a_distance(
    api_server: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    answer = Fixation(
        state=FixationState.LOST,
        reason="nothing to go by",
        target_ax_rad=0.0,
        target_ay_rad=0.0,
        steps=(),
        basis=Basis.BOUND,
        bound=DistanceBound(nearest_m=1.3, farthest_m=math.inf),
        left_view=EyeView(sees_target=True),
        right_view=EyeView(sees_target=False, reason="beyond the right mirror's reach"),
    )
    monkeypatch.setattr(service, "fixate", lambda *_args, **_options: answer)
    found = api_server.fixate({"direction": {"ax_deg": 0.0, "ay_deg": 0.0}, "label": "sky"})
    target = target_of(api_server, found)
    assert (target["basis"], target["distance_m"], target["point_rig_m"]) == ("bound", None, None)
    assert target["bound"] == {"nearest_m": 1.3, "farthest_m": None}
    assert target["right_view"]["reason"] == "beyond the right mirror's reach"
    told = [event["message"] for event in api_server.get("/events/recent", limit=10).json()]
    assert "sky: farther than 1.3 m, in 0 steps" in told


def test_chosen_alternative_becomes_the_targets_distance(
    api_server: Running, fixation: dict[str, Any]
) -> None:
    document = api_server.services.fixations.table.get(fixation["id"]).as_json()
    wall = {"basis": "fovea_and_wide", "distance_m": 9.0, "distance_sigma_m": 0.4, "probability": 0.3}
    own = {key: document[key] for key in ("basis", "distance_m", "distance_sigma_m", "point_rig_m")}
    alternatives = [{**own, "probability": 0.7}, {**wall, "point_rig_m": [0.1, 0.2, 8.9]}]
    second = {**document, "id": "fix-two", "alternatives": alternatives}
    api_server.services.fixations.table.add(FixationDocument.model_validate(second))

    chosen = api_server.post("/fixations/fix-two/choice", {"alternative": 1})
    assert chosen.status_code == 200, chosen.text
    assert chosen.json()["chosen_alternative"] == 1
    target = target_of(api_server, fixation)
    assert (target["distance_m"], target["basis"]) == (9.0, "fovea_and_wide")
    assert target["corrections"][-1]["kind"] == "choice"
    assert target["corrections"][-1]["alternative"] == 1


def test_corrections_that_cannot_be_are_refused_in_words(
    api_server: Running, fixation: dict[str, Any]
) -> None:
    path = f"/fixations/{fixation['id']}"
    assert "no alternatives" in api_server.post(f"{path}/choice", {"alternative": 1}).json()["detail"]
    assert api_server.post("/fixations", {**POSTER, "corrects": "fix-nobody"}).status_code == 404
    nowhere = api_server.post("/fixations", {**POSTER, "within": {"nearest_m": 3.0, "farthest_m": 2.0}})
    assert nowhere.status_code == 422
    assert "leave no distance" in nowhere.json()["detail"]


def test_suggestions_are_in_reach_of_both_eyes(api_server: Running) -> None:
    found = api_server.get("/suggestions").json()
    assert len(found) == 3
    reach = api_server.get("/reach", distance_m=3.0).json()
    for side in ("left_px", "right_px"):
        low, high = np.min(reach[side], axis=0), np.max(reach[side], axis=0)
        for each in found:
            assert np.all(low < [each["x_px"], each["y_px"]])
            assert np.all([each["x_px"], each["y_px"]] < high)


def test_suggestions_that_were_checked_are_seen_by_both_foveae_and_listed_from_then_on(
    api_server: Running,
) -> None:
    checked = api_server.post("/suggestions/checks").json()
    assert len(checked) == 3
    assert all(place["verified"] for place in checked)
    assert api_server.get("/suggestions").json() == checked
    for place in checked:
        found = api_server.fixate({"pixel": {"x_px": place["x_px"], "y_px": place["y_px"]}, "depth": False})
        assert found["basis"] == "both_foveae", found["reason"]


def test_suggestions_are_not_checked_while_the_mirrors_are_stopped(api_server: Running) -> None:
    api_server.post("/stop")
    try:
        refused = api_server.http.post("/api/v1/suggestions/checks", params={"count": 10})
        assert (refused.status_code, refused.json()["type"]) == (409, "/problems/stopped")
    finally:
        api_server.http.delete("/api/v1/stop")


def test_best_suggestion_is_seen_by_both_foveae(api_server: Running) -> None:
    best = api_server.get("/suggestions").json()[0]
    found = api_server.fixate({"pixel": {"x_px": best["x_px"], "y_px": best["y_px"]}, "depth": False})
    assert found["basis"] == "both_foveae", found["reason"]
