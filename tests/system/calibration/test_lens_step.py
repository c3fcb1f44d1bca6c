"""The step lens as a job on the simulated rig: its result, its views by REST, and what it refuses."""

from collections.abc import Iterator
from typing import Any

import pytest

from tests.system.conftest import API, Running

from .calibration_server import CalibrationServer, calibration_server

pytestmark = pytest.mark.timeout(300)

VIEWS = 4


@pytest.fixture(scope="module")
def calibrating(tmp_path_factory: pytest.TempPathFactory) -> Iterator[CalibrationServer]:
    with calibration_server(tmp_path_factory.mktemp("lens")) as found:
        yield found


@pytest.fixture(scope="module")
def session_id(calibrating: CalibrationServer) -> str:
    """A session in which the left fovea's lens was found."""
    created: dict[str, Any] = calibrating.server.post("/calibration_sessions", {"label": "lens"}).json()
    calibrating.done(created["id"], "lens", camera="left", views=VIEWS)
    found: str = created["id"]
    return found


def lens_of(calibrating: CalibrationServer, session_id: str) -> dict[str, Any]:
    (lens,) = calibrating.session(session_id)["lenses"]
    found: dict[str, Any] = lens
    return found


def test_step_lens_finds_the_lens_of_a_fovea_and_changes_no_calibration(
    calibrating: CalibrationServer, session_id: str
) -> None:
    session, lens = calibrating.session(session_id), lens_of(calibrating, session_id)
    parameters = {each["name"]: each for each in lens["fit"]["parameters"]}
    assert lens["camera"] == "left"
    assert lens["board"]["square_mm"] == 12.0
    assert len(lens["samples"]) == VIEWS
    assert abs(parameters["fx_px"]["value"] - 28_760.0) < max(3.0 * parameters["fx_px"]["sigma"], 60.0)
    assert lens["fit"]["fov_x_deg"] == pytest.approx(2.868, abs=0.01)
    assert parameters["k3"]["assumed"]
    assert "assumed: " in lens["reason"]
    assert (session["wide"], session["calibrations"], session["problems"]) == (None, [], [])


def test_views_of_a_fovea_can_be_looked_at_and_taken_out(
    calibrating: CalibrationServer, session_id: str
) -> None:
    server: Running = calibrating.server
    before = lens_of(calibrating, session_id)["samples"]
    pictures = {picture["name"]: picture["url"] for picture in calibrating.session(session_id)["pictures"]}
    assert server.http.get(before[0]["thumbnail_url"]).content.startswith(b"\xff\xd8")
    assert server.http.get(pictures["lens_left"]).content.startswith(b"\x89PNG")

    url = f"{API}/calibration_sessions/{session_id}/lenses/left/samples/{before[0]['id']}"
    left = server.http.delete(url)
    assert left.status_code == 200, left.text
    assert len(left.json()["lenses"][0]["samples"]) == VIEWS - 1
    assert left.json()["lenses"][0]["fit"] is not None
    assert server.http.delete(url).status_code == 404
    assert server.http.delete(url.replace("/left/", "/right/")).status_code == 404
    assert server.http.delete(url.replace("/left/", "/wide/")).status_code == 422

    second = left.json()["lenses"][0]["samples"][0]["id"]
    few = server.http.delete(url.replace(before[0]["id"], second)).json()["lenses"][0]
    assert few["fit"] is None
    assert "at least 3 are needed" in few["reason"]


def test_a_step_without_camera_is_refused(calibrating: CalibrationServer, session_id: str) -> None:
    path = f"/calibration_sessions/{session_id}/runs"
    for options in ({}, {"camera": "wide"}):
        assert calibrating.server.post(path, {"step": "lens", "options": options}).status_code == 422
