"""Calibrating over REST a simulated rig that somebody turns by hand."""

from collections.abc import Iterator

import pytest

from tests.support.servers.calibration_server import CalibrationServer, calibration_server
from tests.support.servers.stored_session import store_session

MEASURED = 8
"""Poses of the nine that were measured before."""

pytestmark = pytest.mark.timeout(300)

RIG_FILE = """
pan_tilt = "manual"
[operator]
delay_s = 0.1
speed_deg_s = 60.0
"""


@pytest.fixture(scope="module")
def calibrating(tmp_path_factory: pytest.TempPathFactory) -> Iterator[CalibrationServer]:
    with calibration_server(tmp_path_factory.mktemp("by hand"), rig_file=RIG_FILE) as found:
        yield found


def test_rig_turned_by_hand_says_so(calibrating: CalibrationServer) -> None:
    seen = calibrating.server.get("/pan_tilt").json()
    assert (seen["present"], seen["connected"], seen["moves_itself"]) == (True, True, False)
    assert (seen["pan_deg"], seen["wanted_pan_deg"]) == (None, None)
    assert {station["name"] for station in seen["stations"]} >= {"markers", "board"}


def test_sweep_by_hand_is_finished_where_the_rig_rests(calibrating: CalibrationServer) -> None:
    session_id = store_session(
        calibrating.data, stations=calibrating.stations[:1], field_deg=6.0, poses=MEASURED
    ).id
    before = calibrating.server.last_event
    job = calibrating.begin(session_id, "mirrors", stations=["markers"])
    told = calibrating.server.wait_for_event("calibration.progress", after=before)
    assert told["step"] == "mirrors"
    ended = calibrating.ended(job)
    assert ended["state"] == "succeeded", ended["problem"]
    sweep = calibrating.session(session_id)["sweeps"][0]
    assert (sweep["done"], sweep["nodes"]) == (9, 9)
    fresh = [pose for pose in sweep["poses"] if pose["index"] >= MEASURED]
    assert {pose[eye] for pose in fresh for eye in ("left", "right")} <= {"centred", "rim"}
    notes = [
        event.data["note"]
        for event in calibrating.server.services.events.recent(1000)
        if event.kind == "calibration.progress"
    ]
    assert any("turn the rig" in note for note in notes)
    assert calibrating.server.get("/pan_tilt").json()["wanted_pan_deg"] is None
