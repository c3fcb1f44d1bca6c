"""Depth backends by REST: listed, chosen for looks, checked, and what is refused."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from foveacam_server.foundation.store import Document
from foveacam_server.resources.looking.depth_backends.networks import NetworkFolder
from tests.support.scenes.network_graphs import constant, matcher, write_card
from tests.support.servers.running_server import API, Running

pytestmark = [pytest.mark.timeout(120), pytest.mark.usefixtures("grey")]


@pytest.fixture
def networks(api_server: Running) -> Iterator[NetworkFolder]:
    folder = NetworkFolder(api_server.services.settings.data / "networks")
    yield folder
    choose(api_server, "sgbm")
    for name in folder.every():
        folder.remove(name)


def choose(server: Running, name: str, **more: object) -> Document:
    answer = server.http.put(f"{API}/depth/backend", json={"name": name, **more})
    found: Document = answer.json()
    return found


def new_cloud(server: Running) -> Document:
    fixation = server.fixate()
    told = f"/fixations/{fixation['id']}"
    cloud_id = server.poll(told, lambda found: found["cloud_id"] is not None)["cloud_id"]
    cloud: Document = server.get(f"/clouds/{cloud_id}").json()
    return cloud


def looked(server: Running) -> None:
    """See that there is a look to compare on."""
    if not server.get("/clouds").json():
        new_cloud(server)


def test_the_chosen_network_computes_the_cloud_of_a_look_which_says_so(
    api_server: Running, networks: NetworkFolder, tmp_path: Path
) -> None:
    network = networks.add(write_card(matcher(tmp_path / "a.onnx", first_px=-16, last_px=16)))
    listed = api_server.get("/depth/backends").json()
    assert [backend["name"] for backend in listed["backends"]] == ["sgbm", "live", "foveal", "shifts"]
    assert listed["in_use"] == "sgbm"
    before = api_server.last_event
    assert choose(api_server, "shifts")["in_use"] == "shifts"
    assert api_server.wait_for_event("depth.backend", after=before)["name"] == "shifts"
    cloud = new_cloud(api_server)
    assert (cloud["backend"], cloud["network_sha256"]) == ("shifts", network.card.sha256)


def test_a_look_of_a_network_that_fails_is_matched_by_sgbm_and_the_list_says_why(
    api_server: Running, networks: NetworkFolder, tmp_path: Path
) -> None:
    networks.add(write_card(constant(tmp_path / "nan.onnx", float("nan")), name="broken"))
    choose(api_server, "broken")
    before = api_server.last_event
    assert new_cloud(api_server)["backend"] == "sgbm"
    told = api_server.wait_for_event("depth.fallback", after=before)
    assert told["name"] == "broken" and "no finite number" in told["detail"]
    assert api_server.get("/depth/backends").json()["fallback"] == told["detail"]


def test_a_check_names_the_key_of_the_card_that_is_wrong(
    api_server: Running, networks: NetworkFolder, tmp_path: Path
) -> None:
    networks.add(write_card(matcher(tmp_path / "a.onnx", sign=-1.0)))
    found = api_server.post("/depth/backends/shifts/check").json()
    assert not found["passed"]
    assert "output.sign" in found["findings"][-1]["remedy"]


def test_what_cannot_be_chosen_is_refused_in_words(
    api_server: Running, networks: NetworkFolder, tmp_path: Path
) -> None:
    assert choose(api_server, "nothing")["status"] == 404
    card = write_card(matcher(tmp_path / "a.onnx"), research_only=True, licence="CC BY-NC 4.0")
    networks.add(card)
    refused = choose(api_server, "shifts")
    assert refused["status"] == 422 and "research_confirmed" in refused["detail"]
    assert choose(api_server, "shifts", research_confirmed=True)["in_use"] == "shifts"
    assert choose(api_server, "Shifts!")["status"] == 422


def test_two_backends_are_compared_on_the_newest_look_with_pictures(
    api_server: Running, networks: NetworkFolder, tmp_path: Path
) -> None:
    network = networks.add(write_card(matcher(tmp_path / "a.onnx", first_px=-16, last_px=16)))
    looked(api_server)
    found = api_server.post("/depth/comparisons", {"first": "sgbm", "second": "shifts"}).json()

    assert (found["first"]["sha256"], found["second"]["sha256"]) == (None, network.card.sha256)
    assert 0.0 < found["known_both"] <= min(found["first"]["known"], found["second"]["known"])
    assert abs(found["median_px"]) < 1.0 and 0.0 < found["within_1"] <= found["within_2"] <= 1.0
    assert len(found["edges"]) == len(found["shares"]) + 1
    addresses = [found[side]["picture_url"] for side in ("first", "second")]
    for address in (*addresses, found["difference_url"], found["left_url"]):
        answer = api_server.http.get(address)
        assert (answer.status_code, answer.content[:4]) == (200, b"\x89PNG")


def test_a_comparison_that_cannot_be_made_is_refused_in_words(
    api_server: Running, networks: NetworkFolder, tmp_path: Path
) -> None:
    networks.add(write_card(matcher(tmp_path / "a.onnx"), research_only=True, licence="CC BY-NC 4.0"))
    looked(api_server)
    for first, second, status, words in (
        ("sgbm", "sgbm", 422, "with itself"),
        ("sgbm", "nothing", 404, "no depth network nothing"),
        ("sgbm", "shifts", 422, "for research only (CC BY-NC 4.0)"),
    ):
        refused = api_server.post("/depth/comparisons", {"first": first, "second": second})
        assert (refused.status_code, words in refused.json()["detail"]) == (status, True)
    assert api_server.http.get(f"{API}/depth/comparisons/cmp-0/first.png").status_code == 404
