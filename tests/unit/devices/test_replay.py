"""A recording in the place of a rig, in virtual time."""

from dataclasses import replace
from itertools import pairwise

import pytest
from tests.support.scenes.memory_recording import MemoryRecording

from foveacam_hardware.contract import (
    PARKED,
    CameraPhase,
    InvalidInput,
    MirrorVolts,
    NotConnected,
    OutOfRange,
    Role,
    StereoVolts,
    Timeout,
    VirtualClock,
)
from foveacam_hardware.drivers.replay.timeline import EndOfPlayback, Playback
from foveacam_hardware.rig import Rig
from foveacam_hardware.rig_replay import replay_rig

START_NS = 1_000_000_000
PERIOD_NS = 20_000_000
ELSEWHERE = StereoVolts(left=MirrorVolts(x_v=99.0, y_v=9.0), right=MirrorVolts(x_v=99.0, y_v=9.0))


def playing(playback: Playback | None = None, *, recorded: MemoryRecording | None = None) -> Rig:
    rig = replay_rig(recorded or MemoryRecording(), playback=playback, clock=VirtualClock(START_NS))
    rig.connect()
    return rig


@pytest.mark.parametrize("speed", [0.25, 1.0, 4.0])
def test_frames_come_on_the_clock_at_the_speed_asked(speed: float) -> None:
    rig = playing(Playback(speed=speed))
    frames = list(rig.left.frames(4, timeout_ms=10_000.0))

    assert [frame.t_ns for frame in frames] == [START_NS + round(k * PERIOD_NS / speed) for k in range(4)]
    assert [int(frame.image[0, 0]) for frame in frames] == [0, 1, 2, 3]
    assert rig.left.settings.frame_rate_hz == pytest.approx(50.0 * speed)


@pytest.mark.parametrize("speed", [0.2, 5.0, float("nan")])
def test_other_speeds_are_refused(speed: float) -> None:
    with pytest.raises(InvalidInput, match=r"0\.25 to 4"):
        Playback(speed=speed)


def test_in_a_loop_the_first_frame_follows_the_last_and_numbers_go_on() -> None:
    frames = list(playing().left.frames(25))

    assert [int(frame.image[0, 0]) for frame in frames] == [*range(10), *range(10), *range(5)]
    assert [frame.seq for frame in frames] == list(range(25))
    gaps = {after.t_ns - before.t_ns for before, after in pairwise(frames)}
    assert gaps == {PERIOD_NS, PERIOD_NS + 3_000_000}


def test_at_the_end_it_says_that_it_is_there() -> None:
    camera = playing(Playback(at_end=EndOfPlayback.STOP)).left
    list(camera.frames(10))

    with pytest.raises(Timeout, match="camera left: the recording is at its end"):
        camera.read()
    assert camera.link.phase is CameraPhase.LOST
    assert camera.latest(max_age_ms=60_000.0).seq == 9


def test_a_reader_that_sleeps_loses_frames_and_hears_of_it() -> None:
    rig = playing()
    rig.clock.sleep_until_ns(START_NS + 15 * PERIOD_NS)
    frame = rig.left.read()

    assert rig.left.counters.skipped == frame.seq > 4


def test_the_newest_frame_is_repeated_while_it_is_young() -> None:
    rig = playing()
    rig.clock.sleep_until_ns(START_NS + 5 * PERIOD_NS)
    first = rig.left.latest(max_age_ms=30.0)

    assert rig.left.latest(max_age_ms=30.0) is first
    assert first.t_ns == START_NS + 4 * PERIOD_NS
    assert rig.left.latest(max_age_ms=1.0).seq == first.seq + 1


def test_a_look_gives_the_next_recorded_pair_with_its_volts_wherever_one_wants_to_look() -> None:
    rig = playing()
    seen = [rig.head.look(ELSEWHERE) for _ in range(3)]

    for sighting in seen:
        number = int(sighting.left.image[0, 0])
        assert sighting.volts.left == MirrorVolts(x_v=float(number), y_v=-1.0) == sighting.volts.right
        assert sighting.left.t_ns == sighting.right.t_ns
        assert abs(sighting.wide.t_ns - sighting.left.t_ns) < PERIOD_NS
    assert [sighting.left.seq for sighting in seen] == sorted({sighting.left.seq for sighting in seen})


def test_the_mirrors_are_where_they_were_recorded_and_cannot_be_moved() -> None:
    rig = playing()
    rig.clock.sleep_until_ns(START_NS + 3 * PERIOD_NS)
    assert rig.mirrors.state.volts.left.x_v == 3.0

    for order in (
        lambda: rig.mirrors.steer(ELSEWHERE),
        lambda: rig.mirrors.expose(ELSEWHERE, settle_us=0, pulse_us=1),
        lambda: rig.mirrors.set_low_pass(500),
    ):
        with pytest.raises(OutOfRange, match="those of the recording A recording"):
            order()
    rig.mirrors.enable()
    rig.mirrors.park()
    rig.mirrors.ping()
    rig.mirrors.disable()


def test_settings_are_those_recorded_and_no_others() -> None:
    rig = playing()
    now = rig.left.settings
    rig.head.expose_foveae(exposure_ns=now.exposure_ns, gain_db=now.gain_db)

    with pytest.raises(InvalidInput, match="recording made with 2 ms"):
        rig.head.expose_foveae(exposure_ns=5_000_000, gain_db=0.0)


def test_an_eye_that_was_not_recorded_is_told_and_the_others_play() -> None:
    rig = playing(recorded=MemoryRecording(roles=(Role.WIDE,)))

    assert [problem.device for problem in rig.problems] == ["left", "right"]
    assert rig.wide.read().role is Role.WIDE
    assert rig.mirrors.state.volts == PARKED
    with pytest.raises(NotConnected, match="the recording has no frames of it"):
        rig.left.read()


def test_a_recording_without_any_eye_is_refused() -> None:
    with pytest.raises(InvalidInput, match="no frames of a wide"):
        replay_rig(MemoryRecording(roles=()))


def test_the_recording_is_closed_with_its_rig() -> None:
    recorded = MemoryRecording()
    playing(recorded=recorded).close()

    assert recorded.closed


def test_a_recording_at_binning_1_is_played_at_2_as_means() -> None:
    rig = playing()
    whole = rig.left.read()
    taken = rig.left.configure(replace(rig.left.settings, binning=2))
    half = rig.left.read()

    assert rig.working_binning == 1
    assert taken == rig.left.settings
    assert [(frame.binning, frame.image.shape) for frame in (whole, half)] == [(1, (6, 8)), (2, (3, 4))]
    assert (half.seq, int(half.image[0, 0])) == (whole.seq + 1, 1)


def test_a_recording_at_binning_2_is_not_played_at_1() -> None:
    rig = playing(recorded=MemoryRecording(binnings=(2,)))
    with pytest.raises(InvalidInput, match="camera left: asked for binning 1, and it has 2; use binning 2"):
        rig.left.configure(replace(rig.left.settings, binning=1))

    assert rig.working_binning == 2
    assert (rig.left.settings.binning, rig.left.read().binning) == (2, 2)


def test_frames_of_a_recording_that_changes_its_binning_state_their_own() -> None:
    frames = list(playing(recorded=MemoryRecording(binnings=(1, 2, 1))).left.frames(3))

    assert [frame.binning for frame in frames] == [1, 2, 1]
    assert [frame.image.shape for frame in frames] == [(6, 8), (3, 4), (6, 8)]
