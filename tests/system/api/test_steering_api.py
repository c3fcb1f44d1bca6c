"""Steering by hand: volts by REST, and the steering socket with its dead-man."""

import json
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import httpx
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect
from websockets.sync.connection import Connection
from websockets.typing import Origin

from foveacam_hardware.contract import PARKED, NotCalibrated
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.rig import hand_steering
from tests.support.servers import server_state
from tests.support.servers.running_server import API, PATIENCE_S, Running

STEP_V = 0.01
FREE = {"left": {"x_v": 30.0, "y_v": -12.0}, "right": {"x_v": -5.0, "y_v": 8.0}}
AHEAD = {"direction": {"ax_deg": 0.0, "ay_deg": 0.0}}
Document = dict[str, Any]  # Any: a JSON document


@dataclass
class Hand:
    """A client of the steering socket; `hold` keeps it alive until something shows."""

    wire: Connection

    def send(self, **message: object) -> None:
        self.wire.send(json.dumps({"type": "steer", "held": True, **message}))

    def receive(self, kind: str, enough: Callable[[Document], bool] = lambda _: True) -> Document:
        """Return the next message of a kind that is enough."""
        end_s = time.monotonic() + PATIENCE_S
        while time.monotonic() < end_s:
            message: Document = json.loads(self.wire.recv(timeout=PATIENCE_S))
            if message["type"] == kind and enough(message):
                return message
        raise AssertionError(kind)

    def hold(self, shown: Callable[[], bool], **message: object) -> None:
        end_s = time.monotonic() + PATIENCE_S
        while not shown():
            assert time.monotonic() < end_s, "what was awaited never showed"
            self.send(**message)
            threading.Event().wait(0.05)


@contextmanager
def hand(server: Running, **begin: object) -> Iterator[Hand]:
    with connect(f"ws://127.0.0.1:{server.port}{API}/mirrors/steering", proxy=None) as wire:
        wire.send(json.dumps({"type": "begin", "name": "Ada", **begin}))
        yield Hand(wire)


def stands(server: Running, volts: Document) -> bool:
    """Whether the mirrors are commanded to stand there."""
    mirrors = server.get("/mirrors").json()
    return all(
        abs(mirrors[eye][axis] - value_v) < STEP_V
        for eye, drive in volts.items()
        for axis, value_v in drive.items()
    )


def parked(server: Running) -> bool:
    return server.rig.mirrors.state.volts == PARKED


def put_volts(server: Running, volts: Document, **headers: str) -> httpx.Response:
    return server.http.put(f"{API}/mirrors/volts", json=volts, headers=headers)


@pytest.fixture(autouse=True)
def at_rest(api_server: Running) -> Iterator[None]:
    """Let every test find the mirrors parked and free, whatever one has left."""
    assert api_server.post("/mirrors/park").status_code == 200  # a server starts by looking ahead
    yield
    api_server.http.delete(f"{API}/stop")
    server_state.release_lease(api_server.http)
    api_server.services.hardware.hand.make_way("a test has ended")
    assert api_server.post("/mirrors/park").status_code == 200


# By REST ----------------------------------------------------------------------------------------------------


def test_volts_are_set_eye_by_eye(api_server: Running) -> None:
    both = put_volts(api_server, FREE)
    assert both.status_code == 200
    assert both.json()["left"]["x_v"] == pytest.approx(30.0, abs=STEP_V)

    one = put_volts(api_server, {"right": {"x_v": 1.0, "y_v": 2.0}})

    assert one.status_code == 200
    assert stands(api_server, {"left": FREE["left"], "right": {"x_v": 1.0, "y_v": 2.0}})
    assert api_server.post("/mirrors/park").json()["left"]["x_v"] == 0.0
    assert parked(api_server)


def test_volts_out_of_range_are_refused_with_the_limit(api_server: Running) -> None:
    refused = put_volts(api_server, {"left": {"x_v": 171.0, "y_v": 0.0}})

    problem = refused.json()
    assert (refused.status_code, problem["type"]) == (422, "/problems/out-of-range")
    assert problem["asked"] == "left x_v = 171"
    assert problem["found"] == "the mirrors take ±170 V"
    assert problem["remedy"] == "choose volts inside"
    assert put_volts(api_server, {}).status_code == 422


def test_volts_need_the_lease_and_a_free_rig(api_server: Running) -> None:
    token = api_server.post("/lease", {"holder": "Bob"}).json()["token"]
    assert put_volts(api_server, FREE).status_code == api_server.post("/mirrors/park").status_code == 409
    assert put_volts(api_server, FREE, **{"X-Lease": token}).status_code == 200
    api_server.http.delete(f"{API}/lease", headers={"X-Lease": token})
    with api_server.services.hardware.session("job 7", cancelled=lambda: False):
        refused = put_volts(api_server, FREE)
        assert (refused.status_code, refused.json()["found"]) == (409, "job 7 is using the rig")
        assert api_server.post("/mirrors/park").status_code == 409
    api_server.post("/stop")
    assert put_volts(api_server, FREE).json()["type"] == "/problems/stopped"


# By the socket ----------------------------------------------------------------------------------------------


def test_the_eyes_go_where_the_hand_says_and_stay_when_it_lets_go(api_server: Running) -> None:
    with hand(api_server) as ada:
        hello = ada.receive("hello")
        assert (hello["max_v"], hello["calibrated"], hello["shift_limit_deg"]) == (170.0, True, 0.5)
        ada.hold(lambda: stands(api_server, FREE), volts=FREE)
        state = ada.receive("state", lambda found: found["status"] == "steering")
        assert state["by"] == "Ada"
        assert api_server.post("/mirrors/steer", AHEAD).json()["found"] == "Ada steers by hand"
        ada.send(held=False)
        ada.receive("state", lambda found: found["status"] == "released")
    assert stands(api_server, FREE)
    assert api_server.post("/mirrors/steer", AHEAD).status_code == 200


def test_a_gaze_has_direction_distance_and_vertical_shift(api_server: Running) -> None:
    gaze = {"direction": {"ax_deg": 2.0, "ay_deg": -1.0}, "distance_m": 2.0, "vertical_shift_deg": 0.25}

    def gazes() -> bool:  # the mirrors take a few moments to arrive, so a single reading would be a race
        left, right = (api_server.get("/mirrors").json()[eye] for eye in ("left", "right"))
        verged = left["ax_deg"] - right["ax_deg"] == pytest.approx(5.7, abs=0.3)
        shifted = left["ay_deg"] - right["ay_deg"] == pytest.approx(0.5, abs=0.02)
        return bool(verged and shifted and left["ax_deg"] > 4.0)

    with hand(api_server) as ada:
        ada.hold(gazes, gaze=gaze)
        ada.send(gaze={**gaze, "vertical_shift_deg": 0.6})
        assert ada.receive("problem")["found"] == "the eyes are shifted by ±0.5 degrees at most"
        ada.send(held=False)
        ada.receive("state", lambda found: found["status"] == "released")


def test_without_a_calibration_volts_steer_and_a_gaze_is_refused(
    api_server: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem = NotCalibrated("this rig has no calibration; calibrate it")

    def require() -> Calibration:
        raise problem

    calibration = api_server.services.calibration
    monkeypatch.setattr(type(calibration), "current", property(lambda _: None))
    monkeypatch.setattr(calibration, "require", require)

    assert put_volts(api_server, FREE).json()["left"]["ax_deg"] is None
    with hand(api_server) as ada:
        assert ada.receive("hello")["calibrated"] is False
        ada.send(gaze=AHEAD)
        assert ada.receive("problem")["title"] == "The rig is not calibrated"
        ada.send(held=False)
        ada.hold(
            lambda: stands(api_server, {"left": {"x_v": 7.0, "y_v": 0.0}}),
            volts={"left": {"x_v": 7.0, "y_v": 0.0}},
        )
        assert ada.receive("state", lambda found: found["status"] == "steering")["gaze"] is None
        ada.send(held=False)


def test_volts_out_of_range_are_told_and_the_mirrors_stay(api_server: Running) -> None:
    with hand(api_server) as ada:
        ada.hold(lambda: stands(api_server, FREE), volts=FREE)
        ada.send(volts={"left": {"x_v": -200.0, "y_v": 0.0}})
        problem = ada.receive("problem")
        assert (problem["title"], problem["asked"]) == ("Out of range", "left x_v = -200")
        ada.send(held=False)
    assert stands(api_server, FREE)


def test_a_stop_ends_it_until_a_new_press(api_server: Running) -> None:
    with hand(api_server) as ada:
        ada.hold(lambda: stands(api_server, FREE), volts=FREE)
        assert api_server.post("/stop").json()["parked"] is True
        parks = api_server.rig.mirrors.state.parks
        ada.hold(lambda: ada.receive("state")["status"] == "ended", volts=FREE)
        assert parked(api_server)
        api_server.http.delete(f"{API}/stop")
        for _ in range(5):
            ada.send(volts=FREE)
        assert ada.receive("state")["reason"] == "the stop is engaged"
        assert (parked(api_server), api_server.rig.mirrors.state.parks) == (True, parks)
        ada.send(held=False)
        ada.hold(lambda: stands(api_server, FREE), volts=FREE)
        ada.send(held=False)


def test_silence_holds_then_parks(api_server: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hand_steering, "PARK_S", 1.0)
    with hand(api_server) as ada:
        ada.hold(lambda: stands(api_server, FREE), volts=FREE)
        ada.receive("state", lambda found: found["status"] == "silent")
        assert stands(api_server, FREE)
        ended = ada.receive("state", lambda found: found["status"] == "ended")
        assert "no message came" in ended["reason"]
    assert parked(api_server)


def test_a_closed_socket_parks_unless_it_let_go(api_server: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hand_steering, "PARK_S", 1.0)
    before = api_server.last_event
    with hand(api_server) as ada:
        ada.hold(lambda: stands(api_server, FREE), volts=FREE)
    assert stands(api_server, FREE)
    api_server.wait_for_event("mirrors.parked", after=before)
    assert parked(api_server)


def test_a_job_takes_the_rig_and_says_so(api_server: Running) -> None:
    with hand(api_server) as ada:
        ada.hold(lambda: stands(api_server, FREE), volts=FREE)
        found: list[Document] = []
        fixating = threading.Thread(target=lambda: found.append(api_server.fixate()))
        fixating.start()
        ada.hold(lambda: ada.receive("state")["status"] == "ended", volts=FREE)
        reason = ada.receive("state", lambda state: state["status"] == "ended")["reason"]
        assert "uses the rig" in reason
        fixating.join(PATIENCE_S)
        assert found[0]["state"] == "verged"
        ada.send(held=False)
        ada.hold(lambda: stands(api_server, FREE), volts=FREE)
        ada.send(held=False)


def test_the_lease_of_another_is_respected(api_server: Running) -> None:
    token = api_server.post("/lease", {"holder": "Bob"}).json()["token"]
    with hand(api_server) as ada:
        ada.send(volts=FREE)
        assert ada.receive("problem")["found"] == "the lease is held by Bob"
        assert ada.receive("state", lambda found: found["status"] == "ended")["by"] is None
        assert parked(api_server)
    with hand(api_server, lease=token) as bob:
        bob.hold(lambda: stands(api_server, FREE), volts=FREE)
        api_server.post("/lease", {"holder": "Eve", "take_over": True})
        bob.hold(lambda: bob.receive("state")["status"] == "ended", volts=FREE)
        assert bob.receive("state")["reason"] == "the lease is held by Eve"


def test_two_hands_do_not_fight(api_server: Running) -> None:
    with hand(api_server) as ada, hand(api_server, name="Bob") as bob:
        ada.hold(lambda: stands(api_server, FREE), volts=FREE)
        ada.send(volts=FREE)
        bob.send(volts={"left": {"x_v": 0.0, "y_v": 0.0}})
        assert bob.receive("problem")["found"] == "Ada steers by hand"
        ada.send(held=False)


def test_what_is_no_message_is_told_and_foreign_pages_are_refused(api_server: Running) -> None:
    with hand(api_server) as ada:
        ada.wire.send('{"type":"steer","held":true,"volts":{"left":{"x_v":"5","y_v":0}}}')
        assert "volts" in ada.receive("problem")["detail"]
    with connect(f"ws://127.0.0.1:{api_server.port}{API}/mirrors/steering", proxy=None) as wire:
        wire.send('{"type":"steer","held":true}')
        assert "first message" in json.loads(wire.recv(timeout=PATIENCE_S))["detail"]
        with pytest.raises(ConnectionClosed):
            wire.recv(timeout=PATIENCE_S)
    with pytest.raises(InvalidStatus) as refused:
        connect(
            f"ws://127.0.0.1:{api_server.port}{API}/mirrors/steering",
            proxy=None,
            origin=Origin("http://evil.example"),
        )
    assert refused.value.response.status_code == 403
