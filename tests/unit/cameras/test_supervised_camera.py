"""Callers of a camera wait no longer than they said, whatever the vendor's library does in its thread."""

import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace

import pytest
from tests.support.devices.fake_camera import SETTINGS, FakeCamera, supervised

from foveacam_hardware.contract import (
    CameraPhase,
    InvalidInput,
    MonotonicClock,
    NotConnected,
    OutOfRange,
    PixelFormat,
    Timeout,
    TriggerSource,
)
from foveacam_hardware.drivers.cameras.supervised import SupervisedCamera
from foveacam_hardware.drivers.cameras.watchdog import WatchdogTimeouts

MS = 1_000_000
QUICK = WatchdogTimeouts(
    call_ns=1_000 * MS,
    alive_ns=300 * MS,
    ask_ns=50 * MS,
    abandon_ns=200 * MS,
    reconnect_ns=150 * MS,
    backoff_first_ns=20 * MS,
    backoff_most_ns=80 * MS,
)
HELD_S = 10.0
"""Half as long as a call hangs: who returns before was not held by it."""
TRIGGERED = replace(SETTINGS, triggered=True)
COMMANDED = replace(TRIGGERED, trigger_source=TriggerSource.SOFTWARE)
DOWN = (CameraPhase.LOST, CameraPhase.BACKOFF, CameraPhase.OPENING)


@pytest.fixture
def device() -> FakeCamera:
    return FakeCamera(MonotonicClock())


@contextmanager
def streaming(camera: SupervisedCamera) -> Iterator[SupervisedCamera]:
    camera.connect()
    camera.start()
    try:
        yield camera
    finally:
        camera.close()


@contextmanager
def hanging(device: FakeCamera, call: str) -> Iterator[None]:
    """Let a call never return; let it go at the end, so that no thread stays."""
    release = threading.Event()
    device.hangs[call] = release
    try:
        yield
    finally:
        device.hangs.pop(call, None)
        release.set()


def becomes(reached: Callable[[], bool]) -> None:
    """Wait until something is so."""
    began_s = time.monotonic()
    waiting = threading.Event()
    while not reached():
        assert time.monotonic() - began_s < HELD_S, "it did not become so"
        waiting.wait(0.005)


def test_frames_come_in_order_with_their_epoch(device: FakeCamera) -> None:
    with streaming(supervised(device)) as camera:
        frames = list(camera.frames(3))
        skipped = camera.counters.skipped  # none, unless this machine stood still for a while

    numbers = [frame.seq for frame in frames]
    assert numbers == sorted(set(numbers))
    assert numbers[-1] <= 2 + skipped
    assert {frame.epoch for frame in frames} == {1}


def test_a_call_that_hangs_is_a_timeout_for_its_caller_and_says_what_hangs(device: FakeCamera) -> None:
    with streaming(supervised(device, timeouts=QUICK)) as camera, hanging(device, "configure"):
        began_s = time.monotonic()
        with pytest.raises(Timeout, match=r"camera left: asked to configure.*has not answered"):
            camera.configure(replace(SETTINGS, gain_db=3.0))

        assert time.monotonic() - began_s < HELD_S
        becomes(lambda: camera.link.phase in DOWN)


def test_a_command_does_not_wait_behind_a_call_that_hangs(device: FakeCamera) -> None:
    timeouts = replace(QUICK, call_ns=60_000 * MS, alive_ns=300 * MS, abandon_ns=500 * MS)
    with (
        streaming(supervised(device, settings=TRIGGERED, timeouts=timeouts)) as camera,
        hanging(device, "alive"),
    ):
        asked = device.calls["alive"]
        becomes(lambda: device.calls["alive"] > asked)
        began_s = time.monotonic()
        with pytest.raises(Timeout, match=r"camera left: asked to configure.*asked to read a register"):
            camera.configure(replace(TRIGGERED, gain_db=3.0))

        assert time.monotonic() - began_s < HELD_S  # its own deadline is a minute


def test_a_reader_is_not_held_by_a_library_that_hangs(device: FakeCamera) -> None:
    with streaming(supervised(device, timeouts=QUICK)) as camera:
        camera.read()
        with hanging(device, "grab"):
            began_s = time.monotonic()
            with pytest.raises((NotConnected, Timeout), match="camera left"):
                list(camera.frames(20, timeout_ms=2000.0))

            assert time.monotonic() - began_s < HELD_S


def test_a_triggered_camera_that_hangs_is_lost_as_soon_as_its_answer_is_overdue(device: FakeCamera) -> None:
    with (
        streaming(supervised(device, settings=TRIGGERED, timeouts=QUICK)) as camera,
        hanging(device, "alive"),
    ):
        becomes(lambda: "read a register" in (seen := camera.link).reason and seen.phase in DOWN)


def test_a_thread_that_hangs_for_good_is_replaced_and_the_camera_comes_back(device: FakeCamera) -> None:
    timeouts = replace(
        QUICK, abandon_ns=1_000 * MS
    )  # time enough to see that it hangs, and to let the next go
    with streaming(supervised(device, timeouts=timeouts)) as camera:
        camera.configure(replace(SETTINGS, gain_db=4.0))
        last_seq = camera.read().seq
        release = threading.Event()
        device.hangs["grab"] = release
        becomes(lambda: camera.link.phase in DOWN)
        del device.hangs["grab"]
        becomes(lambda: camera.link.phase is CameraPhase.STREAMING)
        frame = camera.read()
        release.set()

        assert frame.epoch == 2
        assert frame.seq > last_seq
        assert camera.settings.gain_db == 4.0
    becomes(lambda: not camera_threads())


def test_a_camera_that_stops_while_it_counts_is_noticed(device: FakeCamera) -> None:
    with streaming(supervised(device)) as camera:
        camera.read()
        with hanging(device, "underruns"):
            becomes(lambda: "asked to count" in (seen := camera.link).reason and seen.phase in DOWN)


def camera_threads() -> list[threading.Thread]:
    return [thread for thread in threading.enumerate() if thread.name == "camera-left"]


def test_a_reader_hears_at_once_that_the_camera_was_lost(device: FakeCamera) -> None:
    with streaming(supervised(device, settings=TRIGGERED)) as camera, ThreadPoolExecutor(1) as reader:
        read = reader.submit(camera.read, timeout_ms=20_000.0)
        device.dead = True

        with pytest.raises(NotConnected, match="camera left: asked to read, but it is not connected"):
            read.result(timeout=5.0)


def test_connecting_to_a_camera_known_to_be_lost_takes_only_a_moment(device: FakeCamera) -> None:
    device.present = False
    camera = supervised(device, timeouts=QUICK)
    with pytest.raises(NotConnected, match="camera left: serial F-1 is not found"):
        camera.connect()
    with hanging(device, "open"):
        began_s = time.monotonic()
        with pytest.raises(NotConnected, match="camera left"):
            camera.connect()

        assert time.monotonic() - began_s < HELD_S
    camera.close()


def test_a_camera_that_is_plugged_in_later_only_needs_a_start(device: FakeCamera) -> None:
    device.present = False
    camera = supervised(device, timeouts=QUICK)
    with pytest.raises(NotConnected):
        camera.connect()
    device.present = True
    becomes(lambda: camera.link.phase is CameraPhase.READY)
    camera.connect()
    camera.start()

    assert camera.read().epoch == 1
    camera.close()


def test_closing_is_not_held_by_a_library_that_hangs(device: FakeCamera) -> None:
    camera = supervised(device, timeouts=QUICK)
    camera.connect()
    with hanging(device, "close"):
        began_s = time.monotonic()
        camera.close()
        assert time.monotonic() - began_s < HELD_S
    assert camera.link.phase is CameraPhase.CLOSED
    becomes(lambda: not camera_threads())


def test_a_closed_camera_leaves_no_thread_and_opens_again(device: FakeCamera) -> None:
    camera = supervised(device)
    for epoch in (1, 2):
        with streaming(camera):
            assert camera.read().epoch == epoch
        camera.close()
        assert not camera_threads()
    with pytest.raises(NotConnected, match="connect it"):
        camera.start()


def test_settings_outside_of_its_ranges_are_refused_before_it_is_asked(device: FakeCamera) -> None:
    with streaming(supervised(device)) as camera:
        asked = device.calls["configure"]
        for change in (
            {"exposure_ns": 10},
            {"gain_db": float("nan")},
            {"frame_rate_hz": 1000.0},
            {"black_level": -1.0},
            {"pixel_format": PixelFormat.RGB8},
        ):
            with pytest.raises(OutOfRange, match="camera left"):
                camera.configure(replace(SETTINGS, **change))

        assert device.calls["configure"] == asked


def test_a_triggered_camera_is_as_fast_as_its_trigger_but_not_endlessly(device: FakeCamera) -> None:
    with streaming(supervised(device)) as camera:
        camera.configure(replace(TRIGGERED, frame_rate_hz=5000.0))
        for rate_hz in (0.0, -1.0, float("inf"), float("nan")):
            with pytest.raises(OutOfRange, match="camera left: frame rate"):
                camera.configure(replace(TRIGGERED, frame_rate_hz=rate_hz))


def test_a_rig_file_that_asks_too_much_is_told_when_the_camera_is_opened(device: FakeCamera) -> None:
    camera = supervised(device, settings=replace(SETTINGS, exposure_ns=2_000_000_000))
    with pytest.raises(OutOfRange, match=r"camera left: exposure 2000 ms is outside 0\.01 to 1000 ms"):
        camera.connect()
    camera.close()


def test_a_refusal_of_the_device_names_the_camera(device: FakeCamera) -> None:
    with (
        streaming(supervised(device)) as camera,
        pytest.raises(OutOfRange, match="camera left: gain above 20 dB"),
    ):
        camera.configure(replace(SETTINGS, gain_db=23.0))


def test_only_a_camera_that_waits_for_commands_takes_one(device: FakeCamera) -> None:
    with streaming(supervised(device)) as camera:
        with pytest.raises(InvalidInput, match="configure it as triggered by software"):
            camera.software_trigger()
        camera.configure(COMMANDED)
        with pytest.raises(Timeout, match="no trigger"):
            camera.read(timeout_ms=30.0)
        camera.software_trigger()

        assert camera.read().seq >= 0


def test_the_newest_frame_is_repeated_while_it_is_young_enough(device: FakeCamera) -> None:
    with streaming(supervised(device, settings=TRIGGERED)) as camera:
        device.pulse()
        first = camera.latest(max_age_ms=10_000.0)

        assert camera.latest(max_age_ms=10_000.0) is first
        assert camera.counters.delivered == 1


def test_two_readers_share_the_frames_and_none_is_given_twice(device: FakeCamera) -> None:
    with streaming(supervised(device)) as camera, ThreadPoolExecutor(2) as readers:
        numbers = [read.result().seq for read in [readers.submit(camera.read) for _ in range(12)]]

    assert len(set(numbers)) == 12


def test_before_it_is_opened_a_camera_says_what_is_expected_of_it(device: FakeCamera) -> None:
    camera = supervised(device)

    assert camera.info.serial == "F-1"
    assert camera.settings == SETTINGS
    assert camera.ranges.pixel_formats == ()
    assert (camera.link.phase, camera.link.epoch) == (CameraPhase.CLOSED, 0)
