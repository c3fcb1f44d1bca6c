"""Steps of a calibration as jobs on the simulated rig: what they measure, show and tell, and how they end."""

import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from foveacam_hardware.sim.render import warm_up
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.calibrate.watcher import Nobody
from foveacam_pipeline.models import Calibration
from foveacam_server.calibrate_command.rig import workplace_of
from foveacam_server.calibrating.options import WideOptions
from foveacam_server.calibrating.sessions import SessionShelf
from foveacam_server.calibrating.wide_step import measure_wide

from .conftest import API, Running, running

pytestmark = pytest.mark.timeout(300)

PATIENCE_S = 200.0
VIEWS = 7


@dataclass(frozen=True)
class Measured:
    """A session that was begun on the same rig in virtual time: its wide camera is known."""

    data: Path
    session_id: str


class Silent(Nobody):
    """Watches a step without a word."""

    def stage(self, name: str) -> None:
        """Ignore it."""

    def sample(self, sample_id: str) -> None:
        """Ignore it."""

    def pose(self, station: str, *, index: int, left: str, right: str) -> None:
        """Ignore it."""

    def fitted(self, calibration: Calibration) -> None:
        """Ignore it."""


@pytest.fixture(scope="module")
def begun(tmp_path_factory: pytest.TempPathFactory) -> Measured:
    """Stage 1 in virtual time: however busy this machine is, the board is held long enough to be seen."""
    data = tmp_path_factory.mktemp("data")
    warm_up()
    with open_simulated("calibration", inline=True) as rig:
        shelf = SessionShelf(data / "calibrations" / "sessions")
        session = shelf.create(label="spring", rig_id=rig.rig_id, baseline_m=rig.baseline_m)
        measure_wide(session, WideOptions(views=VIEWS), workplace=workplace_of(rig), watch=Silent())
    return Measured(data, session.id)


@pytest.fixture(scope="module")
def room(begun: Measured) -> Iterator[Running]:
    """A server whose rig stands in the room to calibrate in."""
    with running(begun.data, scene="calibration") as found:
        yield found


@pytest.fixture
def measured(begun: Measured) -> str:
    """The session whose wide camera is known; its id."""
    return begun.session_id


def begin(room: Running, session_id: str, step: str, **options: object) -> dict[str, Any]:
    answer = room.post(f"/calibration_sessions/{session_id}/runs", {"step": step, "options": options})
    assert answer.status_code == 202, answer.text
    job: dict[str, Any] = answer.json()
    assert answer.headers["Location"] == f"{API}/jobs/{job['id']}"
    return job


def ended(room: Running, job: dict[str, Any]) -> dict[str, Any]:
    waiting = threading.Event()
    for _ in range(round(PATIENCE_S / 0.2)):
        found: dict[str, Any] = room.get(f"/jobs/{job['id']}").json()
        if found["ended_utc"] is not None:
            return found
        waiting.wait(0.2)
    raise AssertionError(f"{job['kind']} did not end: {found}")


def session_of(room: Running, session_id: str) -> dict[str, Any]:
    found: dict[str, Any] = room.get(f"/calibration_sessions/{session_id}").json()
    return found


def test_wide_step_finds_the_lens_of_the_rig(room: Running, measured: str) -> None:
    session = session_of(room, measured)
    wide, lens = session["wide"], room.get("/calibrations/current").json()["wide"]
    assert session["board"]["kind"] == "charuco"
    assert len(wide["samples"]) == VIEWS
    assert 0.0 < wide["coverage_fraction"] <= 1.0
    cells = [count for row in wide["cells"] for count in row]
    covered = sum(count > 0 for count in cells) / len(cells)
    assert covered == pytest.approx(wide["coverage_fraction"], abs=1e-4)
    assert wide["fit"]["rms_px"] < 0.1  # corners are found to 0.01 px; the room is noisy
    assert wide["fit"]["fx_px"] == pytest.approx(lens["fx_px"], rel=3e-3)  # seven views of a near board
    assert session["running"] is None
    assert session["problems"] == []


def test_views_of_the_board_can_be_looked_at_and_taken_out(room: Running, measured: str) -> None:
    before = session_of(room, measured)["wide"]["samples"]
    assert room.http.get(before[0]["thumbnail_url"]).content.startswith(b"\xff\xd8")
    url = f"{API}/calibration_sessions/{measured}/wide_samples/{before[0]['id']}"
    left = room.http.delete(url)
    assert left.status_code == 200, left.text
    assert [sample["id"] for sample in left.json()["wide"]["samples"]] == [
        sample["id"] for sample in before[1:]
    ]
    assert left.json()["wide"]["fit"] is not None
    assert room.http.delete(url).status_code == 404


def test_pictures_of_the_wide_step_are_there(room: Running, measured: str) -> None:
    pictures = {picture["name"]: picture["url"] for picture in session_of(room, measured)["pictures"]}
    for name in ("coverage", "wide_residuals"):
        assert room.http.get(pictures[name]).content.startswith(b"\x89PNG")


def test_views_of_the_board_are_taken_until_that_is_cancelled(room: Running) -> None:
    session_id = room.post("/calibration_sessions", {"label": "autumn"}).json()["id"]
    before = room.last_event
    job = begin(room, session_id, "wide", views=40)
    first = room.wait_for_event("calibration.progress", after=before)
    assert (first["session_id"], first["step"]) == (session_id, "wide")
    while "calibration_wide" not in [view["name"] for view in room.get("/views").json()]:
        assert room.get(f"/jobs/{job['id']}").json()["ended_utc"] is None
    assert room.get("/views/calibration_wide/snapshot.jpg").status_code == 200
    room.post(f"/jobs/{job['id']}/cancel")
    assert ended(room, job)["state"] == "cancelled"
    assert session_of(room, session_id)["running"] is None


def test_cancelled_sweep_goes_on_where_it_ended(room: Running, measured: str) -> None:
    before = room.last_event
    job = begin(room, measured, "mirrors", stations=["markers"], nodes=[3, 3])
    assert session_of(room, measured)["running"] == job["id"]
    busy = room.http.delete(f"{API}/calibration_sessions/{measured}")
    assert (busy.status_code, busy.json()["type"]) == (409, "/problems/busy")
    first = room.wait_for_event("calibration.pose", after=before)
    assert (first["session_id"], first["station"]) == (measured, "markers")
    assert {first["left"], first["right"]} <= {"centred", "rim", "refused"}
    room.post(f"/jobs/{job['id']}/cancel")
    assert ended(room, job)["state"] == "cancelled"
    kept = session_of(room, measured)["sweeps"][0]["done"]
    assert 1 <= kept < 9
    again = ended(room, begin(room, measured, "mirrors", stations=["markers"]))
    assert again["state"] == "succeeded", again["problem"]
    sweep = session_of(room, measured)["sweeps"][0]
    assert (sweep["nodes"], sweep["done"], sweep["distance_m"]) == (9, 9, 5.0)
    assert all(pose["left"] in ("centred", "rim") for pose in sweep["poses"])


def test_fit_of_too_few_poses_is_refused_and_says_how_many_are_needed(room: Running, measured: str) -> None:
    answer = room.post(
        f"/calibration_sessions/{measured}/runs", {"step": "fit", "options": {}}, Prefer="wait=60"
    )
    assert answer.status_code == 422, answer.text
    assert "at least" in answer.json()["detail"]
    assert session_of(room, measured)["fit"] is None
    assert session_of(room, measured)["calibrations"] == []


def test_stop_ends_a_step_and_holds_the_rig(room: Running, measured: str) -> None:
    job = begin(room, measured, "mirrors", stations=["markers near"], nodes=[3, 3])
    room.post("/stop")
    try:
        assert ended(room, job)["state"] == "cancelled"
        refused = room.post(f"/calibration_sessions/{measured}/runs", {"step": "wide"})
        assert (refused.status_code, refused.json()["type"]) == (409, "/problems/stopped")
    finally:
        room.http.delete(f"{API}/stop")


def test_sweep_before_the_wide_camera_is_known_says_what_comes_first(room: Running) -> None:
    session_id = room.post("/calibration_sessions", {"label": "empty"}).json()["id"]
    answer = room.post(f"/calibration_sessions/{session_id}/runs", {"step": "mirrors"}, Prefer="wait=60")
    assert (answer.status_code, answer.json()["type"]) == (409, "/problems/not-calibrated")
    assert "step wide first" in answer.json()["detail"]
