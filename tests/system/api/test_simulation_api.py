"""Breaking the simulated rig over REST: in force at once, told, mended; a rig of metal has no such thing."""

import pytest

from foveacam_hardware.contract import Role
from tests.support.servers.running_server import API, Running

pytestmark = pytest.mark.timeout(120)

FAULTS = "/simulation/faults"
WHOLE = {"shift_x_deg": 0.0, "shift_y_deg": 0.0, "rotation_deg": 0.0}


def test_what_is_broken_is_told_in_force_and_mended(api_server: Running) -> None:
    before = api_server.last_event
    wanted = {"no_strobe": ["left"], "knocked_right": {"shift_x_deg": 0.2}}
    try:
        answer = api_server.http.put(f"{API}{FAULTS}", json=wanted)
        assert answer.status_code == 200, answer.text
        assert answer.json()["knocked_right"] == {**WHOLE, "shift_x_deg": 0.2}
        assert api_server.get(FAULTS).json() == answer.json()
        assert api_server.truth.world.faults.no_strobe == {Role.LEFT}
        assert api_server.wait_for_event("simulation.faults", after=before) == answer.json()
        # Whatever is not named is mended
        answer = api_server.http.put(f"{API}{FAULTS}", json={"frozen": ["wide"]})
        assert answer.json()["no_strobe"] == []
        assert answer.json()["knocked_right"] == WHOLE
    finally:
        mended = api_server.http.delete(f"{API}{FAULTS}")
    assert mended.json()["frozen"] == []
    assert api_server.truth.world.faults.in_force.words == []


@pytest.mark.parametrize(
    ("wanted", "words"),
    [
        ({"unplugged": ["centre"]}, ["unplugged", "wide", "centre"]),
        ({"knocked_left": {"shift_x_deg": 30.0}}, ["shift_x_deg", "5", "30"]),
        ({"stuck": ["left"]}, ["stuck"]),
    ],
)
def test_what_cannot_be_broken_is_refused_in_words(
    api_server: Running, wanted: dict[str, object], words: list[str]
) -> None:
    refused = api_server.http.put(f"{API}{FAULTS}", json=wanted)
    assert refused.status_code == 422
    assert all(word in refused.json()["detail"] for word in words), refused.json()
    assert api_server.truth.world.faults.in_force.words == []


def test_a_rig_of_metal_has_nothing_that_is_broken_on_purpose(
    api_server: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(api_server.rig, "breakable", None)
    for answer in (api_server.http.get(f"{API}{FAULTS}"), api_server.http.put(f"{API}{FAULTS}", json={})):
        assert answer.status_code == 404
        assert "--rig sim" in answer.json()["remedy"]
