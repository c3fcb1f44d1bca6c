"""The vergence loop by REST."""

import math
from collections.abc import Iterator

import pytest

from foveacam_hardware.contract import Role
from foveacam_pipeline.continuous_loop.fault_gate import LATCH_AFTER
from foveacam_server.foundation.store import Document
from tests.support.servers import server_state
from tests.support.servers.running_server import API, CENTRE, Running

pytestmark = [pytest.mark.timeout(300), pytest.mark.usefixtures("grey")]
PNG = b"\x89PNG"
X_PX, Y_PX = CENTRE["pixel"]["x_px"], CENTRE["pixel"]["y_px"]


@pytest.fixture(scope="module", autouse=True)
def ended(api_server: Running) -> Iterator[None]:
    """Leave no loop to the next file."""
    yield
    end_loop(api_server)


@pytest.fixture(autouse=True)
def default_settings(api_server: Running) -> None:
    api_server.http.delete(f"{API}/loop/settings").raise_for_status()


@pytest.fixture
def no_loop(api_server: Running) -> None:
    end_loop(api_server)


def end_loop(server: Running) -> None:
    server_state.end_jobs(server.http)
    server.http.delete(f"{API}/loop").raise_for_status()
    server.poll("/loop", lambda loop: not loop["running"])


def tracking(server: Running) -> Document:
    """Return the loop that tracks the target: that of the test before, or a new one."""
    loop: Document = server.get("/loop").json()
    if loop["running"] and loop["status"] == "tracking":
        return loop
    end_loop(server)
    answer = server.post("/loop", CENTRE)
    assert answer.status_code == 200, answer.text
    return server.poll("/loop", lambda loop: loop["status"] == "tracking" and loop["looks"] > 2)


def axis(loop: Document, name: str) -> Document:
    found: Document = next(one for one in loop["axes"] if one["axis"] == name)
    return found


def changed(server: Running, patch: object) -> Document:
    answer = server.http.patch(f"{API}/loop", json=patch)
    assert answer.status_code == 200, answer.text
    found: Document = answer.json()
    return found


def test_what_needs_a_running_loop_says_so(api_server: Running, no_loop: None) -> None:
    answers = [
        api_server.http.patch(f"{API}/loop", json={"paused": True}),
        api_server.http.put(f"{API}/loop/drag", json={"x_px": 1.0, "y_px": 1.0}),
        api_server.post("/loop/tune", {}),
        api_server.post("/loop/trigger/reset"),
    ]
    assert [answer.status_code for answer in answers] == [409] * 4
    assert "choose a target first" in answers[0].json()["detail"]
    assert api_server.post("/loop", {}).status_code == 422
    assert api_server.post("/loop", {"pixel": {"x_px": 5000.0, "y_px": 1.0}}).status_code == 422
    assert not api_server.get("/loop").json()["running"]
    assert api_server.get("/loop/match.png").status_code == 404
    assert api_server.get("/loop/history").json() == []


def test_settings_are_bounded_kept_and_put_back_by_group(api_server: Running, no_loop: None) -> None:
    gains = {"kp": 0.3, "ki": 0.1, "kd": 0.05}
    patch = {"pan": gains, "most_hz": 20.0, "tracker": "off"}
    kept = api_server.http.patch(f"{API}/loop/settings", json=patch).json()
    assert (kept["pan"], kept["most_hz"], kept["tracker"]) == (gains, 20.0, "off")
    for refused in (
        {"sensitivity": 5.0},
        {"pan": {"kp": 3.0, "ki": 0.0, "kd": 0.0}},
        {"box_width_px": 10},
        {"lead_ms": 60.0},
        {"tracker": "eye"},
    ):
        assert api_server.http.patch(f"{API}/loop/settings", json=refused).status_code == 422
    assert api_server.get("/loop").json()["settings"] == kept
    reset = api_server.http.delete(f"{API}/loop/settings", params={"group": "pan"}).json()
    assert (reset["pan"]["kp"], reset["most_hz"]) == (0.1, 20.0)
    assert api_server.http.delete(f"{API}/loop/settings").json()["most_hz"] is None
    assert api_server.http.delete(f"{API}/loop/settings", params={"group": "eyes"}).status_code == 422


def test_the_loop_keeps_both_foveae_on_a_target(api_server: Running) -> None:
    loop = tracking(api_server)
    truth = api_server.truth.depth_at(X_PX, Y_PX, api_server.rig.clock.now_ns())
    assert truth is not None
    assert loop["distance_m"] == pytest.approx(truth.range_m, rel=0.02)
    assert min(loop["score_left"], loop["score_right"]) > loop["settings"]["min_score"]
    assert abs(axis(loop, "verge")["error_deg"]) < 0.1
    assert loop["trigger"]["failures"] == 0
    overlay = api_server.services.overlay.of(api_server.services.hardware.gaze)
    assert overlay is not None
    assert [(mark.id, mark.state) for mark in overlay.follows] == [("loop", "followed")]


def test_history_and_picture_tell_what_the_loop_saw(api_server: Running) -> None:
    tracking(api_server)
    samples = api_server.get("/loop/history").json()
    assert [one["look"] for one in samples] == list(range(1, len(samples) + 1))
    assert samples[-1]["t_s"] > samples[0]["t_s"]
    later = api_server.get("/loop/history", after_look=samples[-1]["look"]).json()
    assert all(one["look"] > samples[-1]["look"] for one in later)
    assert math.isfinite(samples[-1]["error_deg"][2])
    picture = api_server.get("/loop/match.png")
    assert (picture.status_code, picture.content[:4]) == (200, PNG)


def test_an_axis_that_is_set_is_held_until_it_is_released(api_server: Running) -> None:
    there_deg = axis(tracking(api_server), "verge")["command_deg"]
    loop = changed(api_server, {"command_deg": {"verge": there_deg + 0.3}})
    assert axis(loop, "verge") == axis(loop, "verge") | {
        "held": True,
        "command_deg": pytest.approx(there_deg + 0.3, abs=1e-4),
    }
    looks = loop["looks"]
    loop = api_server.poll("/loop", lambda now: now["looks"] > looks + 2)
    assert axis(loop, "verge")["command_deg"] == pytest.approx(there_deg + 0.3, abs=1e-4)
    changed(api_server, {"held": {"verge": False}})
    api_server.poll("/loop", lambda now: abs(axis(now, "verge")["command_deg"] - there_deg) < 0.1)


def test_a_paused_loop_corrects_nothing_and_goes_on(api_server: Running) -> None:
    tracking(api_server)
    assert changed(api_server, {"paused": True})["paused"]
    held = api_server.poll("/loop", lambda loop: loop["status"] == "held")
    later = api_server.poll("/loop", lambda loop: loop["looks"] > held["looks"] + 1)
    assert [one["command_deg"] for one in later["axes"]] == [one["command_deg"] for one in held["axes"]]
    changed(api_server, {"paused": False})
    api_server.poll("/loop", lambda loop: loop["status"] == "tracking")


def test_a_drag_takes_the_eyes_and_the_loop_goes_on_afterwards(api_server: Running) -> None:
    tracking(api_server)
    place = {"x_px": 860.0, "y_px": 700.0}
    assert api_server.http.put(f"{API}/loop/drag", json=place).status_code == 204
    loop = api_server.poll("/loop", lambda now: now["status"] == "manual")
    assert loop["dragged"]
    assert axis(loop, "verge")["command_deg"] == 0.0
    gaze = api_server.get("/mirrors").json()
    assert gaze["left"]["ax_deg"] == pytest.approx(gaze["right"]["ax_deg"], abs=0.1)
    beyond = api_server.http.put(f"{API}/loop/drag", json={"x_px": 9000.0, "y_px": 1.0})
    assert beyond.status_code == 422
    assert api_server.http.delete(f"{API}/loop/drag").status_code == 204
    loop = api_server.poll("/loop", lambda now: now["status"] == "tracking")
    assert (loop["target"]["x_px"], loop["target"]["y_px"]) == pytest.approx((X_PX, Y_PX), abs=3.0)


def test_tuning_that_is_cancelled_leaves_the_gains_and_the_loop_goes_on(api_server: Running) -> None:
    before = tracking(api_server)["settings"]
    job = api_server.post("/loop/tune", {"polish": False}).json()
    api_server.poll("/loop", lambda loop: loop["status"] == "auto_tune")
    refused = api_server.http.patch(f"{API}/loop/settings", json={"min_score": 0.5})
    assert (refused.status_code, "being tuned" in refused.json()["detail"]) == (409, True)
    assert api_server.post("/loop/tune", {}).status_code == 409
    api_server.post(f"/jobs/{job['id']}/cancel")
    ended = api_server.ended(job)
    assert ended["state"] == "cancelled", ended
    loop = api_server.poll("/loop", lambda now: now["status"] == "tracking")
    assert (loop["settings"], loop["tuned"], loop["tune_job_id"]) == (before, None, None)
    assert api_server.get("/loop/tune.png").status_code == 404


def test_a_fixation_comes_between_and_the_loop_goes_on(api_server: Running) -> None:
    looks = tracking(api_server)["looks"]
    assert api_server.fixate({**CENTRE, "depth": False})["state"] == "verged"
    api_server.poll("/loop", lambda loop: loop["status"] == "tracking" and loop["looks"] > looks)


def test_each_eye_follows_a_place_of_its_own_until_the_eyes_are_united(api_server: Running) -> None:
    tracking(api_server)
    beyond = api_server.http.put(f"{API}/loop/eyes/left", json={"x_px": 2000.0, "y_px": 10.0})
    assert (beyond.status_code, "outside the fovea" in beyond.json()["detail"]) == (422, True)
    assert api_server.get("/loop").json()["eyes"] == []
    answer = api_server.http.put(f"{API}/loop/eyes/left", json={"x_px": 820.0, "y_px": 480.0})
    assert answer.status_code == 200, answer.text
    apart = api_server.poll("/loop", lambda loop: loop["status"] == "split" and loop["eyes"][0]["score"])
    assert [(eye["eye"], eye["state"]) for eye in apart["eyes"]] == [("left", "tracking"), ("right", "still")]
    assert apart["distance_m"] is None
    api_server.poll("/loop", lambda loop: abs(loop["eyes"][0]["x_px"] - 719.5) < 20.0)
    assert api_server.post("/loop/tune", {}).status_code == 409
    survives_a_failure(api_server, Role.LEFT, Role.RIGHT, goes_on="split")

    assert api_server.http.delete(f"{API}/loop/eyes").status_code == 200
    assert api_server.poll("/loop", lambda loop: loop["status"] == "tracking")["eyes"] == []


def test_a_failure_that_passes_is_survived_without_a_reset(api_server: Running) -> None:
    tracking(api_server)
    survives_a_failure(api_server, Role.LEFT, goes_on="tracking")


def survives_a_failure(server: Running, *eyes: Role, goes_on: str) -> None:
    """Let strobes fail once, and the loop go on by itself."""
    failures = server.get("/loop").json()["trigger"]["failures"]
    faults = server.truth.world.faults
    faults.no_strobe.update(eyes)
    try:
        server.poll("/loop", lambda loop: loop["trigger"]["failures"] > failures)
    finally:
        faults.no_strobe.clear()
    loop = server.poll("/loop", lambda loop: loop["status"] == goes_on and loop["trigger"]["in_a_row"] == 0)
    assert not loop["trigger"]["latched"]
    assert loop["running"]


def test_equal_failures_of_the_exposure_latch_the_loop_until_the_trigger_is_reset(
    api_server: Running,
) -> None:
    tracking(api_server)
    faults = api_server.truth.world.faults
    faults.no_strobe.update((Role.LEFT, Role.RIGHT))
    try:
        latched = api_server.poll("/loop", lambda loop: loop["trigger"]["latched"])
        assert latched["trigger"]["in_a_row"] == LATCH_AFTER
        assert "strobe" in api_server.poll("/loop", lambda loop: loop["status"] == "trigger_fault")["detail"]
    finally:
        faults.no_strobe.clear()
    api_server.poll("/rig", lambda rig: not rig["problems"])  # a live look has shown that it works again
    assert api_server.post("/loop/trigger/reset", {}).status_code == 200
    assert api_server.poll("/loop", lambda loop: loop["status"] == "tracking")["trigger"]["in_a_row"] == 0


def test_the_loop_is_ended_and_it_and_following_exclude_each_other(api_server: Running) -> None:
    tracking(api_server)
    before = api_server.last_event
    refused = api_server.post("/follows", CENTRE)
    assert (refused.status_code, "loop" in refused.json()["detail"]) == (409, True)
    assert api_server.http.delete(f"{API}/loop").status_code == 204
    assert api_server.wait_for_event("loop.ended", after=before)["status"] == "off"
    assert api_server.poll("/loop", lambda now: not now["running"])["status"] == "off"
    assert api_server.post("/follows", CENTRE).status_code == 201
    refused = api_server.post("/loop", CENTRE)
    assert (refused.status_code, "follow targets" in refused.json()["detail"]) == (409, True)
    api_server.http.delete(f"{API}/follows").raise_for_status()
