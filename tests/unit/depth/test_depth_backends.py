"""The depth backend of looks: networks that are added, chosen, kept over a restart, and fallen back from."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.support.scenes.network_graphs import constant, matcher, write_card
from typer.testing import CliRunner

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.networks import session
from foveacam_pipeline.networks.card import shipped_network
from foveacam_pipeline.networks.known_pair import known_pair
from foveacam_server.cli import app
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.store import Store
from foveacam_server.resources.looking.depth_backends.schema import DepthBackendChoice
from foveacam_server.resources.looking.depth_backends.service import DepthBackendService

pytestmark = pytest.mark.slow

PAIR = known_pair().pair


@pytest.fixture
def events(tmp_path: Path) -> Iterator[EventLog]:
    with Store(tmp_path / "data") as store:
        log = EventLog(store)
        yield log
        log.close()


@pytest.fixture
def service(tmp_path: Path, events: EventLog) -> DepthBackendService:
    return DepthBackendService(tmp_path / "data" / "networks", events=events)


def choose(service: DepthBackendService, name: str, *, confirmed: bool = False) -> None:
    service.choose(DepthBackendChoice(name=name, research_confirmed=confirmed))


def kinds(events: EventLog) -> list[str]:
    return [event.kind for event in events.recent(10)]


def test_looks_are_matched_by_semi_global_matching_until_a_network_is_chosen(
    service: DepthBackendService, tmp_path: Path, events: EventLog
) -> None:
    assert service.estimate(PAIR).backend == "sgbm"
    network = service.networks.add(write_card(matcher(tmp_path / "a.onnx")))
    choose(service, "shifts")
    matched = service.estimate(PAIR)
    assert (matched.backend, matched.sha256) == ("shifts", network.card.sha256)
    choose(service, "sgbm")
    assert service.estimate(PAIR).backend == "sgbm"
    assert kinds(events).count("depth.backend") == 2


def test_pairs_of_the_live_view_are_matched_alike_and_not_kept_for_comparisons(
    service: DepthBackendService, tmp_path: Path
) -> None:
    network = service.networks.add(write_card(matcher(tmp_path / "a.onnx")))
    assert service.network_in_use() is None
    choose(service, "shifts")
    assert service.estimate_live(PAIR).backend == "shifts" and service.last_pair is None
    assert service.network_in_use() == network
    service.estimate(PAIR)
    assert service.last_pair is PAIR


def test_the_choice_is_kept_over_a_restart(
    service: DepthBackendService, tmp_path: Path, events: EventLog
) -> None:
    service.networks.add(write_card(matcher(tmp_path / "a.onnx")))
    choose(service, "shifts")
    again = DepthBackendService(tmp_path / "data" / "networks", events=events)
    assert again.describe().in_use == "shifts"


def test_a_network_that_fails_falls_back_visibly_and_is_tried_again(
    service: DepthBackendService, tmp_path: Path, events: EventLog
) -> None:
    service.networks.add(write_card(constant(tmp_path / "nan.onnx", float("nan")), name="broken"))
    choose(service, "broken")
    matched = [service.estimate(PAIR) for _ in range(2)]
    assert [(pair.backend, pair.sha256) for pair in matched] == [("sgbm", None)] * 2
    described = service.describe()
    assert described.in_use == "broken"
    assert described.fallback is not None and "no finite number" in described.fallback
    assert kinds(events).count("depth.fallback") == 1  # told once, not at every look


def test_a_chosen_network_that_is_gone_after_a_restart_is_told(
    service: DepthBackendService, tmp_path: Path, events: EventLog
) -> None:
    service.networks.add(write_card(matcher(tmp_path / "a.onnx")))
    choose(service, "shifts")
    service.networks.remove("shifts")
    again = DepthBackendService(tmp_path / "data" / "networks", events=events)
    assert again.describe().in_use == "sgbm"
    assert "there is no depth network shifts" in (again.describe().fallback or "")
    assert "depth.fallback" in kinds(events)


def test_a_network_for_research_needs_a_confirmation(service: DepthBackendService, tmp_path: Path) -> None:
    card = write_card(matcher(tmp_path / "a.onnx"), research_only=True, licence="CC BY-NC 4.0")
    service.networks.add(card)
    with pytest.raises(InvalidInput, match=r"research only \(CC BY-NC 4.0\)"):
        choose(service, "shifts")
    choose(service, "shifts", confirmed=True)
    assert service.describe().in_use == "shifts"


def test_names_that_are_taken_or_unknown_are_refused(service: DepthBackendService, tmp_path: Path) -> None:
    graph = matcher(tmp_path / "a.onnx")
    service.networks.add(write_card(graph))
    for name in ("shifts", "sgbm"):
        with pytest.raises(InvalidInput, match=f"a depth backend {name} already"):
            service.networks.add(write_card(graph, name=name))
    for unknown in ("nothing", "../data", "."):
        with pytest.raises(NotFound):
            service.networks.get(unknown)


def test_the_network_that_ships_is_chosen_like_any_other(service: DepthBackendService) -> None:
    network = shipped_network()
    assert network.graph.stat().st_size <= 4 << 20
    listed = {backend.name: backend for backend in service.describe().backends}["foveal"]
    assert (listed.licence, listed.research_only, listed.problem) == ("MIT", False, None)
    assert service.check("foveal").passed
    choose(service, "foveal")
    matched = service.estimate(PAIR)
    assert (matched.backend, matched.sha256) == ("foveal", network.card.sha256) == ("foveal", listed.sha256)
    assert service.describe().fallback is None
    card = (network.folder / "CARD.md").read_text(encoding="utf-8")
    assert network.card.sha256 in card and "must not be used for" in card


def test_without_onnxruntime_networks_are_listed_with_how_to_get_it(
    service: DepthBackendService, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(session, "find_spec", lambda _name: None)
    listed = {backend.name: backend.problem for backend in service.describe().backends}
    assert listed["sgbm"] is None and "pip install 'foveacam-duo[onnx]'" in (listed["foveal"] or "")


def test_an_own_network_with_the_name_of_one_that_is_built_in_says_so(
    service: DepthBackendService, tmp_path: Path
) -> None:
    with pytest.raises(InvalidInput, match="a depth backend foveal already"):
        service.networks.add(write_card(matcher(tmp_path / "a.onnx"), name="foveal"))
    service.networks.add(write_card(matcher(tmp_path / "a.onnx")))
    folder = tmp_path / "data" / "networks"
    (folder / "shifts").rename(folder / "foveal")
    assert "built in has the name foveal" in str(service.networks.every()["foveal"])
    service.networks.remove("foveal")
    assert not service.networks.every()


def test_a_card_that_was_spoiled_by_hand_is_listed_with_its_problem(
    service: DepthBackendService, tmp_path: Path
) -> None:
    network = service.networks.add(write_card(matcher(tmp_path / "a.onnx")))
    (network.folder / "card.yaml").write_text("format: other")
    document = service.describe().backends[-1]
    assert document.name == "shifts" and "format" in (document.problem or "")


def run(*arguments: str) -> tuple[int, str]:
    result = CliRunner().invoke(app, ["depth", *arguments])
    return result.exit_code, result.output


def test_the_commands_check_add_list_and_remove(tmp_path: Path) -> None:
    data = ("--data", str(tmp_path / "data"))
    card = str(write_card(matcher(tmp_path / "a.onnx"), research_only=True))
    assert run("list", *data) == (0, "no networks; `foveacam depth card` prints a card to begin with\n")
    code, said = run("check", card)
    assert code == 0 and "ok  disparities: median error 0.00 px" in said
    code, said = run("add", card, *data)
    assert code == 0 and "added shifts (Apache-2.0)" in said
    assert run("list", *data) == (0, "shifts: Apache-2.0, research only, a.onnx\n")
    assert run("remove", "shifts", *data) == (0, "removed shifts\n")
    assert run("list", *data)[1].startswith("no networks")


def test_a_network_that_fails_its_check_is_not_added(tmp_path: Path) -> None:
    card = str(write_card(matcher(tmp_path / "a.onnx", sign=-1.0)))
    code, said = run("add", card, "--data", str(tmp_path / "data"))
    assert code == 1 and "set output.sign" in said
    assert not (tmp_path / "data" / "networks").exists()


def test_the_card_that_is_printed_is_read_again(tmp_path: Path) -> None:
    code, text = run("card")
    path = tmp_path / "card.yaml"
    path.write_text(text)
    assert code == 0
    code, said = run("check", str(path))
    assert code == 1 and "put it beside the card" in said
