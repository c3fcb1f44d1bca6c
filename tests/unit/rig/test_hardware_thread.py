import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from tests.support.devices.fake_rig import FakeProblem, FakeRig, Pictures
from tests.support.devices.hardware_setup import PATIENCE_S, HardwareSetup, hardware_setup, never

from foveacam_hardware.contract import (
    PARKED,
    Busy,
    Cancelled,
    DeviceFault,
    InvalidInput,
    MirrorVolts,
    MonotonicClock,
    NotConnected,
    Role,
    StereoVolts,
    Stopped,
    Timeout,
    VirtualClock,
)
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.store import Store
from foveacam_server.rig.access import StillRigAccess
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.hardware_commands import LENGTH
from foveacam_server.rig.hardware_thread.opening_steps import FIRST_DEVICES, OpeningSteps
from foveacam_server.rig.live_views import LiveRates
from foveacam_server.rig.ports import RigOpeningWatch
from foveacam_server.rig.status import RigState
from foveacam_server.rig.stop import StopSwitch

THERE = StereoVolts(left=MirrorVolts(x_v=50.0, y_v=0.0), right=MirrorVolts(x_v=40.0, y_v=0.0))


@pytest.fixture
def setup(tmp_path: Path) -> Iterator[HardwareSetup]:
    with hardware_setup(tmp_path) as found:
        yield found


def test_a_rig_counts_as_open_only_when_its_cameras_are_known(setup: HardwareSetup) -> None:
    known: list[tuple[RigState, int]] = []

    class Opened(threading.Event):
        def set(self) -> None:
            known.append((setup.hardware.status.state, len(setup.hardware.status.cameras)))
            super().set()

    setup.hardware._opened = Opened()
    setup.start()
    assert known == [(RigState.OPENING, 3)]


def test_views_live_while_nobody_works(setup: HardwareSetup) -> None:
    setup.start()
    for view in ("wide", "left", "right"):
        setup.pictures.wait_for_more(view, more=3)


def test_live_looks_rest_while_a_job_has_the_rig_and_its_looks_feed_the_views(setup: HardwareSetup) -> None:
    hardware = setup.start()
    with hardware.session("a job", cancelled=never) as head:
        hardware.submit(lambda rig: None).result(PATIENCE_S)  # a live look under way has ended
        before = setup.pictures.counts.get("left", 0)
        for _ in range(3):
            head.look(THERE)
        assert setup.pictures.counts["left"] == before + 3
    assert hardware.gaze == THERE


def test_looks_that_are_begun_ahead_are_made_in_their_order(setup: HardwareSetup) -> None:
    hardware = setup.start()
    with hardware.session("a job", cancelled=never) as head:
        hardware.submit(lambda rig: None).result(PATIENCE_S)  # a live look under way has ended
        before = setup.pictures.counts.get("left", 0)
        begun = [head.begin_look(volts) for volts in (THERE, PARKED)]
        assert [look.result().volts for look in begun] == [THERE, PARKED]
        assert setup.pictures.counts["left"] == before + 2
    assert hardware.gaze == PARKED


def test_a_cancelled_session_begins_no_look(setup: HardwareSetup) -> None:
    hardware = setup.start()
    with hardware.session("a job", cancelled=lambda: True) as head, pytest.raises(Cancelled):
        head.begin_look(THERE)


def test_second_session_is_refused_and_names_the_first(setup: HardwareSetup) -> None:
    hardware = setup.start()
    with hardware.session("the first", cancelled=never):
        with pytest.raises(Busy, match="the first is using the rig"), hardware.session("b", cancelled=never):
            pass
        with pytest.raises(Busy, match="the first is using the rig"):
            hardware.steer(THERE)
    hardware.steer(THERE).result(PATIENCE_S)


def test_cancelled_session_looks_no_more(setup: HardwareSetup) -> None:
    hardware = setup.start()
    with hardware.session("a job", cancelled=lambda: True) as head, pytest.raises(Cancelled):
        head.look(THERE)


def test_full_queue_is_busy(setup: HardwareSetup) -> None:
    hardware = setup.start()
    setup.rig.head.hold = threading.Event()
    with hardware.session("a job", cancelled=never) as head:
        first = head.begin_look(THERE)
        assert setup.rig.head.looking.wait(PATIENCE_S)
        waiting = []
        with pytest.raises(Busy, match="commands waiting"):
            for _ in range(LENGTH + 2):
                waiting.append(hardware.submit(lambda rig: rig.name))
        setup.rig.head.hold.set()
        first.result()
        assert waiting[-1].result(PATIENCE_S) == "Fake rig"


def test_halt_parks_from_any_thread_while_a_look_is_under_way(setup: HardwareSetup) -> None:
    hardware = setup.start()
    with hardware.session("a job", cancelled=never) as head:
        hardware.submit(lambda rig: None).result(PATIENCE_S)  # a live look under way has ended
        setup.rig.head.hold = threading.Event()
        setup.rig.head.looking.clear()
        look = head.begin_look(THERE)
        assert setup.rig.head.looking.wait(PATIENCE_S)
        assert hardware.halt()
        assert setup.rig.mirrors.commands[-1] == "park"
        setup.rig.head.hold.set()  # the look moves the mirrors after the stop ...
        look.result()
        hardware.submit(lambda rig: None).result(PATIENCE_S)
    assert setup.rig.mirrors.commands[-2:] == ["steer", "park"]  # ... and is parked again
    assert setup.rig.mirrors.volts == PARKED
    assert hardware.gaze == PARKED


def test_a_move_that_the_stop_overtakes_is_parked_again(
    setup: HardwareSetup, monkeypatch: pytest.MonkeyPatch
) -> None:
    hardware, steer = setup.start(), setup.rig.mirrors.steer

    def steer_late(volts: StereoVolts) -> StereoVolts:
        assert hardware.halt()
        return steer(volts)

    monkeypatch.setattr(setup.rig.mirrors, "steer", steer_late)
    hardware.steer(THERE).result(PATIENCE_S)
    assert setup.rig.mirrors.commands[-2:] == ["steer", "park"]
    assert setup.rig.mirrors.volts == hardware.gaze == PARKED


def test_a_still_that_the_stop_overtakes_leaves_the_mirrors_at_rest(setup: HardwareSetup) -> None:
    hardware = setup.start()

    def expose_late(_: object) -> None:
        assert hardware.halt()
        setup.rig.mirrors.steer(THERE)  # a pulse carries a position

    with hardware.session("a still", cancelled=never) as head:
        StillRigAccess(hardware, head, clock=setup.clock).run_moving(expose_late)
    assert setup.rig.mirrors.commands[-2:] == ["steer", "park"]
    assert setup.rig.mirrors.volts == PARKED


def test_while_stopped_the_wide_view_goes_on_and_nobody_looks(setup: HardwareSetup) -> None:
    hardware = setup.start()
    hardware.halt()
    hardware.submit(lambda rig: None).result(PATIENCE_S)  # a live look under way has ended
    looks = setup.pictures.counts.get("left", 0)
    setup.pictures.wait_for_more("wide", more=5)  # of each of which a look is due
    assert setup.pictures.counts.get("left", 0) == looks


def test_mirrors_that_were_switched_off_are_not_moved(setup: HardwareSetup) -> None:
    hardware = setup.start()
    hardware.submit(lambda rig: hardware.mirrors.switch(rig, on=False)).result(PATIENCE_S)
    with pytest.raises(Stopped, match="switched off"):
        hardware.steer(THERE)
    with hardware.session("a job", cancelled=never) as head, pytest.raises(Stopped, match="switched off"):
        head.look(THERE)


def test_nothing_moves_until_the_stop_is_released(setup: HardwareSetup) -> None:
    hardware = setup.start()
    hardware.halt()
    with pytest.raises(Stopped, match="DELETE /api/v1/stop"):
        hardware.steer(THERE)
    with hardware.session("a job", cancelled=never) as head, pytest.raises(Stopped):
        head.look(THERE)
    assert hardware.status.state is RigState.STOPPED
    hardware.resume()
    assert hardware.steer(THERE).result(PATIENCE_S) == THERE


def test_lost_controller_is_told_and_the_mirrors_are_parked_when_it_returns(setup: HardwareSetup) -> None:
    hardware = setup.start()
    hardware.steer(THERE).result(PATIENCE_S)
    setup.rig.mirrors.lost = True
    assert setup.wait_for("device.fault")["device"] == "mirrors"
    assert hardware.status.state is RigState.DEGRADED
    with pytest.raises(NotConnected, match="plug it in"):
        hardware.steer(THERE)
    setup.pictures.wait_for_more("wide")  # the wide view goes on
    setup.rig.mirrors.commands.clear()
    setup.rig.mirrors.lost = False
    assert setup.wait_for("device.recovered") == {"device": "mirrors"}
    assert setup.rig.mirrors.commands[0] == "park"
    assert hardware.status.problems == ()


def test_one_late_answer_is_nobodys_fault_yet(setup: HardwareSetup) -> None:
    hardware = setup.start()
    with hardware.session("a job", cancelled=never) as head:
        setup.rig.head.failure = Timeout("a packet was lost")
        with pytest.raises(Timeout):
            head.look(THERE)
        setup.rig.head.failure = None
        head.look(THERE)
    assert hardware.status.problems == ()


def test_camera_that_does_not_deliver_is_named(setup: HardwareSetup) -> None:
    hardware = setup.start()
    setup.rig.head.failure = DeviceFault("camera right: exposure 5 was triggered and no frame came")
    assert setup.wait_for("device.fault")["device"] == "right"
    setup.rig.head.failure = None
    assert setup.wait_for("device.recovered") == {"device": "right"}
    assert hardware.status.state is RigState.READY


@pytest.mark.parametrize("role", list(Role))
def test_a_lost_camera_is_told_and_the_mirrors_rest_though_nobody_looks(
    setup: HardwareSetup, role: Role
) -> None:
    hardware = setup.start()
    camera = {Role.WIDE: setup.rig.wide, Role.LEFT: setup.rig.left, Role.RIGHT: setup.rig.right}[role]
    with hardware.session("job", cancelled=lambda: False):
        hardware.submit(lambda rig: rig.mirrors.steer(THERE)).result(PATIENCE_S)
        camera.failure = NotConnected(f"camera {role}: unplugged")
        assert setup.wait_for("device.fault")["device"] == role
        _wait_until(lambda: setup.rig.mirrors.volts == PARKED)
        assert setup.rig.mirrors.commands[-1] == "park"


def test_mirrors_whose_exposures_fail_are_not_called_back_before_one_succeeds(setup: HardwareSetup) -> None:
    hardware = setup.start()
    setup.rig.head.failure = DeviceFault("strobe timeout")
    setup.wait_for("device.fault")
    setup.rig.mirrors.commands.clear()
    _wait_until(lambda: "park" in setup.rig.mirrors.commands)  # it was tried again
    hardware.submit(lambda _rig: None).result(PATIENCE_S)
    assert [problem.device for problem in hardware.status.problems] == ["mirrors"]
    setup.rig.head.failure = None
    assert setup.wait_for("device.recovered") == {"device": "mirrors"}


def _wait_until(reached: Callable[[], bool]) -> None:
    over_s = time.monotonic() + PATIENCE_S
    while not reached():
        assert time.monotonic() < over_s
        threading.Event().wait(0.01)


def test_camera_on_probation_is_not_called_back_before_it_delivers(setup: HardwareSetup) -> None:
    hardware = setup.start()
    setup.rig.wide.failure = NotConnected("camera wide: unplugged")
    setup.wait_for("device.fault")
    setup.pictures.watching.clear()
    reconnected = threading.Event()
    connect = setup.rig.connect

    def connecting(*, watch: RigOpeningWatch | None = None) -> None:
        connect(watch=watch)
        reconnected.set()

    setup.rig.connect = connecting  # type: ignore[method-assign]
    assert reconnected.wait(PATIENCE_S)
    assert [problem.device for problem in hardware.status.problems] == ["wide"]
    setup.rig.wide.failure = None
    assert setup.wait_for("device.recovered") == {"device": "wide"}


def test_rig_that_cannot_be_opened_is_a_problem_and_not_the_end(tmp_path: Path) -> None:
    def broken() -> FakeRig:
        raise InvalidInput("rig file: unknown key 'mirors'", remedy="correct the key")

    with Store(tmp_path) as store:
        events = EventLog(store)
        hardware = HardwareThread(
            broken,
            sink=Pictures(),
            events=events,
            clock=MonotonicClock(),
            overlay=lambda _gaze: None,
            limits=LiveRates(),
        )
        hardware.start()
        assert hardware.wait_open(PATIENCE_S)
        problem = hardware.status.problems[0]
        with pytest.raises(NotConnected, match="mirors"):
            hardware.submit(lambda rig: None)
        hardware.close()
        events.close()
    assert (problem.device, problem.remedy) == ("rig", "correct the key")


def test_closing_releases_the_rig_and_refuses_what_waits(setup: HardwareSetup) -> None:
    hardware = setup.start()
    hardware.close()
    assert setup.rig.closed.is_set()
    with pytest.raises(NotConnected):
        hardware.submit(lambda rig: None)


def test_stop_answers_even_when_the_mirrors_do_not(setup: HardwareSetup) -> None:
    hardware = setup.start()
    cancelled: list[str] = []
    stop = StopSwitch(hardware, cancel_jobs=cancelled.append, events=setup.events)
    setup.rig.mirrors.lost = True
    assert not stop.engage("a test").parked
    assert stop.state.engaged
    assert cancelled == ["the stop was engaged"]
    assert not stop.release("a test").engaged


def test_stop_keeps_who_engaged_it_first(setup: HardwareSetup) -> None:
    stop = StopSwitch(setup.start(), cancel_jobs=lambda _reason: None, events=setup.events)
    stop.engage("Ada")
    stop.engage("Bob")
    assert stop.state.by == "Ada"
    stop.release("Cyd")
    told = [event.data["stop"] for event in setup.events.recent(200) if event.kind.startswith("stop.")]
    assert [(found["engaged"], found["by"]) for found in told] == [
        (True, "Ada"),
        (True, "Ada"),
        (False, None),
    ]


def test_rig_is_closed_and_opened_again_with_what_the_opener_says_by_then(setup: HardwareSetup) -> None:
    hardware = setup.start()
    first, second = setup.rig, FakeRig(MonotonicClock())
    second.name, second.pan_tilt = "Another rig", None
    setup.rig = second

    hardware.reopen("the set-up")

    assert first.closed.is_set()
    assert hardware.status.name == "Another rig"
    assert hardware.submit(lambda rig: rig.name).result(PATIENCE_S) == "Another rig"
    assert [step.device for step in hardware.opening.steps.every] == ["rig", *FIRST_DEVICES]
    hardware.steer(THERE).result(PATIENCE_S)


def test_problems_of_the_rig_that_was_closed_are_forgotten(setup: HardwareSetup) -> None:
    hardware = setup.start()
    setup.rig.wide.failure = NotConnected("camera wide: unplugged")
    setup.wait_for("device.fault")
    setup.rig = FakeRig(MonotonicClock())

    hardware.reopen("the set-up")

    assert hardware.status.problems == ()
    assert hardware.status.state is RigState.READY


def test_rig_that_a_job_has_is_not_closed(setup: HardwareSetup) -> None:
    hardware = setup.start()
    with (
        hardware.session("a job", cancelled=never),
        pytest.raises(Busy, match="open another rig: a job is using"),
    ):
        hardware.reopen("the set-up")
    assert not setup.rig.closed.is_set()


def test_steps_of_the_opening_stay_at_what_failed() -> None:
    steps = OpeningSteps(clock=VirtualClock())
    steps.begins("mirrors")
    assert [step.state for step in steps.every] == ["pending", "active", "pending", "pending", "pending"]
    steps.ends("mirrors", FakeProblem(device="mirrors", detail="no controller", remedy="plug it in"))
    steps.expect(["rail"])
    steps.begins("rail")
    steps.ends("rail", None)

    states = {step.device: step.state for step in steps.every}
    assert states == {
        "rig": "pending",
        "mirrors": "failed",
        "wide": "pending",
        "left": "pending",
        "right": "pending",
        "rail": "done",
    }
    assert (steps.every[1].detail, steps.every[1].remedy) == ("no controller", "plug it in")
