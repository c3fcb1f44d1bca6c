"""What the operator is told to do about a device that fails."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from foveacam_hardware.contract import VirtualClock
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.store import Store
from foveacam_server.rig.device_reconnector import GENERAL_REMEDY, MIRRORS, DeviceReconnector
from foveacam_server.rig.refusals import missing
from foveacam_server.rig.schema import DeviceProblemDocument


@pytest.fixture
def watch(tmp_path: Path) -> Iterator[DeviceReconnector]:
    store = Store(tmp_path)
    yield DeviceReconnector(clock=VirtualClock(), events=EventLog(store))
    store.close()


@pytest.mark.parametrize(
    ("detail", "given", "remedy"),
    [
        ("firmware 9.0 is newer than this driver; update the software", None, "update the software"),
        ("the port is held; by a terminal; close that program", None, "close that program"),
        ("the controller does not answer", None, GENERAL_REMEDY),
        ("the port is held; close that program", "wait a while", "wait a while"),
    ],
)
def test_a_remedy_is_what_is_known_or_what_the_sentence_says_or_what_is_always_worth_a_try(
    watch: DeviceReconnector, detail: str, given: str | None, remedy: str
) -> None:
    watch.add_problem(MIRRORS, detail=detail, remedy=given)

    assert [(problem.detail, problem.remedy) for problem in watch.problems] == [(detail, remedy)]


@pytest.mark.parametrize("detail", ["the port is held", "the port is held; close that program"])
def test_a_refusal_says_once_what_to_do(detail: str) -> None:
    refusal = missing(DeviceProblemDocument(device=MIRRORS, detail=detail, remedy="close that program"))

    assert str(refusal) == "mirrors: the port is held; close that program"
    assert (refusal.found, refusal.remedy) == ("mirrors: the port is held", "close that program")
