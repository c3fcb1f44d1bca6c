"""A calibration over REST from what was measured before: fitted, checked, activated, cancelled, resumed."""

import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from foveacam_hardware.contract import Clock, Station, StationTarget, VirtualClock
from foveacam_hardware.rig import Rig
from foveacam_hardware.rig_config import SimulatedRigConfig
from foveacam_hardware.sim.rig import VIRTUAL_START_NS, simulated_rig
from foveacam_pipeline.calibrate.sweep.sweep import sweep_filename
from foveacam_pipeline.calibrate.sweep.sweep_file import load_sweep
from foveacam_server.calibrating.settle_times import SettleTime
from foveacam_server.runtime import opening

from .conftest import API, Running, running
from .stored_session import RIG, store_session

pytestmark = pytest.mark.timeout(300)

PATIENCE_S, PERIOD_S = 200.0, 0.2
SOON_S = 5.0
"""A cancel takes effect within a second of computing; this machine may be busy."""
SIDE = 6

Begin = Callable[..., dict[str, Any]]  # Any: a JSON document


@dataclass
class Desk:
    """A server in the room to calibrate in, and the sessions in its data directory."""

    room: Running
    data: Path

    @property
    def stations(self) -> list[Station]:
        """Where markers stand, the farthest first."""
        return [s for s in self.room.rig.stations if s.target is StationTarget.MARKERS]

    def begin(self, session_id: str, step: str, **options: object) -> dict[str, Any]:
        answer = self.room.post(
            f"/calibration_sessions/{session_id}/runs", {"step": step, "options": options}
        )
        assert answer.status_code == 202, answer.text
        job: dict[str, Any] = answer.json()
        return job

    def ended(self, job: dict[str, Any]) -> dict[str, Any]:
        """Wait for a job to end, for so long and no longer."""
        waiting = threading.Event()
        for _ in range(round(PATIENCE_S / PERIOD_S)):
            found: dict[str, Any] = self.room.get(f"/jobs/{job['id']}").json()
            if found["ended_utc"] is not None:
                return found
            waiting.wait(PERIOD_S)
        raise AssertionError(f"{job['kind']} did not end")

    def done(self, session_id: str, step: str, **options: object) -> dict[str, Any]:
        """Run a step to its end and return the session."""
        job = self.ended(self.begin(session_id, step, **options))
        assert job["state"] == "succeeded", job["problem"]
        return self.session(session_id)

    def session(self, session_id: str) -> dict[str, Any]:
        found: dict[str, Any] = self.room.get(f"/calibration_sessions/{session_id}").json()
        return found

    def cancelled_at_its_first_progress(self, session_id: str, step: str, **options: object) -> float:
        """Cancel a step once it works; return how long it then took to end, seconds."""
        before = self.room.last_event
        job = self.begin(session_id, step, **options)
        told = self.room.wait_for_event("calibration.progress", after=before)
        assert told["step"] == step
        asked_s = time.monotonic()
        self.room.post(f"/jobs/{job['id']}/cancel")
        assert self.ended(job)["state"] == "cancelled"
        return time.monotonic() - asked_s


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Desk]:
    """A server in virtual time: however busy this machine is, the boards are held long enough to be seen."""
    data = tmp_path_factory.mktemp("data")
    clock = VirtualClock(VIRTUAL_START_NS)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(opening, "MonotonicClock", lambda: clock)
        patch.setattr(opening, "open_rig", in_virtual_time)
        with running(data, scene="calibration") as room:
            yield Desk(room, data)


def in_virtual_time(config: SimulatedRigConfig, *, clock: Clock, **_given: object) -> Rig:
    """Open the simulated rig in this process, on a clock that nobody waits for."""
    return simulated_rig(config, clock=clock, inline=True)


@pytest.fixture(scope="module")
def swept_session(desk: Desk) -> str:
    """A session that was swept at both stations; its id."""
    return store_session(desk.data, stations=desk.stations, side=SIDE).id


def known_ids(desk: Desk) -> list[str]:
    return [known["id"] for known in desk.room.get("/calibrations").json()]


def test_cancelled_fit_ends_soon_and_leaves_nothing(desk: Desk, swept_session: str) -> None:
    before = known_ids(desk)
    assert desk.cancelled_at_its_first_progress(swept_session, "fit") < SOON_S
    session = desk.session(swept_session)
    assert (session["fit"], session["calibrations"], session["pictures"]) == (None, [], [])
    assert known_ids(desk) == before


def test_stored_session_is_fitted_checked_and_put_in_force(desk: Desk, swept_session: str) -> None:
    shipped = desk.room.get("/calibrations/current").json()["id"]
    fitted = desk.done(swept_session, "fit", label="stored")
    assert {model["eye"] for model in fitted["fit"]["models"] if model["chosen"]} == {"left", "right"}
    checked = desk.done(swept_session, "check", poses=6)
    assert checked["check"]["calibration_id"] == fitted["calibrations"][-1]
    assert checked["check"]["epipolar_rms_px"] < 5.0  # few poses, and a rig that has drifted since
    assert desk.room.get("/calibrations/current").json()["id"] == shipped
    answer = desk.room.post(f"/calibrations/{fitted['calibrations'][-1]}/activate")
    assert answer.status_code == 200, answer.text
    assert desk.room.get("/calibrations/current").json()["label"] == "stored"
    desk.room.post(f"/calibrations/{shipped}/activate")


def test_cancelled_check_leaves_the_one_before(desk: Desk, swept_session: str) -> None:
    before = desk.session(swept_session)["check"]
    desk.cancelled_at_its_first_progress(swept_session, "check", poses=100)
    assert desk.session(swept_session)["check"] == before


def test_cancelled_settle_step_exposes_as_before_and_changes_nothing(desk: Desk) -> None:
    session_id = store_session(desk.data).id
    rig = desk.room.rig
    before = rig.left.settings, rig.right.settings, rig.settle_us
    desk.cancelled_at_its_first_progress(session_id, "settle", apply=True)
    assert (rig.left.settings, rig.right.settings, rig.settle_us) == before
    assert desk.room.services.settling.source == "rig file"
    assert desk.session(session_id)["settle"] is None


def test_wide_camera_is_measured_from_nothing(desk: Desk) -> None:
    session_id = desk.room.post("/calibration_sessions", {"label": "new"}).json()["id"]
    session = desk.done(session_id, "wide", views=5, model="five")
    assert len(session["wide"]["samples"]) == 5
    assert session["wide"]["fit"]["rms_px"] < 0.1
    assert {"coverage", "wide_residuals"} <= {picture["name"] for picture in session["pictures"]}


def test_half_a_sweep_goes_on_after_a_restart_and_so_does_the_settle_time(tmp_path: Path) -> None:
    with running(tmp_path, scene="calibration") as room:
        desk = Desk(room, tmp_path)
        far = desk.stations[0]
        session = store_session(tmp_path, stations=[far], poses=7)
        before = room.last_event
        desk.begin(session.id, "mirrors", stations=[far.name], nodes=[3, 3])
        room.wait_for_event("calibration.pose", after=before)
        assert room.get("/rig").json()["trigger"]["settle_source"] == "rig file"
        room.services.settling.apply(SETTLED, room.services.hardware)
    kept = load_sweep(session.folder / sweep_filename(far))
    assert len(kept.poses) + len(kept.repeats) > 7
    with running(tmp_path, scene="calibration") as room:
        desk = Desk(room, tmp_path)
        trigger = room.get("/rig").json()["trigger"]
        assert (trigger["settle_us"], trigger["settle_source"]) == (12_000, "measured 2026-02-01")
        # 12 ms to settle, 8 ms of exposure (a frame takes 4.4 ms), half a millisecond
        assert trigger["interval_ms"] == pytest.approx(20.5, abs=0.01)
        assert trigger["rate_hz"] == pytest.approx(1e3 / 20.5, abs=0.05)
        assert room.http.get(f"{API}/jobs").json()[0]["state"] in ("cancelled", "failed")
        sweep = desk.done(session.id, "mirrors", stations=[far.name])["sweeps"][0]
        assert (sweep["done"], sweep["nodes"]) == (9, 9)


SETTLED = SettleTime(
    rig_id=RIG,
    settle_us=12_000,
    measured_utc="2026-02-01T10:00:00Z",
    session_id="ses-0",
    low_pass_hz=120,
)
