"""`foveacam serve --replay`: a server whose rig is a recording."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import cv2
import httpx
import numpy as np
import pytest

from foveacam_hardware.contract import DeviceInfo, InvalidInput
from foveacam_pipeline.capture.recording.recorder import Recorder
from foveacam_pipeline.capture.recording.session import RecordingSession, RigDescription
from foveacam_pipeline.models import load_calibration
from foveacam_server.app import create_app
from foveacam_server.foundation.settings import Settings
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.rig.replay import open_recording
from tests.support.scenes.recordings import STREAMS, picture, raw
from tests.support.servers.local_server import serving

HEIGHT, WIDTH = 96, 128
TICKS = 20
JPEG_LEVELS = 2.0
"""Mean error of JPEG at the views' quality on a smooth ramp; two frames differ by three levels."""


@dataclass
class Replay:
    http: httpx.Client
    calibration_id: str


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of the simulated rig's name, with its calibration, and pictures that tell their number."""
    path = tmp_path_factory.mktemp("recording") / "monday.fcap"
    calibration = load_calibration(SHIPPED / "sim-rig120.json")
    rig = RigDescription(
        rig_id=calibration.rig_id,
        name="The rig of Monday",
        baseline_m=calibration.baseline_m,
        cameras={stream: DeviceInfo(vendor="v", model="IMX273", serial="7") for stream in STREAMS},
        calibration=calibration,
    )
    with Recorder(path, RecordingSession(timestamp="2026-01-31T12:00:00+00:00", rig=rig)) as recorder:
        for tick in range(TICKS):
            for stream in STREAMS:
                recorder.publish(stream, raw(picture(stream, tick, height=HEIGHT, width=WIDTH), tick=tick))
    return path


@contextmanager
def replaying(data: Path, recording: Path) -> Iterator[Replay]:
    settings = Settings(data=data, replay=recording, viewer=False)
    app = create_app(settings)
    with serving(app) as port:
        services = app.state.services
        assert services.hardware.wait_open(60.0)
        assert services.calibration.current is not None
        with httpx.Client(base_url=f"http://127.0.0.1:{port}/api/v1", timeout=30.0, trust_env=False) as http:
            yield Replay(http, services.calibration.current.id)


@pytest.fixture(scope="module")
def replay_server(recorded: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Replay]:
    with replaying(tmp_path_factory.mktemp("data"), recorded) as found:
        yield found


def snapshot(server: Replay, view: str) -> httpx.Response:
    """Return a picture of a view, once there is one."""
    end_s = time.monotonic() + 60.0
    while (answer := server.http.get(f"/views/{view}/snapshot.jpg")).status_code == 503:
        assert time.monotonic() < end_s, answer.text
    assert answer.status_code == 200, answer.text
    return answer


@pytest.mark.parametrize(("view", "stream"), [("left", "left"), ("right", "right"), ("wide", "center")])
def test_a_view_shows_the_recorded_frame(replay_server: Replay, view: str, stream: str) -> None:
    answer = snapshot(replay_server, view)
    shown = cv2.imdecode(np.frombuffer(answer.content, dtype=np.uint8), cv2.IMREAD_GRAYSCALE)
    assert shown is not None
    assert shown.shape == (HEIGHT, WIDTH)
    errors = sorted(
        float(np.abs(shown.astype(float) - picture(stream, tick, height=HEIGHT, width=WIDTH)).mean())
        for tick in range(TICKS)
    )

    assert errors[0] < JPEG_LEVELS < errors[1]


def test_the_recorded_rig_is_shown_with_its_calibration(replay_server: Replay) -> None:
    rig = replay_server.http.get("/rig").json()

    assert rig["rig_id"] == "sim-rig120"
    assert rig["name"] == "The rig of Monday (monday.fcap)"
    assert rig["simulated"] is False
    assert {camera["model"] for camera in rig["cameras"]} == {"IMX273"}
    current = replay_server.http.get("/calibrations/current").json()
    assert current["id"] == replay_server.calibration_id


def test_the_mirrors_stand_where_they_were_recorded_and_refuse_to_move(replay_server: Replay) -> None:
    mirrors = replay_server.http.get("/mirrors").json()
    refused = replay_server.http.post("/mirrors/steer", json={"direction": {"ax_deg": 1.0, "ay_deg": 1.0}})

    assert mirrors["connected"] is True
    assert refused.status_code == 422
    assert "go where they were recorded" in refused.json()["detail"]
    assert replay_server.http.post("/stop").status_code == 200
    assert replay_server.http.delete("/stop").status_code == 200


def test_a_file_that_is_no_recording_ends_the_start_in_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "a.fcap").write_text("nothing")

    with pytest.raises(InvalidInput, match="does not begin as an MCAP file"):
        open_recording(tmp_path / "a.fcap")


def test_a_recording_without_eyes_cannot_be_played(tmp_path: Path) -> None:
    with Recorder(tmp_path / "a.fcap", RecordingSession(timestamp="")) as recorder:
        recorder.publish("thermal", raw(picture("left", 0), tick=0))

    with pytest.raises(InvalidInput, match="its streams are thermal"):
        open_recording(tmp_path / "a.fcap")
