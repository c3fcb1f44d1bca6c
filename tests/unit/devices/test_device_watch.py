"""What the operator is told to do about a device that fails."""

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from tests.support.devices.fake_rig import FakeRig

from foveacam_hardware.contract import Role, VirtualClock
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.store import Store
from foveacam_server.rig.device_reconnector import FOVEAE, GENERAL_REMEDY, MIRRORS, WIDE, DeviceReconnector
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


@pytest.mark.parametrize(
    ("lost", "missing_eye", "needed"),
    [
        ((), None, FOVEAE),
        (("left",), Role.LEFT, (MIRRORS, WIDE)),
        (("left", "right"), None, FOVEAE),
    ],
)
def test_a_look_does_without_one_fovea_and_not_without_both(
    watch: DeviceReconnector, lost: tuple[str, ...], missing_eye: Role | None, needed: tuple[str, ...]
) -> None:
    rig = FakeRig(VirtualClock())
    for device in lost:
        watch.add_problem(device, detail="unplugged")

    assert watch.fovea_lost(rig) is missing_eye
    assert watch.needed(rig) == needed


def test_a_device_that_stays_away_is_tried_again_every_few_seconds(tmp_path: Path) -> None:
    clock = VirtualClock()
    rig = FakeRig(clock)
    rig.mirrors.lost = True
    pauses_s = []
    with Store(tmp_path) as store, closing(EventLog(store)) as events:
        watch = DeviceReconnector(clock=clock, events=events)
        for _ in range(6):
            watch.connect(rig)
            began_ns = clock.now_ns()
            while not watch.retry_due():
                clock.sleep_until_ns(clock.now_ns() + 100_000_000)
            pauses_s.append((clock.now_ns() - began_ns) / 1e9)

    assert pauses_s == pytest.approx([1.0, 2.0, 4.0, 4.0, 4.0, 4.0])


@pytest.mark.parametrize("detail", ["the port is held", "the port is held; close that program"])
def test_a_refusal_says_once_what_to_do(detail: str) -> None:
    refusal = missing(DeviceProblemDocument(device=MIRRORS, detail=detail, remedy="close that program"))

    assert str(refusal) == "mirrors: the port is held; close that program"
    assert (refusal.found, refusal.remedy) == ("mirrors: the port is held", "close that program")
