"""The contract of a camera, run on every driver: scripted, emulated by its vendor, or on a real rig.

What only a simulated world can show (light, noise, virtual time) stands in test_cameras.py.
"""

import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from tests.support.devices.camera_kinds import NewCamera, kinds_of

from foveacam_hardware.contract import (
    AutoMode,
    Camera,
    CameraPhase,
    CameraRanges,
    CameraSettings,
    FoveaError,
    InvalidInput,
    NotConnected,
    OutOfRange,
    PixelFormat,
    Timeout,
    TriggerSource,
)

PATIENCE_MS = 5000.0
STRETCHES = 5
GREY = (PixelFormat.MONO8, PixelFormat.MONO12, PixelFormat.MONO12P)
DEEP = (PixelFormat.MONO12, PixelFormat.MONO12P, PixelFormat.BAYER_RG12P)


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    kinds = kinds_of(metafunc.config.getoption("--rig"))
    metafunc.parametrize("new_camera", list(kinds.values()), ids=list(kinds), indirect=True, scope="module")


@pytest.fixture(scope="module")
def new_camera(request: pytest.FixtureRequest) -> Iterator[NewCamera]:
    with ExitStack() as opened:
        yield opened.enter_context(request.param())


@pytest.fixture
def camera(new_camera: NewCamera) -> Iterator[Camera]:
    """A connected camera that was not started, free-running where it can be."""
    fresh = new_camera()
    fresh.connect()
    if fresh.settings.triggered:
        fresh.configure(replace(fresh.settings, triggered=False))
    yield fresh
    fresh.close()


@pytest.fixture
def streaming(camera: Camera) -> Camera:
    camera.start()
    return camera


@pytest.fixture
def commanded(camera: Camera) -> Camera:
    """The camera, waiting for commands; skipped where it cannot."""
    try:
        camera.configure(replace(camera.settings, triggered=True, trigger_source=TriggerSource.SOFTWARE))
    except FoveaError as refused:
        pytest.skip(f"it cannot be triggered by software: {refused}")
    camera.start()
    return camera


def test_it_says_who_it_is(camera: Camera) -> None:
    assert camera.info.serial
    assert camera.info.model
    assert camera.link.phase is CameraPhase.READY
    assert camera.link.epoch == 1


def test_it_runs_with_settings_inside_of_its_ranges(camera: Camera) -> None:
    settings, ranges = camera.settings, camera.ranges

    assert ranges.exposure_ns.low <= settings.exposure_ns <= ranges.exposure_ns.high
    assert ranges.gain_db.low <= settings.gain_db <= ranges.gain_db.high
    assert settings.pixel_format in ranges.pixel_formats


def test_frames_carry_their_time_number_and_format(streaming: Camera) -> None:
    frames = list(streaming.frames(3, timeout_ms=PATIENCE_MS))

    assert [frame.seq for frame in frames] == sorted({frame.seq for frame in frames})
    assert frames[0].t_ns < frames[1].t_ns < frames[2].t_ns
    assert {frame.exposure_ns for frame in frames} == {streaming.settings.exposure_ns}
    assert {(frame.role, frame.epoch) for frame in frames} == {(streaming.role, 1)}
    assert len({frame.image.shape for frame in frames}) == 1
    assert streaming.link.phase in (CameraPhase.STREAMING, CameraPhase.DEGRADED)


def test_binning_is_switched_while_it_streams_and_every_frame_states_its_own(streaming: Camera) -> None:
    seen = [streaming.read(timeout_ms=PATIENCE_MS)]
    for binning in (2, 1):
        taken = streaming.configure(replace(streaming.settings, binning=binning))
        seen.append(streaming.read(timeout_ms=PATIENCE_MS))
        assert taken.binning == streaming.settings.binning == binning

    height, width = seen[0].image.shape[:2]
    assert streaming.ranges.binnings == (1, 2)
    assert [frame.binning for frame in seen] == [1, 2, 1]
    assert [frame.image.shape[:2] for frame in seen] == [
        (height, width), (height // 2, width // 2), (height, width)
    ]  # fmt: skip
    assert [frame.image.shape[2:] for frame in seen] == 3 * [seen[0].image.shape[2:]]
    assert seen[0].seq < seen[1].seq < seen[2].seq
    assert seen[0].t_ns < seen[1].t_ns < seen[2].t_ns
    assert {frame.epoch for frame in seen} == {1}


def test_frames_keep_the_rate(streaming: Camera) -> None:
    """Neither doubled nor halved; a camera without a clock is timed by arrivals, which come in bursts.

    A machine that is busy for a moment delays some of them, so several stretches may show it.
    """
    list(streaming.frames(5, timeout_ms=PATIENCE_MS))  # what waited since the start
    asked = pytest.approx(1e9 / streaming.settings.frame_rate_hz, rel=0.45)
    periods_ns: list[float] = []
    while asked not in periods_ns and len(periods_ns) < STRETCHES:
        first, *_, last = streaming.frames(12, timeout_ms=PATIENCE_MS)
        periods_ns.append((last.t_ns - first.t_ns) / (last.seq - first.seq))

    assert asked in periods_ns


def test_the_newest_frame_is_repeated_while_it_is_young_enough(streaming: Camera) -> None:
    streaming.read(timeout_ms=PATIENCE_MS)
    streaming.stop()
    streaming.start()
    streaming.read(timeout_ms=PATIENCE_MS)
    first = streaming.latest(max_age_ms=1000.0)
    again = streaming.latest(max_age_ms=60_000.0)

    assert again.seq >= first.seq
    assert streaming.counters.delivered >= 1


def test_what_waits_for_its_reader_is_had_at_once_and_in_order(streaming: Camera) -> None:
    streaming.read(timeout_ms=PATIENCE_MS)
    end_s = time.monotonic() + PATIENCE_MS / 1000.0
    while streaming.waiting < 2 and time.monotonic() < end_s:
        time.sleep(0.01)
    frames = [streaming.read(timeout_ms=0.0) for _ in range(streaming.waiting)]

    assert len(frames) >= 2
    assert [later.seq - frame.seq for frame, later in pairwise(frames)] == [1] * (len(frames) - 1)


def test_a_start_begins_the_counters_anew_and_the_numbers_go_on(streaming: Camera) -> None:
    last = list(streaming.frames(3, timeout_ms=PATIENCE_MS))[-1]
    streaming.stop()
    streaming.start()

    assert streaming.read(timeout_ms=PATIENCE_MS).seq > last.seq
    assert streaming.counters.delivered == 1


def test_configure_returns_what_the_camera_took(streaming: Camera) -> None:
    asked = replace(streaming.settings, exposure_ns=7_000_000)
    if not allows(streaming.ranges, asked):
        with pytest.raises(OutOfRange, match=f"camera {streaming.role}: exposure 7 ms"):
            streaming.configure(asked)
        return
    taken = streaming.configure(asked)

    assert taken == streaming.settings
    assert taken.exposure_ns == pytest.approx(7_000_000, rel=0.05)
    assert streaming.read(timeout_ms=PATIENCE_MS).exposure_ns == taken.exposure_ns


def test_settings_that_a_camera_took_are_taken_again_unchanged(camera: Camera) -> None:
    taken = camera.configure(camera.settings)

    assert camera.configure(taken) == taken


@pytest.mark.parametrize(
    "change",
    [
        lambda settings, ranges: replace(settings, exposure_ns=round(ranges.exposure_ns.low / 2) - 1),
        lambda settings, ranges: replace(settings, exposure_ns=round(ranges.exposure_ns.high * 2) + 1),
        lambda settings, ranges: replace(settings, gain_db=ranges.gain_db.high + 1.0),
        lambda settings, ranges: replace(settings, gain_db=float("nan")),
        lambda settings, ranges: replace(settings, frame_rate_auto=False, frame_rate_hz=0.0),
        lambda settings, ranges: replace(
            settings, frame_rate_auto=False, frame_rate_hz=2 * ranges.frame_rate_hz.high + 1.0
        ),
        lambda settings, ranges: replace(settings, frame_rate_auto=False, frame_rate_hz=float("inf")),
        lambda settings, ranges: replace(settings, black_level=ranges.black_level.high + 1.0),
    ],
    ids=["dark", "long", "loud", "nan", "no rate", "fast", "inf", "black"],
)
def test_settings_out_of_range_are_refused_and_change_nothing(
    camera: Camera, change: Callable[[CameraSettings, CameraRanges], CameraSettings]
) -> None:
    before = camera.settings

    with pytest.raises(OutOfRange, match=f"camera {camera.role}"):
        camera.configure(change(before, camera.ranges))
    assert camera.settings == before


def test_every_pixel_format_delivers_what_its_name_says(streaming: Camera) -> None:
    assert streaming.ranges.pixel_formats
    for pixel_format in streaming.ranges.pixel_formats:
        taken = streaming.configure(replace(streaming.settings, pixel_format=pixel_format))
        frame = streaming.read(timeout_ms=PATIENCE_MS)

        assert taken.pixel_format is pixel_format
        assert frame.image.ndim == (2 if pixel_format in GREY else 3)
        assert frame.image.dtype == (np.uint16 if pixel_format in DEEP else np.uint8)
        assert frame.bits == (12 if pixel_format in DEEP else 8)


def test_a_pixel_format_that_it_lacks_is_refused_with_those_it_has(camera: Camera) -> None:
    lacking = [known for known in PixelFormat if known not in camera.ranges.pixel_formats]
    if not lacking:
        pytest.skip("it has them all")

    with pytest.raises(OutOfRange, match=camera.ranges.pixel_formats[0]):
        camera.configure(replace(camera.settings, pixel_format=lacking[0]))


def test_every_mode_of_its_exposure_is_taken_and_can_be_left(streaming: Camera) -> None:
    by_hand = streaming.settings
    for mode in streaming.ranges.exposure_autos:
        taken = streaming.configure(replace(by_hand, exposure_auto=mode))
        frame = streaming.read(timeout_ms=PATIENCE_MS)

        assert taken.exposure_auto in (mode, AutoMode.OFF if mode is AutoMode.ONCE else mode)
        assert frame.exposure_ns == pytest.approx(taken.exposure_ns, rel=1.0)
    assert streaming.configure(by_hand) == by_hand


def test_an_automatic_mode_that_it_lacks_is_refused_in_a_sentence_and_changes_nothing(camera: Camera) -> None:
    before = camera.settings
    lacking = [
        replace(before, exposure_auto=mode) for mode in AutoMode if mode not in camera.ranges.exposure_autos
    ]
    if not camera.ranges.frame_rate_auto:
        lacking.append(replace(before, frame_rate_auto=True))
    for asked in lacking:
        with pytest.raises(OutOfRange, match=rf"camera {camera.role}: .*; (it has none|use off|give one)"):
            camera.configure(asked)
    assert camera.settings == before


def test_a_rate_of_its_own_is_told_and_can_be_left(streaming: Camera) -> None:
    if not streaming.ranges.frame_rate_auto:
        pytest.skip("its rate is never its own")
    by_hand = streaming.configure(replace(streaming.settings, frame_rate_auto=False, frame_rate_hz=20.0))
    taken = streaming.configure(replace(by_hand, frame_rate_auto=True))

    assert (by_hand.frame_rate_auto, taken.frame_rate_auto) == (False, True)
    assert taken.frame_rate_hz >= by_hand.frame_rate_hz
    assert streaming.read(timeout_ms=PATIENCE_MS).image.size > 0
    assert streaming.configure(by_hand) == by_hand


def test_a_command_exposes_once_and_nothing_else_does(commanded: Camera) -> None:
    with pytest.raises(Timeout, match=f"camera {commanded.role}"):
        commanded.read(timeout_ms=200.0)
    seqs = []
    for _ in range(3):
        commanded.software_trigger()
        seqs.append(commanded.read(timeout_ms=PATIENCE_MS).seq)
    with pytest.raises(Timeout):
        commanded.read(timeout_ms=200.0)

    assert seqs == [seqs[0], seqs[0] + 1, seqs[0] + 2]


def test_a_silent_camera_that_waits_for_commands_is_not_lost(commanded: Camera) -> None:
    with pytest.raises(Timeout):
        commanded.read(timeout_ms=1500.0)

    assert commanded.link.phase is CameraPhase.STREAMING
    assert commanded.link.epoch == 1


def test_a_free_running_camera_takes_no_command(streaming: Camera) -> None:
    with pytest.raises(InvalidInput, match="configure it as triggered by software"):
        streaming.software_trigger()


def test_two_readers_share_the_frames_and_none_is_given_twice(streaming: Camera) -> None:
    with ThreadPoolExecutor(2) as readers:
        reads = [readers.submit(streaming.read, timeout_ms=PATIENCE_MS) for _ in range(8)]
        numbers = [read.result().seq for read in reads]

    assert len(set(numbers)) == 8
    assert streaming.counters.delivered == 8


def test_a_closed_camera_refuses_and_closes_again(streaming: Camera) -> None:
    streaming.close()
    streaming.close()

    for action in (streaming.start, streaming.read, lambda: streaming.latest(max_age_ms=10.0)):
        with pytest.raises(NotConnected, match=f"camera {streaming.role}"):
            action()
    assert streaming.link.phase is CameraPhase.CLOSED


def test_a_stopped_camera_says_that_it_must_be_started(camera: Camera) -> None:
    with pytest.raises(InvalidInput, match="start"):
        camera.read()


def test_a_camera_opens_again_with_its_settings_and_counts_it(streaming: Camera) -> None:
    settings = streaming.settings
    last = streaming.read(timeout_ms=PATIENCE_MS)
    streaming.close()
    streaming.connect()
    streaming.start()
    frame = streaming.read(timeout_ms=PATIENCE_MS)

    assert (frame.epoch, streaming.link.epoch) == (2, 2)
    assert frame.seq > last.seq
    assert streaming.settings == settings


def test_connecting_twice_opens_once(streaming: Camera) -> None:
    streaming.connect()

    assert streaming.link.epoch == 1
    assert streaming.read(timeout_ms=PATIENCE_MS).epoch == 1


def allows(ranges: CameraRanges, settings: CameraSettings) -> bool:
    return ranges.exposure_ns.low <= settings.exposure_ns <= ranges.exposure_ns.high
