"""Cameras by REST on the simulated rig: settings with read-back, the linked pair, trigger tests."""

import json
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from foveacam_hardware.contract import CameraSettings, OutOfRange, Role
from tests.support.servers.running_server import API, CENTRE, Running


@pytest.fixture(autouse=True)
def restore_settings(request: pytest.FixtureRequest) -> Iterator[None]:
    yield
    if "api_server" in request.fixturenames:
        server: Running = request.getfixturevalue("api_server")
        for role in Role:
            server.http.delete(f"{API}/cameras/{role.value}/settings")


def patch(server: Running, role: str, **body: object) -> dict[str, Any]:  # Any: a JSON document
    answer = server.http.patch(f"{API}/cameras/{role}", json=body)
    assert answer.status_code == 200, answer.text
    found: dict[str, Any] = answer.json()
    return found


def settings(server: Running, role: str) -> dict[str, Any]:  # Any: a JSON document
    found: dict[str, Any] = server.get(f"/cameras/{role}").json()["settings"]
    return found


def self_test(server: Running) -> dict[str, dict[str, Any]]:  # Any: a JSON document
    answer = server.post("/cameras/self_tests", Prefer="wait=60")
    assert answer.status_code == 200, answer.text
    return {eye["eye"]: eye for eye in answer.json()["eyes"]}


def wait_until(holds: Callable[[], bool]) -> None:
    never = threading.Event()
    for _ in range(600):
        if holds():
            return
        never.wait(0.05)
    raise AssertionError("it did not come about")


def test_a_camera_tells_its_settings_ranges_link_and_counters(api_server: Running) -> None:
    camera = api_server.get("/cameras/left").json()

    assert camera["settings"]["exposure_ms"] == pytest.approx(8.0, abs=0.01)
    assert camera["settings"]["trigger"] == "hardware"
    assert camera["settings"]["kept"] is False
    assert camera["ranges"]["exposure_ms"] == {"low": 0.03, "high": 1000.0}
    assert camera["ranges"]["pixel_formats"] == ["Mono8", "Mono12", "RGB8"]
    assert camera["link"]["phase"] == "streaming"
    assert camera["link"]["epoch"] >= 1
    assert {camera[name] for name in ("incomplete", "late", "underrun")} == {0}


def test_a_camera_takes_what_it_is_told_and_answers_with_what_it_took(api_server: Running) -> None:
    changed = patch(api_server, "wide", exposure_ms=5.0, gain_db=3.14, black_level=2.6, frame_rate_hz=20.0)
    taken = changed["cameras"][0]["settings"]

    assert taken["exposure_ms"] == pytest.approx(5.0, abs=0.002)  # whole lines
    assert (taken["gain_db"], taken["black_level"], taken["frame_rate_hz"]) == (3.1, 3.0, 20.0)
    assert taken["kept"] is True
    assert settings(api_server, "wide") == taken
    assert api_server.rig.wide.settings.gain_db == pytest.approx(3.1)


def test_a_setting_out_of_range_is_refused_with_the_range_and_changes_nothing(api_server: Running) -> None:
    before = settings(api_server, "wide")
    answer = api_server.http.patch(f"{API}/cameras/wide", json={"exposure_ms": 5000.0, "gain_db": 6.0})

    assert answer.status_code == 422
    assert answer.json()["type"] == "/problems/out-of-range"
    assert "0.03 to 1000 ms" in answer.json()["detail"]
    assert settings(api_server, "wide") == before


@pytest.mark.parametrize(
    ("role", "body"),
    [
        ("wide", {}),
        ("wide", {"gain_db": "3"}),
        ("wide", {"pixel_format": "Mono16"}),
        ("wide", {"gain_db": 3.0, "linked": True}),
        ("wide", {"shutter": 3.0}),
        ("middle", {"gain_db": 3.0}),
    ],
)
def test_a_change_that_makes_no_sense_is_refused(
    api_server: Running, role: str, body: dict[str, object]
) -> None:
    assert api_server.http.patch(f"{API}/cameras/{role}", json=body).status_code == 422


def test_linked_settings_reach_both_foveae_and_nothing_diverges(api_server: Running) -> None:
    changed = patch(api_server, "right", exposure_ms=4.0, gain_db=2.0, linked=True)

    assert [camera["role"] for camera in changed["cameras"]] == ["left", "right"]
    assert settings(api_server, "left")["exposure_ms"] == settings(api_server, "right")["exposure_ms"]
    assert changed["divergence"] == []
    assert api_server.fixate({**CENTRE, "depth": False})["state"] in (
        "verged",
        "no_texture",
        "lost",
    )  # the pair still looks


def test_foveae_that_differ_are_told_until_they_agree_again(api_server: Running) -> None:
    patch(api_server, "left", exposure_ms=4.0, pixel_format="Mono8", linked=False)
    found = {entry["setting"]: entry for entry in api_server.get("/rig").json()["divergence"]}

    assert set(found) == {"exposure_ms", "pixel_format"}
    assert (found["pixel_format"]["left"], found["pixel_format"]["right"]) == ("Mono8", "RGB8")
    changed = patch(api_server, "left", exposure_ms=8.0, pixel_format="RGB8", linked=True)
    assert changed["divergence"] == []


def test_a_change_that_one_fovea_refuses_reaches_neither(
    api_server: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(asked: CameraSettings) -> CameraSettings:
        raise OutOfRange(f"camera right: gain {asked.gain_db:g} dB is too much; choose less")

    before = settings(api_server, "left")
    with monkeypatch.context() as patched:
        patched.setattr(api_server.rig.right, "configure", refuse)
        answer = api_server.http.patch(f"{API}/cameras/left", json={"gain_db": 5.0, "linked": True})

    assert answer.status_code == 422
    assert settings(api_server, "left") == before


def test_the_wide_camera_exposes_by_itself_and_says_how_long(api_server: Running) -> None:
    changed = patch(api_server, "wide", exposure_ms=1.0, exposure_auto="continuous")
    assert changed["cameras"][0]["settings"]["exposure_auto"] == "continuous"
    wait_until(lambda: settings(api_server, "wide")["exposure_ms"] > 4.0)
    in_force = api_server.rig.wide.settings

    assert settings(api_server, "wide")["exposure_ms"] == pytest.approx(in_force.exposure_ns / 1e6, rel=0.5)
    assert api_server.get("/cameras/wide").json()["exposure_ms"] > 4.0
    assert patch(api_server, "wide", exposure_ms=5.0)["cameras"][0]["settings"]["exposure_auto"] == "off"


def test_once_ends_by_itself_and_what_it_found_is_kept(api_server: Running) -> None:
    after = api_server.last_event
    patch(api_server, "wide", exposure_ms=1.0, exposure_auto="once")
    wait_until(lambda: settings(api_server, "wide")["exposure_auto"] == "off")
    found_ms = settings(api_server, "wide")["exposure_ms"]
    said = f"camera wide found an exposure of {found_ms:.3g} ms"

    assert found_ms > 4.0
    wait_until(
        lambda: said in [one.message for one in api_server.services.events.recent(200) if one.id > after]
    )
    kept = next((Path(api_server.services.settings.data) / "cameras").glob("SIM-000000*.json"))
    assert json.loads(kept.read_text(encoding="utf-8"))["exposure_ns"] == round(found_ms * 1e6)


def test_a_rate_of_its_own_is_told_and_left_by_giving_one(api_server: Running) -> None:
    own = patch(api_server, "wide", exposure_ms=20.0, frame_rate_auto=True)["cameras"][0]["settings"]
    by_hand = patch(api_server, "wide", frame_rate_hz=12.0)["cameras"][0]["settings"]

    assert (own["frame_rate_auto"], own["frame_rate_hz"]) == (True, pytest.approx(50.0, rel=0.001))
    assert (by_hand["frame_rate_auto"], by_hand["frame_rate_hz"]) == (False, 12.0)


def test_the_foveae_find_one_exposure_for_both_and_keep_it(api_server: Running) -> None:
    assert api_server.get("/cameras/left").json()["ranges"]["exposure_auto"] == ["off", "once"]
    patch(api_server, "left", exposure_ms=1.0, linked=True)
    changed = patch(api_server, "left", exposure_auto="once", linked=True)
    left, right = (camera["settings"] for camera in changed["cameras"])

    assert left["exposure_ms"] == right["exposure_ms"] > 4.0
    assert {eye["exposure_auto"] for eye in (left, right)} == {"off"}
    assert left["kept"] and right["kept"]
    assert changed["divergence"] == []
    assert api_server.services.events.recent(1)[0].message.startswith("both foveae expose")


@pytest.mark.parametrize(
    "body",
    [
        {"exposure_auto": "continuous", "linked": True},
        {"exposure_auto": "continuous"},
        {"exposure_auto": "once"},
    ],
)
def test_a_fovea_never_exposes_by_itself(api_server: Running, body: dict[str, object]) -> None:
    before = settings(api_server, "left")
    answer = api_server.http.patch(f"{API}/cameras/left", json=body)

    assert answer.status_code == 422
    assert "one pulse exposes both foveae alike" in answer.json()["detail"]
    assert answer.json()["remedy"] == 'ask for "once" with linked, which finds one exposure for both'
    assert settings(api_server, "left") == before


def test_foveae_that_differ_find_no_exposure_before_they_are_alike(api_server: Running) -> None:
    patch(api_server, "left", gain_db=6.0)
    answer = api_server.http.patch(f"{API}/cameras/left", json={"exposure_auto": "once", "linked": True})

    assert answer.status_code == 422
    assert "they differ in gain_db; give both the same" in answer.json()["detail"]


def test_no_exposure_is_looked_for_while_the_stop_is_engaged(api_server: Running) -> None:
    before = [settings(api_server, role) for role in ("left", "right")]
    api_server.post("/stop")
    try:
        answer = api_server.http.patch(f"{API}/cameras/left", json={"exposure_auto": "once", "linked": True})
    finally:
        api_server.http.delete(f"{API}/stop")

    assert answer.status_code == 409
    assert answer.json()["type"] == "/problems/stopped"
    assert [settings(api_server, role)["exposure_ms"] for role in ("left", "right")] == [
        eye["exposure_ms"] for eye in before
    ]


def test_triggers_that_work_are_ok_and_what_ran_is_restored(api_server: Running) -> None:
    rest = {"binning": None}  # the rig's, which a session may change until a moment after its end
    before = [settings(api_server, role) | rest for role in ("left", "right")]
    found = self_test(api_server)

    assert {eye: test["verdict"] for eye, test in found.items()} == {"left": "ok", "right": "ok"}
    assert all(test["software_ms"] > 8.0 and test["hardware_ms"] > 8.0 for test in found.values())
    assert [settings(api_server, role) | rest for role in ("left", "right")] == before
    assert api_server.get("/cameras/self_tests/newest").json()["eyes"][0]["verdict"] == "ok"
    assert api_server.get("/cameras/self_tests/trg-none").status_code == 404


def test_a_trigger_cable_that_is_off_is_wiring_of_that_eye_alone(api_server: Running) -> None:
    api_server.truth.world.faults.no_trigger.add(Role.LEFT)
    try:
        found = self_test(api_server)
    finally:
        api_server.truth.world.faults.no_trigger.clear()

    assert (found["left"]["verdict"], found["right"]["verdict"]) == ("wiring", "ok")
    assert "check its trigger and strobe cables" in found["left"]["detail"]


def test_a_strobe_that_does_not_arrive_is_wiring(api_server: Running) -> None:
    api_server.truth.world.faults.no_strobe.add(Role.RIGHT)
    try:
        found = self_test(api_server)
    finally:
        api_server.truth.world.faults.no_strobe.clear()

    assert found["right"]["verdict"] == "wiring"
    assert "strobe did not reach the controller" in found["right"]["detail"]


def test_an_unplugged_camera_is_the_camera(api_server: Running) -> None:
    api_server.truth.world.faults.unplugged.add(Role.LEFT)
    try:
        found = self_test(api_server)
    finally:
        api_server.truth.world.faults.unplugged.clear()

    assert (found["left"]["verdict"], found["right"]["verdict"]) == ("camera", "ok")
    wait_until(lambda: api_server.get("/cameras/left").json()["link"]["phase"] == "streaming")
    wait_until(lambda: api_server.get("/rig").json()["state"] == "ready")


def test_while_the_stop_is_engaged_only_commands_are_tested(api_server: Running) -> None:
    api_server.post("/stop")
    try:
        found = self_test(api_server)
    finally:
        api_server.http.delete(f"{API}/stop")

    assert {test["verdict"] for test in found.values()} == {"ok_software_only"}
