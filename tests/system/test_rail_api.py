"""The rail by REST, on the simulated rig, whose pan-tilt is on the same board."""

import threading
from collections.abc import Iterator
from typing import Any

import pytest

from foveacam_hardware.drivers.positioners.grbl_rail import GrblRail
from foveacam_server import cli
from foveacam_server.foundation.store import Document
from tests.support.servers.running_server import API, Running, running

pytestmark = pytest.mark.timeout(300)

PATIENCE_S = 60.0
SELDOM_HZ = 0.2, 0.2
QUICK = dict.fromkeys((24, 25, 110, 111, 112, 120, 121, 122), 1e6)
"""Motors that home in no time; moves are as quick as the rig asks for."""
SLOW = {112: 600.0}
"""A rail of 10 mm/s: a busy machine has the time to stop it."""


def come_to_rest(server: Running) -> Document:
    return server.poll("/rail", lambda seen: not seen["moving"], every_s=0.1)


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    """A server whose views are seldom drawn: nobody looks at them, and on the rail all of them change."""
    with running(tmp_path_factory.mktemp("data"), live_hz=SELDOM_HZ) as found:
        yield found


@pytest.fixture(scope="module")
def homed(server: Running) -> Running:
    server.truth.pan_tilt.set_faults(settings=QUICK)
    assert server.post("/rail/homings").status_code == 200
    come_to_rest(server)
    return server


def test_the_rail_tells_its_limits_and_the_papers_places(server: Running) -> None:
    seen = server.get("/rail").json()

    assert seen["present"]
    assert seen["moves_itself"]
    assert seen["limits"]["min_mm"] <= -300.0
    places = {place["name"]: place["position_mm"] for place in seen["places"]}
    assert sorted(places.values()) == pytest.approx([-300.0, -100.0, 0.0, 100.0, 300.0])


def test_a_homed_rail_stands_in_the_middle_and_its_boards_pan_tilt_is_homed_too(homed: Running) -> None:
    assert homed.get("/rail").json()["position_mm"] == pytest.approx(0.0, abs=0.02)
    assert homed.get("/pan_tilt").json()["homed"]


def test_it_moves_to_a_place_and_to_a_position(homed: Running) -> None:
    begun = homed.post("/rail/moves", {"place": "right"}).json()
    assert begun["moving"]
    assert come_to_rest(homed)["position_mm"] == pytest.approx(100.0, abs=0.02)

    homed.post("/rail/moves", {"position_mm": 70.0})

    assert come_to_rest(homed)["position_mm"] == pytest.approx(70.0, abs=0.02)


def test_a_stop_holds_it_on_its_way_and_refuses_to_move_it(homed: Running) -> None:
    homed.truth.pan_tilt.set_faults(settings=SLOW)
    homed.post("/rail/moves", {"position_mm": -300.0})
    homed.post("/stop")
    try:
        assert come_to_rest(homed)["position_mm"] > -290.0
        refused = homed.post("/rail/moves", {"place": "centre"})
        assert (refused.status_code, refused.json()["type"]) == (409, "/problems/stopped")
    finally:
        homed.http.delete(f"{API}/stop")
        homed.truth.pan_tilt.set_faults(settings=QUICK)


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ({"place": "attic"}, "'far left'"),
        ({"position_mm": 500.0}, "500"),
        ({}, "place or position_mm"),
        ({"place": "left", "position_mm": 1.0}, "not both"),
        ({"position_mm": "1"}, "a number"),
        ({"position": 1.0}, "position"),
    ],
)
def test_a_move_that_cannot_be_is_refused_in_words(
    homed: Running, body: dict[str, Any], message: str
) -> None:
    refused = homed.post("/rail/moves", body)

    assert refused.status_code == 422
    assert message in refused.text


def devices(server: Running, kind: str, *, after: int) -> set[str]:
    """Wait until an event of a kind has been told of both devices of the board; return which."""
    waiting, found = threading.Event(), set[str]()
    for _ in range(round(PATIENCE_S / 0.1)):
        found = {event.data["device"] for event in server.services.events.after(after) if event.kind == kind}
        if len(found) > 1:
            return found
        waiting.wait(0.1)
    raise AssertionError(f"of {kind} only {found} was told")


def test_an_alarm_is_an_event_of_each_device_and_the_server_stays_ready(homed: Running) -> None:
    after = homed.last_event
    homed.truth.pan_tilt.hit_a_limit()

    assert devices(homed, "device.fault", after=after) == {"pan_tilt", "rail"}
    assert homed.http.get("/readyz").json()["ready"]
    assert "limit switch" in homed.get("/rail").json()["fault"]
    homed.post("/rail/homings")

    assert devices(homed, "device.recovered", after=after) == {"pan_tilt", "rail"}
    come_to_rest(homed)


@pytest.fixture
def without_switches(homed: Running) -> Iterator[Running]:
    """The rig whose board has no switches from here on, at its zero."""
    rail = homed.rig.rail
    assert isinstance(rail, GrblRail)
    board = rail._board
    homed.truth.pan_tilt.set_faults(settings={20: 0.0, 22: 0.0})
    board.life.has_switches = False
    yield homed
    board.life.has_switches = True
    homed.truth.pan_tilt.set_faults(settings={20: 1.0, 22: 1.0})


@pytest.mark.parametrize("positioner", ["rail", "pan-tilt"])
def test_a_board_without_switches_that_restarted_is_usable_once_the_command_line_says_its_zero(
    without_switches: Running,
    positioner: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    server = without_switches
    path = f"/{positioner.replace('-', '_')}"
    server.truth.pan_tilt.power_cycle()
    seen = server.get(path).json()
    assert seen["awaits_zero"] and not seen["homed"]
    assert "then confirm that it stands there" in seen["fault"]
    refused = server.post(f"{path}/homings")
    assert refused.status_code == 502 and "no reference switches" in refused.text

    address = f"http://127.0.0.1:{server.port}"
    monkeypatch.setattr("sys.argv", ["foveacam", "confirm-zero", positioner, "--server", address])
    with pytest.raises(SystemExit) as ended:
        cli.main()

    assert ended.value.code in (0, None)
    assert "its present position is now its zero" in capsys.readouterr().out
    seen = server.get(path).json()
    assert (seen["fault"], seen["homed"], seen["awaits_zero"]) == (None, True, False)


def test_a_board_with_switches_is_told_to_home_by_rest(homed: Running) -> None:
    refused = homed.post("/rail/zero_confirmations")

    assert refused.status_code == 422
    assert "home it" in refused.json()["detail"]
