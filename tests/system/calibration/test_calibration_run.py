"""Steps of a calibration as jobs on the simulated rig: what they measure, show and tell, and how they end."""

from collections.abc import Iterator
from typing import Any

import pytest

from foveacam_server.resources.calibrating.sessions.sessions import SessionCollection
from tests.support.servers.calibration_server import CalibrationServer, calibration_server
from tests.support.servers.running_server import API, Running
from tests.support.servers.stored_session import store_sweep

pytestmark = pytest.mark.timeout(300)

VIEWS, LENS_VIEWS, STORED = 6, 4, 7
"""Views of the board to take by the wide camera and by a fovea; poses of nine that a sweep held before."""


@pytest.fixture(scope="module")
def calibrating(tmp_path_factory: pytest.TempPathFactory) -> Iterator[CalibrationServer]:
    with calibration_server(tmp_path_factory.mktemp("calibrating")) as found:
        yield found


@pytest.fixture(scope="module")
def server(calibrating: CalibrationServer) -> Running:
    """A server whose rig stands in the room to calibrate in."""
    return calibrating.server


@pytest.fixture(scope="module")
def measured(calibrating: CalibrationServer) -> str:
    """A session whose wide camera was measured from nothing; its id."""
    session_id: str = new_session(calibrating.server, "spring")["id"]
    calibrating.done(session_id, "wide", views=VIEWS)
    return session_id


def new_session(server: Running, label: str) -> dict[str, Any]:  # Any: a JSON document
    found: dict[str, Any] = server.post("/calibration_sessions", {"label": label}).json()
    return found


def test_wide_step_finds_the_lens_of_the_rig(
    calibrating: CalibrationServer, server: Running, measured: str
) -> None:
    session = calibrating.session(measured)
    wide, lens = session["wide"], server.get("/calibrations/current").json()["wide"]
    assert session["board"]["kind"] == "charuco"
    assert len(wide["samples"]) == VIEWS
    assert 0.0 < wide["coverage_fraction"] <= 1.0
    cells = [count for row in wide["cells"] for count in row]
    covered = sum(count > 0 for count in cells) / len(cells)
    assert covered == pytest.approx(wide["coverage_fraction"], abs=1e-4)
    assert wide["fit"]["rms_px"] < 0.1  # corners are found to 0.01 px; the room is noisy
    assert wide["fit"]["fx_px"] == pytest.approx(lens["fx_px"], rel=3e-3)  # few views of a near board
    assert session["running"] is None
    assert session["problems"] == []


def test_views_of_the_board_can_be_looked_at_and_taken_out(
    calibrating: CalibrationServer, server: Running, measured: str
) -> None:
    before = calibrating.session(measured)["wide"]["samples"]
    assert server.http.get(before[0]["thumbnail_url"]).content.startswith(b"\xff\xd8")
    url = f"{API}/calibration_sessions/{measured}/wide_samples/{before[0]['id']}"
    left = server.http.delete(url)
    assert left.status_code == 200, left.text
    assert [sample["id"] for sample in left.json()["wide"]["samples"]] == [
        sample["id"] for sample in before[1:]
    ]
    assert left.json()["wide"]["fit"] is not None
    assert server.http.delete(url).status_code == 404


def test_pictures_of_the_wide_step_are_there(
    calibrating: CalibrationServer, server: Running, measured: str
) -> None:
    pictures = {picture["name"]: picture["url"] for picture in calibrating.session(measured)["pictures"]}
    for name in ("coverage", "wide_residuals"):
        assert server.http.get(pictures[name]).content.startswith(b"\x89PNG")


def test_views_of_the_board_are_taken_until_that_is_cancelled(
    calibrating: CalibrationServer, server: Running
) -> None:
    session_id = new_session(server, "autumn")["id"]
    first = calibrating.cancelled(session_id, "wide", "calibration.sample", views=40)
    assert first["session_id"] == session_id
    assert len(calibrating.session(session_id)["wide"]["samples"]) == 1
    assert "calibration_wide" in [view["name"] for view in server.get("/views").json()]
    assert server.get("/views/calibration_wide/snapshot.jpg").status_code == 200
    assert calibrating.session(session_id)["running"] is None


def test_cancelled_sweep_goes_on_where_it_ended(
    calibrating: CalibrationServer, server: Running, measured: str
) -> None:
    session = SessionCollection(calibrating.data / "calibrations" / "sessions").get(measured)
    store_sweep(session, calibrating.stations[0], field_deg=6.0, poses=STORED)
    before = server.last_event
    with calibrating.held_at("calibration.pose"):
        job = calibrating.begin(measured, "mirrors", stations=["markers"])
        first = server.wait_for_event("calibration.pose", after=before)
        assert calibrating.session(measured)["running"] == job["id"]
        busy = server.http.delete(f"{API}/calibration_sessions/{measured}")
        assert (busy.status_code, busy.json()["type"]) == (409, "/problems/busy")
        server.post(f"/jobs/{job['id']}/cancel")
    assert (first["session_id"], first["station"]) == (measured, "markers")
    assert {first["left"], first["right"]} <= {"centred", "rim", "refused"}
    assert calibrating.ended(job)["state"] == "cancelled"
    kept = calibrating.session(measured)["sweeps"][0]["done"]
    assert STORED < kept < 9
    again = calibrating.ended(calibrating.begin(measured, "mirrors", stations=["markers"]))
    assert again["state"] == "succeeded", again["problem"]
    sweep = calibrating.session(measured)["sweeps"][0]
    assert (sweep["nodes"], sweep["done"], sweep["distance_m"]) == (9, 9, 5.0)
    assert all(pose["left"] in ("centred", "rim") for pose in sweep["poses"])


def test_fit_of_too_few_poses_is_refused_and_says_how_many_are_needed(
    calibrating: CalibrationServer, server: Running, measured: str
) -> None:
    answer = server.post(
        f"/calibration_sessions/{measured}/runs", {"step": "fit", "options": {}}, Prefer="wait=60"
    )
    assert answer.status_code == 422, answer.text
    assert "at least" in answer.json()["detail"]
    assert calibrating.session(measured)["fit"] is None
    assert calibrating.session(measured)["calibrations"] == []


def test_stop_ends_a_step_and_holds_the_rig(
    calibrating: CalibrationServer, server: Running, measured: str
) -> None:
    job = calibrating.begin(measured, "mirrors", stations=["markers near"], nodes=[3, 3])
    server.post("/stop")
    try:
        assert calibrating.ended(job)["state"] == "cancelled"
        refused = server.post(f"/calibration_sessions/{measured}/runs", {"step": "wide"})
        assert (refused.status_code, refused.json()["type"]) == (409, "/problems/stopped")
    finally:
        server.http.delete(f"{API}/stop")


def test_sweep_before_the_wide_camera_is_known_says_what_comes_first(
    calibrating: CalibrationServer, server: Running
) -> None:
    session_id = new_session(server, "empty")["id"]
    answer = server.post(f"/calibration_sessions/{session_id}/runs", {"step": "mirrors"}, Prefer="wait=60")
    assert (answer.status_code, answer.json()["type"]) == (409, "/problems/not-calibrated")
    assert "step wide first" in answer.json()["detail"]


@pytest.fixture(scope="module")
def lens_session(calibrating: CalibrationServer) -> str:
    """A session in which the left fovea's lens was found; its id."""
    session_id: str = new_session(calibrating.server, "lens")["id"]
    calibrating.done(session_id, "lens", camera="left", views=LENS_VIEWS)
    return session_id


def lens_of(calibrating: CalibrationServer, session_id: str) -> dict[str, Any]:
    (lens,) = calibrating.session(session_id)["lenses"]
    found: dict[str, Any] = lens
    return found


def test_step_lens_finds_the_lens_of_a_fovea_and_changes_no_calibration(
    calibrating: CalibrationServer, lens_session: str
) -> None:
    session, lens = calibrating.session(lens_session), lens_of(calibrating, lens_session)
    parameters = {each["name"]: each for each in lens["fit"]["parameters"]}
    assert lens["camera"] == "left"
    assert lens["board"]["square_mm"] == 12.0
    assert len(lens["samples"]) == LENS_VIEWS
    assert abs(parameters["fx_px"]["value"] - 28_760.0) < max(3.0 * parameters["fx_px"]["sigma"], 60.0)
    assert lens["fit"]["fov_x_deg"] == pytest.approx(2.868, abs=0.01)
    assert parameters["k3"]["assumed"]
    assert "assumed: " in lens["reason"]
    assert (session["wide"], session["calibrations"], session["problems"]) == (None, [], [])


def test_views_of_a_fovea_can_be_looked_at_and_taken_out(
    calibrating: CalibrationServer, lens_session: str
) -> None:
    server: Running = calibrating.server
    before = lens_of(calibrating, lens_session)["samples"]
    pictures = {picture["name"]: picture["url"] for picture in calibrating.session(lens_session)["pictures"]}
    assert server.http.get(before[0]["thumbnail_url"]).content.startswith(b"\xff\xd8")
    assert server.http.get(pictures["lens_left"]).content.startswith(b"\x89PNG")

    url = f"{API}/calibration_sessions/{lens_session}/lenses/left/samples/{before[0]['id']}"
    left = server.http.delete(url)
    assert left.status_code == 200, left.text
    assert len(left.json()["lenses"][0]["samples"]) == LENS_VIEWS - 1
    assert left.json()["lenses"][0]["fit"] is not None
    assert server.http.delete(url).status_code == 404
    assert server.http.delete(url.replace("/left/", "/right/")).status_code == 404
    assert server.http.delete(url.replace("/left/", "/wide/")).status_code == 422

    second = left.json()["lenses"][0]["samples"][0]["id"]
    few = server.http.delete(url.replace(before[0]["id"], second)).json()["lenses"][0]
    assert few["fit"] is None
    assert "at least 3 are needed" in few["reason"]


def test_a_step_without_camera_is_refused(calibrating: CalibrationServer, lens_session: str) -> None:
    path = f"/calibration_sessions/{lens_session}/runs"
    for options in ({}, {"camera": "wide"}):
        assert calibrating.server.post(path, {"step": "lens", "options": options}).status_code == 422
