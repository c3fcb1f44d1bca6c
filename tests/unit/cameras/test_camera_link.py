"""States of a camera's link, pauses between attempts, and what silence means."""

from dataclasses import replace

import numpy as np
import pytest

from foveacam_hardware.contract import CameraPhase, CameraSettings, Frame, Role
from foveacam_hardware.drivers.cameras.shared_state import BackOff, CameraSharedState, LinkState
from foveacam_hardware.drivers.cameras.watchdog import Watchdog, WatchdogAdvice, WatchdogTimeouts

MS = 1_000_000
SETTINGS = CameraSettings(exposure_ns=5 * MS, frame_rate_hz=30.0)


def link_after(*phases: CameraPhase) -> LinkState:
    state = LinkState()
    for second, phase in enumerate(phases, start=1):
        state.go(phase, now_ns=second, reason=f"{phase} at {second}" if phase is CameraPhase.LOST else "")
    return state


def test_a_frame_from_before_what_was_asked_for_is_skipped_and_counted() -> None:
    shared = CameraSharedState(frames=4)
    image = np.zeros((2, 2), np.uint8)
    shared.put(Frame(image=image, role=Role.WIDE, seq=0, t_ns=30 * MS, exposure_ns=MS))

    assert shared.take_newest(oldest_ns=31 * MS) is None
    assert (shared.counters.delivered, shared.counters.skipped) == (0, 1)
    shared.put(Frame(image=image, role=Role.WIDE, seq=1, t_ns=31 * MS, exposure_ns=MS))
    found = shared.take_newest(oldest_ns=31 * MS)
    assert found is not None
    assert found.seq == 1


def test_each_opening_counts_an_epoch() -> None:
    state = link_after(
        CameraPhase.OPENING, CameraPhase.READY, CameraPhase.STREAMING, CameraPhase.READY, CameraPhase.LOST,
        CameraPhase.BACKOFF, CameraPhase.OPENING, CameraPhase.READY,
    )  # fmt: skip

    assert state.link.epoch == 2


def test_an_outage_keeps_its_reason_and_its_beginning_through_all_attempts() -> None:
    state = link_after(
        CameraPhase.OPENING, CameraPhase.READY, CameraPhase.LOST, CameraPhase.BACKOFF, CameraPhase.OPENING,
        CameraPhase.BACKOFF,
    )  # fmt: skip

    assert (state.link.since_ns, state.link.reason) == (3, "lost at 3")


def test_a_camera_that_is_back_has_no_reason_left() -> None:
    state = link_after(CameraPhase.OPENING, CameraPhase.LOST, CameraPhase.OPENING, CameraPhase.READY)

    assert (state.link.since_ns, state.link.reason) == (4, "")


@pytest.mark.parametrize("phase", [CameraPhase.STREAMING, CameraPhase.DEGRADED, CameraPhase.READY])
def test_a_closed_camera_cannot_deliver_without_being_opened(phase: CameraPhase) -> None:
    with pytest.raises(ValueError, match="does not go from closed"):
        LinkState().go(phase, now_ns=0)


@pytest.mark.parametrize("phase", list(CameraPhase))
def test_a_camera_can_be_closed_in_every_state(phase: CameraPhase) -> None:
    ways = {
        CameraPhase.CLOSED: (),
        CameraPhase.OPENING: (CameraPhase.OPENING,),
        CameraPhase.READY: (CameraPhase.OPENING, CameraPhase.READY),
        CameraPhase.STREAMING: (CameraPhase.OPENING, CameraPhase.READY, CameraPhase.STREAMING),
        CameraPhase.DEGRADED: (
            CameraPhase.OPENING, CameraPhase.READY, CameraPhase.STREAMING, CameraPhase.DEGRADED,
        ),
        CameraPhase.LOST: (CameraPhase.OPENING, CameraPhase.LOST),
        CameraPhase.BACKOFF: (CameraPhase.OPENING, CameraPhase.LOST, CameraPhase.BACKOFF),
    }  # fmt: skip
    state = link_after(*ways[phase])
    assert state.link.phase is phase
    state.go(CameraPhase.CLOSED, now_ns=99)

    assert state.link.phase is CameraPhase.CLOSED


def test_pauses_grow_to_a_limit_and_begin_again_after_a_success() -> None:
    backoff = BackOff(first_ns=250, most_ns=2000)
    assert [backoff.pause_ns() for _ in range(5)] == [250, 500, 1000, 2000, 2000]
    backoff.reset()

    assert backoff.pause_ns() == 250


@pytest.mark.parametrize(
    ("rate_hz", "limit_ms"), [(200.0, 500), (30.0, 500), (7.0, 714), (5.0, 1000), (1.0, 1505)]
)
def test_the_limit_of_silence_follows_the_frame_rate(rate_hz: float, limit_ms: int) -> None:
    watchdog = Watchdog(replace(SETTINGS, frame_rate_hz=rate_hz), timeouts=WatchdogTimeouts(), now_ns=0)
    watchdog.note_buffer(7)

    assert watchdog.limit_ns / MS == pytest.approx(limit_ms, abs=1)
    assert watchdog.advice(watchdog.limit_ns + 6) is WatchdogAdvice.WAIT
    assert watchdog.advice(watchdog.limit_ns + 7) is WatchdogAdvice.LOST


def test_first_frame_may_take_longer_and_a_slow_camera_still_has_its_own_time() -> None:
    watchdog = Watchdog(SETTINGS, timeouts=WatchdogTimeouts(), now_ns=0)
    assert watchdog.describe_silence(900 * MS) is None
    assert watchdog.describe_silence(1000 * MS) == "no frame for 1.0 s"
    assert watchdog.advice(1999 * MS) is WatchdogAdvice.WAIT
    assert watchdog.advice(2000 * MS) is WatchdogAdvice.LOST

    slow = Watchdog(replace(SETTINGS, frame_rate_hz=0.5), timeouts=WatchdogTimeouts(), now_ns=0)
    assert slow.advice(2999 * MS) is WatchdogAdvice.WAIT
    assert slow.advice(slow.limit_ns) is WatchdogAdvice.LOST


def test_half_of_the_limit_is_a_worry_that_a_frame_takes_away() -> None:
    watchdog = Watchdog(SETTINGS, timeouts=WatchdogTimeouts(), now_ns=0)
    watchdog.note_buffer(0)
    assert watchdog.describe_silence(100 * MS) is None
    assert watchdog.describe_silence(300 * MS) == "no frame for 0.3 s"
    watchdog.note_buffer(301 * MS)

    assert watchdog.describe_silence(302 * MS) is None


def test_a_silent_triggered_camera_is_asked_and_never_lost_for_its_silence() -> None:
    watchdog = Watchdog(replace(SETTINGS, triggered=True), timeouts=WatchdogTimeouts(), now_ns=0)
    assert watchdog.advice(299 * MS) is WatchdogAdvice.WAIT
    assert watchdog.advice(300 * MS) is WatchdogAdvice.ASK
    watchdog.note_answer(300 * MS)
    assert watchdog.advice(599 * MS) is WatchdogAdvice.WAIT

    assert watchdog.advice(3_600_000 * MS) is WatchdogAdvice.ASK
    assert watchdog.describe_silence(3_600_000 * MS) is None


def test_three_bad_frames_within_two_seconds_are_too_many() -> None:
    watchdog = Watchdog(SETTINGS, timeouts=WatchdogTimeouts(), now_ns=0)
    for t_ms in (0, 1000, 2500):
        watchdog.note_bad_frame(t_ms * MS)
    assert not watchdog.has_many_bad_frames(2500 * MS)
    watchdog.note_bad_frame(2600 * MS)

    assert watchdog.has_many_bad_frames(2600 * MS)
    assert not watchdog.has_many_bad_frames(3100 * MS)
