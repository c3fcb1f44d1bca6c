import math
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from tests.support.devices.fake_rig import FakeMirrors
from tests.support.devices.hardware_setup import PATIENCE_S, POLL_S, HardwareSetup, hardware_setup, never

from foveacam_hardware.contract import (
    PARKED,
    Busy,
    MirrorVolts,
    NotConnected,
    StereoVolts,
    Stopped,
    VirtualClock,
)
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.store import Store
from foveacam_server.rig import hand_steering
from foveacam_server.rig.hand_steering import TAU_S, HandSteering, SteeringCourse, SteeringStatus, slewed
from foveacam_server.rig.hardware import HardwareThread

THERE = StereoVolts(left=MirrorVolts(x_v=50.0, y_v=-20.0), right=MirrorVolts(x_v=40.0, y_v=0.0))
ASIDE = StereoVolts(left=MirrorVolts(x_v=-50.0, y_v=0.0), right=MirrorVolts(x_v=0.0, y_v=10.0))
FREE_V = 400.0


@pytest.fixture
def setup(tmp_path: Path) -> Iterator[HardwareSetup]:
    with hardware_setup(tmp_path) as found:
        yield found


def eventually(shown: Callable[[], bool]) -> bool:
    waiting = threading.Event()
    for _ in range(round(PATIENCE_S / POLL_S)):
        if shown():
            return True
        waiting.wait(POLL_S)
    return False


def keep_alive(hardware: HardwareThread, course: SteeringCourse, until: Callable[[], bool]) -> None:
    """Speak as a client does until something shows."""

    def shown() -> bool:
        hardware.hand.record_message(course)
        return until()

    assert eventually(shown)


# The slew ---------------------------------------------------------------------------------------------------


def test_the_way_to_a_target_is_exponential_whatever_the_period_of_the_updates() -> None:
    for period_s in (0.001, 0.004):
        pose = PARKED
        for _ in range(round(TAU_S / period_s)):
            pose = slewed(pose, THERE, dt_s=period_s, most_v=FREE_V)
        assert pose.left.x_v == pytest.approx(50.0 * (1.0 - math.exp(-1.0)), rel=1e-9)
        assert pose.left.y_v == pytest.approx(-20.0 * (1.0 - math.exp(-1.0)), rel=1e-9)


def test_a_target_is_reached_exactly() -> None:
    pose, steps = PARKED, 0
    while pose != THERE:
        pose, steps = slewed(pose, THERE, dt_s=0.001, most_v=FREE_V), steps + 1
    assert steps < 100


def test_no_step_exceeds_the_drivers_slew_limit() -> None:
    pose, steps_v = PARKED, []
    while pose != THERE:
        after = slewed(pose, THERE, dt_s=0.001, most_v=2.0)
        steps_v.append((abs(after.left.x_v - pose.left.x_v), abs(after.left.y_v - pose.left.y_v)))
        pose = after
    assert np.max(steps_v, axis=0) == pytest.approx([2.0, 2.0])  # up in x, down in y


def test_updates_that_are_far_apart_lead_further(tmp_path: Path) -> None:
    clock, sent = VirtualClock(), list[StereoVolts]()

    class SlowMirrors(FakeMirrors):
        def steer(self, volts: StereoVolts, *, unless_parked_since: int | None = None) -> StereoVolts:
            clock.sleep_until_ns(clock.now_ns() + round(TAU_S * 1e9))
            return super().steer(volts, unless_parked_since=unless_parked_since)

    mirrors = SlowMirrors()
    with Store(tmp_path) as store, closing(EventLog(store)) as events:
        hand = HandSteering(
            clock=clock,
            mirrors=lambda: mirrors,
            check=lambda: None,
            park=lambda _: Future(),
            on_pose=sent.append,
            events=events,
        )
        hand.start()
        course = hand.press("me", THERE, held=False)
        assert eventually(lambda: course.pose == THERE)
        hand.close()

    left_v = [50.0 - volts.left.x_v for volts in sent[:3]]
    assert left_v[1] / left_v[0] == pytest.approx(math.exp(-1.0), rel=1e-6)
    assert left_v[2] / left_v[1] == pytest.approx(math.exp(-1.0), rel=1e-6)


# Courses ----------------------------------------------------------------------------------------------------


def test_mirrors_go_to_the_newest_target_and_stay_there_when_released(setup: HardwareSetup) -> None:
    hardware, mirrors = setup.start(), setup.rig.mirrors
    course = hardware.hand.press("Ada", THERE, held=True)
    hardware.hand.record_message(course, ASIDE)
    keep_alive(hardware, course, lambda: mirrors.volts == ASIDE)

    hardware.hand.release(course)

    assert eventually(lambda: hardware.hand.by is None)
    setup.pictures.wait_for_more("left", more=3)  # live looks go on where it has steered
    assert (mirrors.volts, hardware.gaze) == (ASIDE, ASIDE)
    assert hardware.hand.status(course) is SteeringStatus.RELEASED


def test_live_views_go_on_while_somebody_steers_and_pull_nothing_back(setup: HardwareSetup) -> None:
    hardware, mirrors = setup.start(), setup.rig.mirrors
    course = hardware.hand.press("Ada", THERE, held=True)
    keep_alive(hardware, course, lambda: mirrors.volts == THERE)
    before = setup.pictures.counts.get("left", 0)
    keep_alive(hardware, course, lambda: setup.pictures.counts["left"] >= before + 5)
    assert mirrors.volts == hardware.gaze == THERE
    hardware.hand.release(course)


def test_a_single_move_needs_nobody_who_holds_on(setup: HardwareSetup) -> None:
    hardware = setup.start()
    hardware.hand.press("Ada", THERE, held=False)
    assert eventually(lambda: setup.rig.mirrors.volts == THERE)
    assert hardware.hand.by is None


def test_silence_holds_the_mirrors_then_parks_them(
    setup: HardwareSetup, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hand_steering, "PARK_S", 0.5)
    hardware, mirrors = setup.start(), setup.rig.mirrors
    course = hardware.hand.press("Ada", THERE, held=True)
    keep_alive(hardware, course, lambda: mirrors.volts == THERE)

    assert eventually(lambda: hardware.hand.status(course) is SteeringStatus.SILENT)
    assert mirrors.volts == THERE

    assert eventually(lambda: mirrors.volts == PARKED)
    assert eventually(lambda: hardware.hand.status(course) is SteeringStatus.ENDED)
    assert "no message came" in (course.over or "")
    assert hardware.gaze == PARKED
    setup.pictures.wait_for_more("left", more=3)
    assert mirrors.volts == PARKED


def silent_s(course: SteeringCourse, *, after_s: float, blocked_s: float) -> float:
    return course.silent_s(
        course.message_ns + round(1e9 * after_s), blocked_ns=course.blocked_ns + round(1e9 * blocked_s)
    )


def test_time_in_which_the_server_itself_did_not_read_is_no_silence(setup: HardwareSetup) -> None:
    course = setup.start().hand.press("Ada", THERE, held=True)
    parked_s = hand_steering.SILENT_S + hand_steering.PARK_S
    excused_s = hand_steering.EXCUSED_NS / 1e9
    assert silent_s(course, after_s=3.4, blocked_s=3.3) < hand_steering.SILENT_S
    assert silent_s(course, after_s=3.4, blocked_s=0.0) >= parked_s  # a real silence
    assert silent_s(course, after_s=1.0 + parked_s, blocked_s=1.0) >= parked_s  # a block in a real silence
    assert silent_s(course, after_s=excused_s + parked_s, blocked_s=60.0) >= parked_s  # a server that hangs


def test_a_loop_that_never_reads_again_leaves_nothing_steered_for_ever(
    setup: HardwareSetup, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hand_steering, "PARK_S", 0.2)
    monkeypatch.setattr(hand_steering, "EXCUSED_NS", 500_000_000)
    hardware, mirrors = setup.start(), setup.rig.mirrors
    monkeypatch.setattr(hardware.hand, "_blocked_ns", setup.clock.now_ns)  # blocked all the time
    course = hardware.hand.press("Ada", THERE, held=True)
    assert eventually(lambda: hardware.hand.status(course) is SteeringStatus.ENDED)
    assert (course.over, mirrors.volts) == ("no message came for 0.45 s: the mirrors were parked", PARKED)


def test_a_client_that_speaks_again_in_time_goes_on(setup: HardwareSetup) -> None:
    hardware, mirrors = setup.start(), setup.rig.mirrors
    course = hardware.hand.press("Ada", THERE, held=True)
    assert eventually(lambda: hardware.hand.status(course) is SteeringStatus.SILENT)

    hardware.hand.record_message(course, ASIDE)

    keep_alive(hardware, course, lambda: mirrors.volts == ASIDE)
    hardware.hand.release(course)


def test_a_client_that_is_gone_holds_the_mirrors_at_once(setup: HardwareSetup) -> None:
    hardware = setup.start()
    course = hardware.hand.press("Ada", THERE, held=True)
    hardware.hand.lose(course)
    assert hardware.hand.status(course) is SteeringStatus.SILENT
    assert hardware.hand.by is None  # another may take them
    other = hardware.hand.press("Bob", ASIDE, held=True)
    assert "Bob steers" in (course.over or "")
    hardware.hand.release(other)


def test_one_hand_at_a_time(setup: HardwareSetup) -> None:
    hardware = setup.start()
    course = hardware.hand.press("Ada", THERE, held=True)
    with pytest.raises(Busy, match="Ada steers the mirrors by hand"):
        hardware.hand.press("Bob", ASIDE, held=True)
    with pytest.raises(Busy, match="Ada steers"):
        hardware.steer(ASIDE)
    with pytest.raises(Busy, match="Ada steers"):
        hardware.park()
    hardware.hand.release(course)
    assert hardware.steer(ASIDE).result(PATIENCE_S) == ASIDE
    assert hardware.park().result(PATIENCE_S) is None
    assert setup.rig.mirrors.volts == PARKED


def test_after_a_stop_nothing_moves_until_a_new_press(setup: HardwareSetup) -> None:
    hardware, mirrors = setup.start(), setup.rig.mirrors
    course = hardware.hand.press("Ada", THERE, held=True)
    keep_alive(hardware, course, lambda: mirrors.volts == THERE)

    hardware.halt()
    hardware.hand.record_message(course, ASIDE)

    keep_alive(hardware, course, lambda: hardware.hand.status(course) is SteeringStatus.ENDED)
    assert course.over == "the stop is engaged"
    assert (mirrors.commands[-1], mirrors.volts) == ("park", PARKED)
    with pytest.raises(Stopped):
        hardware.hand.press("Ada", ASIDE, held=True)
    hardware.resume()
    hardware.hand.record_message(course, ASIDE)
    setup.pictures.wait_for_more("left", more=2)
    assert mirrors.volts == PARKED
    hardware.hand.release(hardware.hand.press("Ada", ASIDE, held=True))
    assert eventually(lambda: mirrors.volts == ASIDE)


def test_a_job_takes_the_rig_and_nothing_of_the_hand_comes_after(setup: HardwareSetup) -> None:
    hardware, mirrors = setup.start(), setup.rig.mirrors
    course = hardware.hand.press("Ada", THERE, held=True)
    with hardware.session("job 7", cancelled=never) as head:
        assert course.over == "job 7 uses the rig"
        head.look(ASIDE)
        hardware.hand.record_message(course, THERE)
        head.wide()
        assert mirrors.volts == ASIDE
        with pytest.raises(Busy, match="job 7 is using the rig"):
            hardware.hand.press("Ada", THERE, held=True)
    hardware.hand.press("Ada", THERE, held=False)
    assert eventually(lambda: mirrors.volts == THERE)


def test_mirrors_stand_still_for_an_exposure_but_not_for_a_long_one(setup: HardwareSetup) -> None:
    hardware, mirrors = setup.start(), setup.rig.mirrors
    mirrors.exposing = True
    began_s = time.monotonic()
    hardware.hand.press("Ada", THERE, held=False)
    assert eventually(lambda: mirrors.volts == THERE)
    assert time.monotonic() - began_s >= hand_steering.EXPOSURE_HOLD_S


def test_a_lost_controller_ends_it_with_the_reason(setup: HardwareSetup) -> None:
    hardware, mirrors = setup.start(), setup.rig.mirrors
    course = hardware.hand.press("Ada", THERE, held=True)
    keep_alive(hardware, course, lambda: mirrors.volts == THERE)
    mirrors.lost = True
    hardware.hand.record_message(course, ASIDE)
    keep_alive(hardware, course, lambda: course.over is not None)
    assert "no controller" in (course.over or "")
    setup.wait_for("device.fault")
    with pytest.raises(NotConnected):
        hardware.hand.press("Ada", THERE, held=True)
