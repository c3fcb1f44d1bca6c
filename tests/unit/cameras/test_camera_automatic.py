"""A camera that sets its exposure or its rate itself is asked once a second what it runs with."""

from dataclasses import replace

import pytest
from tests.support.devices.fake_camera import RANGES, SETTINGS
from tests.support.devices.turned_camera import Bench

from foveacam_hardware.contract import AutoMode, CameraSettings, OutOfRange
from foveacam_hardware.drivers.cameras.ranges import refuse_outside
from foveacam_hardware.drivers.cameras.shared_state import NO_RANGES
from foveacam_hardware.drivers.cameras.watchdog import Watchdog, WatchdogTimeouts

MS = 1_000_000
CONTINUOUS = replace(SETTINGS, exposure_auto=AutoMode.CONTINUOUS)
ONCE = replace(SETTINGS, exposure_auto=AutoMode.ONCE)
FREE = replace(SETTINGS, frame_rate_auto=True)


def newest_exposure_ns(bench: Bench) -> int:
    bench.shared.clear()
    return bench.frame().exposure_ns


def test_settings_and_frames_tell_the_exposure_in_force_within_a_second() -> None:
    bench = Bench(settings=CONTINUOUS).streaming()
    bench.camera.sets_itself["exposure_ns"] = 12 * MS
    bench.turn_for(1.1)

    assert bench.worker.settings == replace(CONTINUOUS, exposure_ns=12 * MS)
    assert newest_exposure_ns(bench) == 12 * MS


def test_it_is_asked_again_every_second_and_not_more_often() -> None:
    bench = Bench(settings=CONTINUOUS).streaming()
    bench.turn_for(5.5)

    assert bench.camera.calls["read_settings"] == 5


def test_a_camera_set_by_hand_is_never_asked() -> None:
    bench = Bench().streaming()
    bench.turn_for(3.0)

    assert bench.camera.calls["read_settings"] == 0


def test_once_is_off_when_it_has_ended_and_nobody_asks_any_more() -> None:
    bench = Bench(settings=ONCE).streaming()
    bench.turn_for(1.1)
    assert bench.worker.settings.exposure_auto is AutoMode.ONCE

    bench.camera.sets_itself.update(exposure_ns=9 * MS, exposure_auto=AutoMode.OFF)
    bench.turn_for(3.0)

    assert bench.worker.settings == replace(SETTINGS, exposure_ns=9 * MS)
    assert bench.camera.calls["read_settings"] == 2


def test_a_rate_of_its_own_is_read_back_too() -> None:
    bench = Bench(settings=FREE).streaming()
    assert bench.worker.settings.frame_rate_hz == 200.0

    bench.camera.sets_itself["frame_rate_hz"] = 7.5
    bench.turn_for(1.1)

    assert bench.worker.settings.frame_rate_hz == 7.5


def test_a_camera_that_does_not_answer_that_question_is_lost() -> None:
    bench = Bench(settings=CONTINUOUS).streaming()
    bench.camera.blocks_ns["read_settings"] = 600 * MS
    bench.turn_until(bench.is_down, within_s=2.0)

    assert "asked to read its settings" in bench.shared.state.link.reason


def test_a_reopened_camera_goes_on_by_itself_from_where_it_was() -> None:
    bench = Bench(settings=CONTINUOUS).streaming()
    bench.camera.sets_itself["exposure_ns"] = 12 * MS
    bench.turn_for(1.1)
    bench.camera.dead = True
    bench.turn_until(bench.is_down, within_s=2.0)
    bench.camera.dead = False
    bench.turn_until(bench.is_up, within_s=5.0)

    assert bench.camera.taken[-1] == replace(CONTINUOUS, exposure_ns=12 * MS)


def test_switching_it_off_leaves_the_exposure_that_is_asked_for() -> None:
    bench = Bench(settings=CONTINUOUS).streaming()
    bench.do(lambda worker: worker.configure(SETTINGS))
    bench.turn_for(2.0)

    assert bench.worker.settings == SETTINGS
    assert bench.camera.calls["read_settings"] == 0


def test_a_camera_that_may_choose_longer_exposures_may_be_silent_for_longer() -> None:
    by_hand, itself = (
        Watchdog(settings, timeouts=WatchdogTimeouts(), now_ns=0).limit_ns
        for settings in (SETTINGS, CONTINUOUS)
    )
    watchdog = Watchdog(CONTINUOUS, timeouts=WatchdogTimeouts(), now_ns=0)
    watchdog.adjust(replace(CONTINUOUS, exposure_ns=2000 * MS, frame_rate_hz=0.5))

    assert (by_hand, itself) == (500 * MS, 1000 * MS)
    assert watchdog.limit_ns == 5000 * MS


@pytest.mark.parametrize("settings", [CONTINUOUS, ONCE, FREE])
def test_a_mode_that_a_camera_lacks_is_refused_in_a_sentence(settings: CameraSettings) -> None:
    ranges = replace(RANGES, exposure_autos=(AutoMode.OFF,), frame_rate_auto=False)
    with pytest.raises(OutOfRange, match=r"; it has none: switch it off|; give one in Hz"):
        refuse_outside(settings, ranges)


def test_a_mode_is_refused_with_those_that_there_are() -> None:
    ranges = replace(RANGES, exposure_autos=(AutoMode.OFF, AutoMode.CONTINUOUS))
    with pytest.raises(OutOfRange, match="automatic exposure, once, is not one of its own; use off, conti"):
        refuse_outside(ONCE, ranges)


def test_a_rig_file_may_leave_to_a_source_what_it_turns_out_to_lack() -> None:
    fixed = replace(NO_RANGES, pixel_formats=RANGES.pixel_formats)
    wish = replace(CONTINUOUS, exposure_ns=0, frame_rate_hz=0.0, frame_rate_auto=True)

    refuse_outside(replace(wish, frame_rate_hz=25.0), fixed, first=True)
    with pytest.raises(OutOfRange):
        refuse_outside(replace(wish, frame_rate_hz=25.0), fixed)
