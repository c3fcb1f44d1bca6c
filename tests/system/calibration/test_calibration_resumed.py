"""A calibration over REST from what was measured before: fitted, checked, activated, cancelled, resumed."""

import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from foveacam_pipeline.calibrate.sweep.sweep import sweep_filename
from foveacam_pipeline.calibrate.sweep.sweep_file import load_sweep
from foveacam_server.resources.calibrating.sessions import fit_step
from foveacam_server.rig.settle_times import SettleTime
from tests.support.servers.calibration_server import CalibrationServer, calibration_server
from tests.support.servers.running_server import API
from tests.support.servers.stored_session import RIG, store_session

pytestmark = pytest.mark.timeout(300)

SOON_S = 5.0
"""Of computing: the fit is loaded and begun, and a cancel takes effect within a second."""
SIDE = 6
STORED = 6
"""Poses of nine that a sweep held before."""


@pytest.fixture(scope="module")
def calibrating(tmp_path_factory: pytest.TempPathFactory) -> Iterator[CalibrationServer]:
    with (
        calibration_server(tmp_path_factory.mktemp("calibrating"), plain=False) as found,
        pytest.MonkeyPatch.context() as patch,
    ):
        patch.setattr(fit_step, "draw_png", lambda _session, name, _make: name.encode())
        yield found


@pytest.fixture(scope="module")
def swept_session(calibrating: CalibrationServer) -> str:
    """A session that was swept at both stations; its id."""
    return store_session(calibrating.data, stations=calibrating.stations, side=SIDE).id


def known_ids(calibrating: CalibrationServer) -> list[str]:
    return [known["id"] for known in calibrating.server.get("/calibrations").json()]


def test_cancelled_fit_ends_soon_and_leaves_nothing(
    calibrating: CalibrationServer, swept_session: str
) -> None:
    before = known_ids(calibrating)
    began_s = time.process_time()
    calibrating.cancelled(swept_session, "fit", "calibration.progress", at_step="fit")
    assert time.process_time() - began_s < SOON_S
    session = calibrating.session(swept_session)
    assert (session["fit"], session["calibrations"], session["pictures"]) == (None, [], [])
    assert known_ids(calibrating) == before


def test_whole_calibration_goes_on_after_a_cancel_with_what_is_missing(
    calibrating: CalibrationServer, swept_session: str
) -> None:
    shipped = calibrating.server.get("/calibrations/current").json()["id"]
    everything = {
        "fit": {"label": "stored", "compare": False},
        "check": {"poses": 6},
        "settle": False,
        "activate": True,
    }
    before = calibrating.server.last_event
    calibrating.cancelled(swept_session, "all", "calibration.progress", at_step="check", **everything)
    fitted = calibrating.session(swept_session)
    assert {model["eye"] for model in fitted["fit"]["models"] if model["chosen"]} == {"left", "right"}
    assert fitted["check"] is None
    assert calibrating.server.get("/calibrations/current").json()["id"] == shipped

    whole = calibrating.done(swept_session, "all", **everything)

    assert whole["fit"] == fitted["fit"]
    assert {"loo", "quiver_left", "warp_right"} < {picture["name"] for picture in whole["pictures"]}
    assert whole["check"]["calibration_id"] == whole["calibrations"][-1]
    assert whole["check"]["epipolar_rms_px"] < 5.0  # few poses decide
    current = calibrating.server.get("/calibrations/current").json()
    assert current["id"] == whole["calibrations"][-1]
    assert current["label"].startswith("stored")
    steps = {
        (event.data["step"], event.data["note"])
        for event in calibrating.server.services.events.recent(1000)
        if event.id > before and event.kind == "calibration.progress"
    }
    assert {step for step, note in steps if "complete already" in note} == {"wide", "mirrors", "fit"}
    assert all("complete already" in note for step, note in steps if step in ("wide", "mirrors"))
    calibrating.server.post(f"/calibrations/{shipped}/activate")


def test_cancelled_check_leaves_the_one_before(calibrating: CalibrationServer, swept_session: str) -> None:
    before = calibrating.session(swept_session)["check"]
    calibrating.cancelled(swept_session, "check", "calibration.progress", at_step="check", poses=100)
    assert calibrating.session(swept_session)["check"] == before


def test_cancelled_settle_step_exposes_as_before_and_changes_nothing(calibrating: CalibrationServer) -> None:
    session_id = store_session(calibrating.data).id
    rig = calibrating.server.rig
    before = rig.left.settings, rig.right.settings, rig.settle_us
    calibrating.cancelled(session_id, "settle", "calibration.progress", at_step="settle", apply=True)
    assert (rig.left.settings, rig.right.settings, rig.settle_us) == before
    assert calibrating.server.services.settling.source == "rig file"
    assert calibrating.session(session_id)["settle"] is None


def test_half_a_sweep_goes_on_after_a_restart_and_so_does_the_settle_time(tmp_path: Path) -> None:
    with calibration_server(tmp_path) as calibrating:
        far = calibrating.stations[0]
        session = store_session(calibrating.data, stations=[far], field_deg=6.0, poses=STORED)
        before = calibrating.server.last_event
        with calibrating.held_at("calibration.pose"):
            calibrating.begin(session.id, "mirrors", stations=[far.name])
            calibrating.server.wait_for_event("calibration.pose", after=before)
            assert calibrating.server.get("/rig").json()["trigger"]["settle_source"] == "rig file"
            calibrating.server.services.settling.apply(SETTLED, calibrating.server.services.hardware)
    kept = load_sweep(session.folder / sweep_filename(far))
    assert STORED < len(kept.poses) < 9
    with calibration_server(tmp_path) as calibrating:
        trigger = calibrating.server.get("/rig").json()["trigger"]
        assert (trigger["settle_us"], trigger["settle_source"]) == (12_000, "measured 2026-02-01")
        # 12 ms to settle, 8 ms of exposure (a frame takes 4.4 ms), half a millisecond
        assert trigger["interval_ms"] == pytest.approx(20.5, abs=0.01)
        assert trigger["rate_hz"] == pytest.approx(1e3 / 20.5, abs=0.05)
        assert calibrating.server.http.get(f"{API}/jobs").json()[0]["state"] in ("cancelled", "failed")
        calibrating.cancelled(session.id, "mirrors", "calibration.pose", stations=[far.name])
        sweep = calibrating.session(session.id)["sweeps"][0]
        assert (sweep["done"] > len(kept.poses), sweep["nodes"]) == (True, 9)
    times_ns = [pose.t_ns for pose in load_sweep(session.folder / sweep_filename(far)).poses]
    assert times_ns[: len(kept.poses)] == [pose.t_ns for pose in kept.poses]


SETTLED = SettleTime(
    rig_id=RIG,
    settle_us=12_000,
    measured_utc="2026-02-01T10:00:00Z",
    session_id="ses-0",
    low_pass_hz=120,
)
