"""A camera that is lost comes back by itself: every fault is played to its turns, in virtual time."""

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import pytest
from tests.support.devices.fake_camera import SETTINGS
from tests.support.devices.turned_camera import Bench

from foveacam_hardware.contract import (
    CameraPhase,
    CameraSettings,
    FoveaError,
    NotConnected,
    OutOfRange,
    PixelFormat,
    Timeout,
    TriggerSource,
)
from foveacam_hardware.drivers.cameras.device import Grab, GrabStatus
from foveacam_hardware.drivers.cameras.worker import CameraWorker

T = TypeVar("T")
MS = 1_000_000
S = 1_000_000_000
TRIGGERED = replace(SETTINGS, triggered=True)
COMMANDED = replace(TRIGGERED, trigger_source=TriggerSource.SOFTWARE)


# Delivering ------------------------------------------------------------------------------------------------


def test_frames_carry_the_middle_of_their_exposure_on_the_hosts_clock() -> None:
    bench = Bench().streaming()
    began_ns = bench.clock.now_ns()
    bench.frame()
    frame = bench.frame()

    assert frame.t_ns == began_ns + 20 * MS + SETTINGS.exposure_ns // 2
    assert (frame.epoch, frame.exposure_ns, frame.bits) == (1, 5 * MS, 8)


def test_the_oldest_frames_make_room_and_are_counted() -> None:
    bench = Bench(frames=3).streaming()
    bench.turn_for(0.2)
    waiting = [bench.shared.take_oldest() for _ in range(3)]

    assert [frame.seq for frame in waiting if frame] == [8, 9, 10]
    assert (bench.shared.counters.skipped, bench.shared.counters.dropped) == (8, 0)
    assert bench.shared.counters.delivered == 3


def spoilt(change: dict[str, object]) -> Callable[[Grab], Grab]:
    return lambda grab: replace(grab, **change)  # type: ignore[arg-type]  # one field each


@pytest.mark.parametrize(
    "change", [{"status": GrabStatus.INCOMPLETE}, {"image": None}, {"number": 1}], ids=str
)
def test_a_broken_frame_reaches_nobody_and_is_counted(change: dict[str, object]) -> None:
    bench = Bench().streaming()
    first = bench.frame()
    bench.camera.spoil.append(spoilt(change))
    second = bench.frame()

    assert second.seq > first.seq
    assert bench.shared.counters.incomplete == 1
    assert bench.is_up()


def test_frames_lost_on_the_cable_are_counted_and_leave_a_gap() -> None:
    bench = Bench().streaming()
    first = bench.frame()
    bench.camera.lost_frames = 2

    assert bench.frame().seq == first.seq + 3
    assert (bench.shared.counters.skipped, bench.shared.counters.dropped) == (0, 2)


def test_many_broken_frames_degrade_the_camera_until_they_are_over() -> None:
    bench = Bench().streaming()
    bench.camera.spoil.extend([spoilt({"image": None})] * 5)
    bench.turn_for(0.2)
    assert bench.phase is CameraPhase.DEGRADED
    assert "packets are missing" in bench.shared.state.link.reason

    bench.turn_for(2.1)
    assert bench.is_up()


def test_frames_that_found_no_buffer_are_counted() -> None:
    bench = Bench().streaming()
    bench.camera.underruns = 4
    bench.turn_for(1.1)

    assert bench.shared.counters.underrun == 4


# Being lost ------------------------------------------------------------------------------------------------


def test_a_free_running_camera_that_falls_silent_is_degraded_then_lost_within_a_second() -> None:
    bench = Bench().streaming()
    bench.frame()
    bench.camera.silent = True

    bench.turn_until(lambda: bench.phase is CameraPhase.DEGRADED, within_s=0.4)
    bench.turn_until(bench.is_down, within_s=0.6)
    assert "no frame for 0.5 s" in bench.shared.state.link.reason


def test_a_silent_triggered_camera_is_asked_and_stays_streaming() -> None:
    bench = Bench(settings=TRIGGERED).streaming()
    bench.turn_for(10.0)

    assert bench.is_up()
    assert 25 <= bench.camera.calls["alive"] <= 35


@pytest.mark.parametrize("settings", [SETTINGS, TRIGGERED, COMMANDED], ids=["free", "line", "command"])
def test_a_camera_that_dies_is_lost_within_a_second(settings: CameraSettings) -> None:
    bench = Bench(settings=settings).streaming()
    bench.turn_for(0.5)
    bench.camera.dead = True

    assert bench.turn_until(bench.is_down, within_s=1.0) <= 1.0


def test_a_camera_that_dies_before_it_was_started_is_noticed() -> None:
    bench = Bench()
    bench.do(CameraWorker.connect)
    bench.camera.dead = True

    bench.turn_until(bench.is_down, within_s=1.0)


def test_a_call_that_took_too_long_loses_the_camera_though_it_returned() -> None:
    bench = Bench(settings=TRIGGERED).streaming()
    bench.camera.blocks_ns["alive"] = 2500 * MS
    bench.turn_until(bench.is_down, within_s=4.0)

    assert "has not answered for 2.5 s" in bench.shared.state.link.reason


# Coming back -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("outage_s", [0.7, 3.0, 30.0, 600.0])
def test_a_camera_is_back_within_five_seconds_of_its_return(outage_s: float) -> None:
    bench = Bench().streaming()
    bench.camera.dead = True
    bench.camera.blocks_ns["open"] = 1_000 * MS  # looking for it takes a second, in vain or not
    bench.turn_for(outage_s)
    bench.camera.dead = False

    assert bench.turn_until(bench.is_up, within_s=5.0) <= 4.0


def test_a_reopened_camera_counts_an_epoch_goes_on_numbering_and_has_no_stale_frame() -> None:
    bench = Bench().streaming()
    before = [bench.frame().seq for _ in range(3)]
    bench.turn_for(0.05)  # more frames wait, unread
    bench.camera.dead = True
    bench.turn_until(bench.is_down, within_s=1.0)
    assert bench.shared.take_oldest() is None
    assert bench.shared.take_newest(oldest_ns=0) is None
    bench.camera.dead = False
    bench.turn_until(bench.is_up, within_s=5.0)
    frame = bench.frame()

    assert frame.epoch == 2
    assert frame.seq > before[-1]


def test_a_reopened_camera_has_all_its_settings_again() -> None:
    bench = Bench().streaming()
    chosen = replace(
        COMMANDED, exposure_ns=7 * MS, gain_db=3.0, pixel_format=PixelFormat.MONO12P, black_level=5.0
    )
    taken = bench.do(lambda worker: worker.configure(chosen))
    bench.camera.dead = True
    bench.turn_until(bench.is_down, within_s=1.0)
    bench.camera.dead = False
    bench.camera.taken.clear()
    bench.turn_until(bench.is_up, within_s=5.0)

    assert bench.camera.taken == [taken]
    assert bench.worker.settings == chosen


def test_a_camera_that_was_only_open_is_only_opened_again() -> None:
    bench = Bench()
    bench.do(CameraWorker.connect)
    bench.camera.dead = True
    bench.turn_until(bench.is_down, within_s=1.0)
    bench.camera.dead = False

    bench.turn_until(lambda: bench.phase is CameraPhase.READY, within_s=5.0)
    assert bench.camera.calls["start"] == 0


@pytest.mark.parametrize(
    ("attribute", "value", "words"), [("present", False, "not found"), ("held_by", "a viewer", "held by")]
)
def test_a_camera_that_cannot_be_opened_is_tried_until_it_can(
    attribute: str, value: object, words: str
) -> None:
    bench = Bench()
    setattr(bench.camera, attribute, value)
    with pytest.raises(NotConnected, match=words):
        bench.do(CameraWorker.connect)
    assert bench.phase is CameraPhase.BACKOFF
    assert words in bench.shared.state.link.reason
    bench.turn_for(20.0)
    assert 8 <= bench.camera.calls["open"] <= 14  # pauses of 0.25, 0.5, 1, then 2 s
    setattr(bench.camera, attribute, True if attribute == "present" else None)

    bench.turn_until(lambda: bench.phase is CameraPhase.READY, within_s=2.5)


def test_a_slow_opening_is_no_failure() -> None:
    bench = Bench()
    bench.camera.blocks_ns["open"] = 6 * S
    bench.do(CameraWorker.connect)

    assert bench.phase is CameraPhase.READY


def test_a_camera_that_fails_while_it_is_opened_is_given_back() -> None:
    bench = Bench()
    bench.camera.blocks_ns["configure"] = 6 * S
    with pytest.raises(Timeout, match="configure"):
        bench.do(CameraWorker.connect)

    assert bench.camera.calls["close"] == 1


def test_a_closed_camera_is_not_opened_again() -> None:
    bench = Bench().streaming()
    bench.do(CameraWorker.close)

    assert not bench.worker.running
    assert bench.phase is CameraPhase.CLOSED
    assert bench.camera.calls["stop"] == 1  # a camera must not go on sending to nobody
    assert bench.camera.calls["open"] == 1


# Settings and triggers -------------------------------------------------------------------------------------


def test_refused_settings_change_nothing_and_frames_go_on() -> None:
    bench = Bench().streaming()
    before = bench.worker.settings
    with pytest.raises(OutOfRange, match="20 dB"):
        bench.do(lambda worker: worker.configure(replace(SETTINGS, gain_db=23.0)))

    assert bench.worker.settings == before
    assert bench.camera.taken[-1] == before
    assert bench.frame().epoch == 1


def test_new_settings_throw_away_the_frames_of_the_old() -> None:
    bench = Bench().streaming()
    bench.turn_for(0.1)
    bench.do(lambda worker: worker.configure(replace(SETTINGS, exposure_ns=9 * MS)))

    assert bench.frame().exposure_ns == 9 * MS


def test_a_command_exposes_once() -> None:
    bench = Bench(settings=COMMANDED).streaming()
    bench.turn_for(0.3)
    assert bench.shared.waiting == 0
    bench.do(CameraWorker.trigger)

    assert bench.frame().seq == 0
    bench.turn_for(0.3)
    assert bench.shared.waiting == 0


def test_a_command_that_gave_no_frame_is_counted() -> None:
    bench = Bench(settings=COMMANDED).streaming()
    bench.camera.silent = True
    bench.do(CameraWorker.trigger)
    bench.turn_for(1.5)

    assert bench.shared.counters.dropped == 1
    assert bench.is_up()


def test_an_edge_on_the_line_exposes_once() -> None:
    bench = Bench(settings=TRIGGERED).streaming()
    bench.turn_for(0.1)
    pulse_ns = bench.clock.now_ns()
    bench.camera.pulse()

    assert bench.frame().t_ns == pytest.approx(pulse_ns + TRIGGERED.exposure_ns // 2, abs=1 * MS)


def test_no_fault_is_told_to_a_caller_in_other_words_than_the_contracts() -> None:
    bench = Bench()
    bench.camera.dead = True

    with pytest.raises(FoveaError):
        bench.do(CameraWorker.connect)
    with pytest.raises(NotConnected, match="asked to start, but it is not connected"):
        bench.do(CameraWorker.start)
