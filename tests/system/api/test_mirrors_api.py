"""The mirrors by REST: their controller's link, switching them off and on, and starting their DACs anew."""

import time

import pytest

from tests.support.servers.running_server import Running

AHEAD = {"direction": {"ax_deg": 1.0, "ay_deg": 0.0}}
PATIENCE_S = 20.0


def test_the_link_is_told_with_rates_round_trips_governor_and_streams(api_server: Running) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while (link := api_server.get("/mirrors").json()["link"])["tx_packets_per_s"] == 0:
        assert time.monotonic() < end_s, "nothing is asked of the controller"

    assert 0 < link["rtt_p50_ms"] <= link["rtt_p95_ms"] <= link["rtt_max_ms"]
    assert 60.0 <= link["update_limit_hz"] <= 1000.0
    assert [stream["stream"] for stream in link["streams"]] == [0, 1]
    assert link["tx_bytes"] > link["tx_packets"] > 0


def test_the_controller_says_who_it_is(api_server: Running) -> None:
    mirrors = api_server.get("/mirrors").json()

    assert mirrors["controller"]["version"] == "2.1.0"
    assert mirrors["rail_wanted"] is True
    assert mirrors["guarded"] is False  # the simulated controller ends with its server


def test_mirrors_switched_off_refuse_to_move_until_they_are_switched_on(api_server: Running) -> None:
    try:
        off = api_server.post("/mirrors/disable", {})
        assert off.status_code == 200
        assert off.json()["rail_wanted"] is False

        refused = api_server.post("/mirrors/steer", AHEAD)
        assert refused.status_code == 409
        assert "/api/v1/mirrors/enable" in refused.json()["detail"]
        assert api_server.post("/mirrors/recover", {}).status_code == 409
    finally:
        on = api_server.post("/mirrors/enable", {})
    assert on.status_code == 200
    assert api_server.post("/mirrors/steer", AHEAD).status_code == 200


@pytest.mark.parametrize("action", ["disable", "enable"])
def test_mirrors_are_not_switched_under_a_job(api_server: Running, action: str) -> None:
    with api_server.services.hardware.session("job 7", cancelled=lambda: False):
        refused = api_server.post(f"/mirrors/{action}", {})

    assert (refused.status_code, refused.json()["found"]) == (409, "job 7 is using the rig")
    assert api_server.get("/mirrors").json()["rail_wanted"] is True


def test_recovering_the_mirrors_leaves_them_where_they_are(api_server: Running) -> None:
    before = api_server.post("/mirrors/steer", AHEAD).json()

    after = api_server.post("/mirrors/recover", {})

    assert after.status_code == 200
    assert after.json()["left"] == before["left"]
