"""Calibrating over REST: pan-tilt, sessions, records, and what is refused, on the simulated rig."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from foveacam_server.foundation.store import Document
from tests.support.scenes.marker_room import changed_room
from tests.support.servers.running_server import API, Running, running
from tests.support.servers.stored_session import store_session, store_settle

pytestmark = pytest.mark.timeout(300)

FAR_DEG = -70.0
"""So far that whatever holds it comes in time."""
QUICK = dict.fromkeys((24, 25, 110, 111, 120, 121), 1e6)
"""Motors that home in no time; moves are as quick as the rig asks for."""


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    """A server whose rig stands in the room to calibrate in; nobody looks at its live views."""
    scene = changed_room(tmp_path_factory.mktemp("room"), plain=True)
    with running(tmp_path_factory.mktemp("data"), scene=scene, live_hz=(0.2, 0.2)) as found:
        yield found


def new_session(room: Running, label: str = "a test") -> dict[str, Any]:
    answer = room.post("/calibration_sessions", {"label": label})
    assert answer.status_code == 201, answer.text
    found: dict[str, Any] = answer.json()
    return found


def come_to_rest(room: Running) -> Document:
    return room.poll("/pan_tilt", lambda seen: not seen["moving"], every_s=0.1)


def test_pan_tilt_tells_its_limits_and_the_stations(room: Running) -> None:
    seen = room.get("/pan_tilt").json()
    assert seen["present"]
    assert seen["connected"]
    assert seen["limits"]["pan_min_deg"] < -45.0 < 45.0 < seen["limits"]["pan_max_deg"]
    stations = {station["name"]: station for station in seen["stations"]}
    assert stations["markers"]["target"] == "markers"
    assert stations["markers"]["distance_m"] == 5.0
    assert stations["board"]["target"] == "board"


def test_pan_tilt_does_not_turn_before_it_was_homed(room: Running) -> None:
    refused = room.post("/pan_tilt/moves", {"station": "board"})
    assert (refused.status_code, refused.json()["type"]) == (502, "/problems/device-fault")
    assert "home it" in refused.json()["detail"]
    room.truth.pan_tilt.set_faults(settings=QUICK)
    assert room.post("/pan_tilt/homings").status_code == 200
    assert come_to_rest(room)["homed"]


def test_pan_tilt_turns_to_a_station_and_to_a_bearing(room: Running) -> None:
    assert room.post("/pan_tilt/moves", {"station": "board"}).status_code == 200
    assert come_to_rest(room)["pan_deg"] == pytest.approx(45.0, abs=0.05)
    begun = room.post("/pan_tilt/moves", {"pan_deg": 0.0, "tilt_deg": 0.0}).json()
    assert begun["moving"]
    assert come_to_rest(room)["pan_deg"] == pytest.approx(0.0, abs=0.05)


def test_hold_stops_a_turn_on_its_way(room: Running) -> None:
    room.post("/pan_tilt/moves", {"pan_deg": FAR_DEG, "tilt_deg": 0.0})
    assert room.post("/pan_tilt/holds").status_code == 200
    assert come_to_rest(room)["pan_deg"] > FAR_DEG + 1.0
    room.post("/pan_tilt/moves", {"station": "markers"})
    come_to_rest(room)


def test_stop_holds_the_pan_tilt_and_refuses_to_turn_it(room: Running) -> None:
    room.post("/pan_tilt/moves", {"pan_deg": FAR_DEG, "tilt_deg": 0.0})
    room.post("/stop")
    try:
        assert come_to_rest(room)["pan_deg"] > FAR_DEG + 1.0
        refused = room.post("/pan_tilt/moves", {"station": "markers"})
        assert (refused.status_code, refused.json()["type"]) == (409, "/problems/stopped")
    finally:
        room.http.delete(f"{API}/stop")
    room.post("/pan_tilt/moves", {"station": "markers"})
    come_to_rest(room)


@pytest.mark.parametrize(
    ("body", "status", "message"),
    [
        ({"station": "attic"}, 422, "'markers near'"),
        ({"pan_deg": 500.0, "tilt_deg": 0.0}, 422, "500"),
        ({"pan_deg": 1.0}, 422, "pan_deg and tilt_deg"),
        ({"station": "board", "pan_deg": 1.0, "tilt_deg": 0.0}, 422, "not both"),
        ({"pan_deg": "1", "tilt_deg": 0.0}, 422, "a number"),
    ],
)
def test_turn_that_cannot_be_is_refused_in_words(
    room: Running, body: dict[str, object], status: int, message: str
) -> None:
    answer = room.post("/pan_tilt/moves", body)
    assert answer.status_code == status, answer.text
    assert message in answer.json()["detail"]


def test_session_is_kept_listed_and_deleted(room: Running) -> None:
    session = new_session(room, "spring")
    assert session["label"] == "spring"
    assert session["wide"] is None
    assert session["sweeps"] == []
    assert session["running"] is None
    assert room.get("/calibration_sessions").json()[0]["id"] == session["id"]
    assert room.get(f"/calibration_sessions/{session['id']}").json() == session
    assert room.http.delete(f"{API}/calibration_sessions/{session['id']}").status_code == 204
    assert room.get(f"/calibration_sessions/{session['id']}").status_code == 404


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ({"step": "dance"}, "step"),
        ({"step": "mirrors", "options": {"nodes": [2, 9]}}, "nodes"),
        ({"step": "mirrors", "options": {"stations": ["attic"]}}, "'markers near'"),
        ({"step": "mirrors", "options": {"stations": ["board"]}}, "no markers"),
        ({"step": "mirrors", "options": {"extent_ax_deg": 40.0}}, "extent_ax_deg"),
        ({"step": "wide", "options": {"board": {"columns": 9, "rows": 6}}}, "square_mm"),
        ({"step": "fit", "options": {"order": 0}}, "order"),
        ({"step": "settle", "options": {"fast": True}}, "fast"),
    ],
)
def test_step_that_cannot_be_is_refused_in_words(
    room: Running, body: dict[str, object], message: str
) -> None:
    session = new_session(room)
    answer = room.post(f"/calibration_sessions/{session['id']}/runs", body)
    assert answer.status_code == 422, answer.text
    assert message in answer.json()["detail"]


def test_step_in_no_session_is_not_found(room: Running) -> None:
    assert room.post("/calibration_sessions/ses-0/runs", {"step": "fit"}).status_code == 404


def test_measured_settle_time_is_put_in_use_and_the_rig_files_comes_back(room: Running) -> None:
    session = store_session(room.services.settings.data)
    store_settle(session, settle_us=11_200)
    before = room.get("/settle_time").json()
    assert (before["settle_us"], before["source"], before["measured"]) == (14_000, "rig file", None)

    put = room.http.put(f"{API}/settle_time", json={"session_id": session.id})

    assert put.status_code == 200, put.text
    assert put.json()["measured"]["session_id"] == session.id
    assert (put.json()["settle_us"], put.json()["source"]) == (11_200, "measured 2026-02-01")
    assert room.rig.settle_us == 11_200
    assert room.get(f"/calibration_sessions/{session.id}").json()["settle"]["applied"]
    for _ in range(2):
        assert room.http.delete(f"{API}/settle_time").json() == before
    assert room.rig.settle_us == 14_000
    assert not room.get(f"/calibration_sessions/{session.id}").json()["settle"]["applied"]


def test_settle_time_that_does_not_hold_for_this_rig_is_not_put_in_use(room: Running) -> None:
    def refused(session_id: str) -> tuple[int, str]:
        answer = room.http.put(f"{API}/settle_time", json={"session_id": session_id})
        return answer.status_code, answer.json()["detail"]

    assert refused("ses-0")[0] == 404
    session = store_session(room.services.settings.data)
    assert refused(session.id) == (
        409,
        f"session {session.id} has not measured how the mirrors settle; run the step settle first",
    )
    store_settle(session, settle_us=3_000, low_pass_hz=600)
    status, message = refused(session.id)
    assert status == 409
    assert "drive filter of 600 Hz, now it is 120 Hz" in message
    assert room.get("/settle_time").json()["source"] == "rig file"


def test_picture_that_was_not_drawn_yet_is_not_found(room: Running) -> None:
    session = new_session(room)
    answer = room.get(f"/calibration_sessions/{session['id']}/pictures/loo.png")
    assert answer.status_code == 404


def test_calibration_leaves_as_a_file_and_comes_back_the_same(room: Running) -> None:
    current = room.get("/calibrations/current").json()
    assert current["current"]
    assert current["health"]["verdict"] == "unknown"
    file = room.get(f"/calibrations/{current['id']}/file")
    assert "attachment" in file.headers["content-disposition"]
    back = room.post("/calibrations/import", file.json())
    assert back.status_code == 201, back.text
    assert back.json()["id"] == current["id"]


def test_imported_calibration_comes_into_force_when_asked_and_everything_follows(room: Running) -> None:
    before = room.get("/calibrations/current").json()
    document = room.get(f"/calibrations/{before['id']}/file").json()
    changed = relabelled(document, "from elsewhere", shrunk=True)
    imported = room.post("/calibrations/import", changed).json()
    assert room.get("/calibrations/current").json()["id"] == before["id"]
    gaze = room.get("/mirrors").json()["left"]["ax_deg"]
    since = room.last_event
    activated = room.post(f"/calibrations/{imported['id']}/activate")
    try:
        assert activated.json()["current"]
        assert room.wait_for_event("rig.calibration", after=since)["id"] == imported["id"]
        rig = room.get("/rig").json()
        assert rig["calibration"]["label"] == "from elsewhere"
        assert room.get("/mirrors").json()["left"]["ax_deg"] == pytest.approx(gaze + 1.0, abs=1e-3)
        listed = {known["id"]: known["current"] for known in room.get("/calibrations").json()}
        assert listed[imported["id"]]
        assert not listed[before["id"]]
    finally:
        room.post(f"/calibrations/{before['id']}/activate")


def test_discarded_calibration_is_in_the_trash_and_comes_back(room: Running) -> None:
    before = room.get("/calibrations/current").json()
    document = room.get(f"/calibrations/{before['id']}/file").json()
    kept = room.post("/calibrations/import", relabelled(document, "to be discarded", shrunk=True)).json()
    path = f"/calibrations/{kept['id']}"
    assert (before["kept"], kept["kept"]) == (False, True)
    assert room.http.delete(f"{API}{path}").status_code == 204
    assert room.get(path).status_code == 404
    assert kept["id"] not in [known["id"] for known in room.get("/calibrations").json()]
    assert [known["id"] for known in room.get("/calibrations", removed="true").json()] == [kept["id"]]
    assert room.http.delete(f"{API}{path}").status_code == 404
    assert room.post(f"{path}/restore").json()["label"] == "to be discarded"
    assert room.post(f"{path}/restore").status_code == 404
    assert room.get(path).json()["current"] is False
    refused = room.http.delete(f"{API}/calibrations/{before['id']}")
    assert (refused.status_code, refused.json()["found"]) == (409, "it is in force")
    activated = room.post(f"{path}/activate")
    try:
        assert activated.status_code == 200
        shipped = room.http.delete(f"{API}/calibrations/{before['id']}")
        assert (shipped.status_code, shipped.json()["found"]) == (422, "it is not in the data directory")
    finally:
        room.post(f"/calibrations/{before['id']}/activate")


def test_sessions_are_put_together_by_their_ids(room: Running) -> None:
    made = [room.post("/calibration_sessions", {"label": name}).json()["id"] for name in ("one", "two")]
    refused = room.post("/calibration_sessions/combined", {"sessions": made})
    assert (refused.status_code, "no sweep was given" in refused.json()["detail"]) == (422, True)
    few = room.post("/calibration_sessions/combined", {"sessions": made[:1]})
    assert few.json()["detail"] == "sessions is a list of 1; needed is a list no shorter than 2."
    for session in made:
        room.http.delete(f"{API}/calibration_sessions/{session}")


def relabelled(document: dict[str, Any], label: str, *, shrunk: bool) -> dict[str, Any]:
    """Return a calibration's file under another label, its left eye a degree further right."""
    from foveacam_pipeline.models.content import content_id

    content = json.loads(json.dumps(document["calibration"]))
    content["label"] = label
    if shrunk:
        content["left"]["mirror"]["forward"]["coefficients"][0][0] += 3.141592653589793 / 180.0
    return {**document, "calibration": content, "hash": content_id(content)}


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ({}, "foveacam-calibration"),
        ({"schema": "fovea-calibration-record@1"}, "device bundle"),
        ({"format": "foveacam-calibration", "version": 99}, "version 99"),
        ({"format": "foveacam-calibration", "version": 2, "hash": "0", "calibration": {}}, "rig_id"),
    ],
)
def test_file_that_is_no_calibration_is_refused(room: Running, body: dict[str, object], message: str) -> None:
    answer = room.post("/calibrations/import", body)
    assert answer.status_code == 422, answer.text
    assert message in answer.json()["detail"]


def test_calibration_of_another_rig_is_refused_naming_both(room: Running) -> None:
    other = (
        Path(__file__).parents[3]
        / "server/foveacam_server/resources/calibrating/calibrations/shipped/sim-paper.json"
    )
    answer = room.post("/calibrations/import", json.loads(other.read_text()))
    assert answer.status_code == 409
    assert "sim-paper" in answer.json()["detail"]


def test_report_is_a_page_that_needs_nothing_else(room: Running) -> None:
    current = room.get("/calibrations/current").json()["id"]
    answer = room.get(f"/calibrations/{current}/report")
    assert answer.headers["content-type"].startswith("text/html")
    assert current in answer.text
    assert "src=" not in answer.text.replace('src="data:', "")


def test_authors_file_of_a_calibration_without_its_poses_is_refused(room: Running) -> None:
    current = room.get("/calibrations/current").json()["id"]
    answer = room.get(f"/calibrations/{current}/file", format="authors")
    assert answer.status_code == 422
    assert "format foveacam" in answer.json()["remedy"]


def test_unknown_calibration_cannot_be_put_in_force(room: Running) -> None:
    assert room.post("/calibrations/0123456789abcdef/activate").status_code == 404
    assert room.get("/calibrations/compare", a="0", b="1").status_code == 404


def test_calibration_differs_from_itself_by_nothing(room: Running) -> None:
    current = room.get("/calibrations/current").json()["id"]
    found = room.get("/calibrations/compare", a=current, b=current).json()
    assert found["pointing_difference_px"]["max"] == pytest.approx(0.0, abs=1e-6)
    assert room.http.get(found["picture_url"]).content.startswith(b"\x89PNG")


def test_views_of_a_calibration_are_absent_until_it_shows_something(room: Running) -> None:
    assert "calibration_wide" not in [view["name"] for view in room.get("/views").json()]
    assert room.get("/views/calibration_wide/snapshot.jpg").status_code == 503


def test_drift_check_that_does_not_exist_is_not_found(room: Running) -> None:
    assert room.get("/drift_checks").json() == []
    assert room.get("/drift_checks/0123abcd").status_code == 404
    assert room.get("/drift_checks/trend.png").status_code == 404
    assert room.post("/drift_checks", {"distance_m": 0.1}).status_code == 422
