"""With one fovea camera unplugged the other one still answers, against the wide camera."""

from collections.abc import Iterator

import pytest

from tests.support.servers.running_server import API, Running

pytestmark = [pytest.mark.timeout(120), pytest.mark.usefixtures("grey")]

FAULTS = f"{API}/simulation/faults"
POSTER_PX = {"pixel": {"x_px": 812.0, "y_px": 420.0}}
WHITEBOARD_PX = {"pixel": {"x_px": 660.0, "y_px": 300.0}}


@pytest.fixture(scope="module", params=["left", "right"])
def lost(api_server: Running, request: pytest.FixtureRequest) -> Iterator[str]:
    """Unplug one fovea; plug it in again afterwards, and wait until it is back."""
    role = str(request.param)
    before = api_server.last_event
    api_server.http.put(FAULTS, json={"unplugged": [role]})
    try:
        assert api_server.wait_for_event("device.fault", after=before)["device"] == role
        yield role
    finally:
        api_server.http.delete(FAULTS)
        api_server.wait_for_event("device.recovered", after=before)


def test_the_other_fovea_answers_and_the_missing_ones_pane_says_why(api_server: Running, lost: str) -> None:
    other = "right" if lost == "left" else "left"

    found = api_server.fixate(POSTER_PX)

    assert found["basis"] == "fovea_and_wide", found["reason"]
    assert f"the {lost} eye has no camera" in found["reason"]
    assert found[f"{other}_view"] == {"sees_target": True, "reason": ""}
    assert not found[f"{lost}_view"]["sees_target"]
    assert "camera" in found[f"{lost}_view"]["reason"]
    seen = api_server.truth.depth_at(812.0, 420.0, api_server.services.clock.now_ns())
    assert seen is not None
    assert abs(found["distance_m"] - seen.range_m) <= 3.0 * found["distance_sigma_m"]
    assert found["distance_sigma_m"] <= 0.02 * seen.range_m


def test_what_is_blank_gets_an_answer_that_holds_too(api_server: Running, lost: str) -> None:
    found = api_server.fixate(WHITEBOARD_PX)
    seen = api_server.truth.depth_at(660.0, 300.0, api_server.services.clock.now_ns())

    assert seen is not None
    assert found["basis"] in {"surroundings", "bound"}, found["reason"]
    assert not found[f"{lost}_view"]["sees_target"]
    if found["basis"] == "bound":
        assert found["bound"]["nearest_m"] <= seen.range_m
    else:
        assert abs(found["distance_m"] - seen.range_m) <= 3.0 * found["distance_sigma_m"]


def test_what_needs_both_foveae_is_refused_with_the_remedy(api_server: Running, lost: str) -> None:
    refused = api_server.post("/wide_depth/surveys", {})
    assert refused.status_code == 503, refused.text
    assert lost in refused.json()["detail"]
