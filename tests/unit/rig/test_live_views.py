"""How often the live views are due: as often as they are allowed, and more seldom while nobody looks."""

from dataclasses import replace

import pytest
from tests.support.devices.fake_rig import FakeRig, Pictures

from foveacam_hardware.contract import PARKED, VirtualClock
from foveacam_server.rig.live_views import (
    IDLE_FOVEA_HZ,
    IDLE_WIDE_HZ,
    LONGEST_WAIT_S,
    NEWEST_NS,
    QUIET_AFTER_NS,
    QUIET_FOVEA_HZ,
    QUIET_WIDE_HZ,
    RECENT_APART_NS,
    RECENT_FRAMES,
    SESSION_WIDE_HZ,
    LiveRates,
    LiveViews,
    RecentFrames,
)

LOOKING, NOBODY = {"wide", "left"}, set[str]()


@pytest.mark.parametrize(
    ("watching", "limit_hz", "wide_hz", "fovea_hz"),
    [
        (LOOKING, 15.0, 15.0, 15.0),
        (NOBODY, 15.0, IDLE_WIDE_HZ, IDLE_FOVEA_HZ),
        (NOBODY, 0.25, 0.25, 0.25),
    ],
)
def test_views_are_due_as_often_as_allowed_and_more_seldom_while_nobody_looks(
    watching: set[str], limit_hz: float, wide_hz: float, fovea_hz: float
) -> None:
    assert due_after_s(watching, limit_hz, wide=True) == pytest.approx(1.0 / wide_hz, abs=1e-3)
    assert due_after_s(watching, limit_hz, wide=False) == pytest.approx(1.0 / fovea_hz, abs=1e-3)


@pytest.mark.parametrize(("wide", "rate_hz"), [(True, QUIET_WIDE_HZ), (False, QUIET_FOVEA_HZ)])
def test_views_are_hardly_ever_due_once_nobody_has_looked_or_used_the_rig_for_long(
    wide: bool, rate_hz: float
) -> None:
    clock, views = quiet_views(Pictures(watching=set()))
    assert not (views.wide_due() or views.look_due())
    clock.sleep_until_ns(clock.now_ns() + round(0.99e9 / rate_hz))
    assert not (views.wide_due() if wide else views.look_due())
    clock.sleep_until_ns(clock.now_ns() + round(0.02e9 / rate_hz))
    assert views.wide_due() if wide else views.look_due()
    assert views.wait_s(wide=wide, looks=not wide) == 0.0


def test_a_viewer_who_comes_to_a_quiet_rig_gets_pictures_at_once_and_use_ends_the_quiet() -> None:
    sink = Pictures(watching=set())
    clock, views = quiet_views(sink)
    clock.sleep_until_ns(clock.now_ns() + 600_000_000)
    assert not views.wide_due()
    sink.watching = {"wide"}
    assert views.wide_due() and not views.look_due()
    sink.watching = set()
    assert views.wide_due()  # as after any use: 0.5 s, not 5 s
    assert views.wait_s(wide=False, looks=True) == LONGEST_WAIT_S


def quiet_views(sink: Pictures) -> tuple[VirtualClock, LiveViews]:
    """Return views whose rig nobody has used for long, at the beginning of a period of both."""
    clock = VirtualClock()
    views = LiveViews(sink=sink, clock=clock, limits=LiveRates(), overlay=lambda _: None)
    clock.sleep_until_ns(clock.now_ns() + QUIET_AFTER_NS)
    views.start_wide_period(in_session=False)
    views.start_look_period()
    return clock, views


def test_a_job_that_brings_looks_of_its_own_leaves_few_wide_frames_to_the_views() -> None:
    found_s = due_after_s(LOOKING, 15.0, wide=True, in_session=True)
    assert found_s == pytest.approx(1.0 / SESSION_WIDE_HZ, abs=1e-3)


def test_what_wants_all_frames_has_them_as_fast_as_they_come_whatever_the_limits() -> None:
    assert due_after_s(NOBODY, 15.0, wide=True, recording=LOOKING) < 0.01
    assert due_after_s(NOBODY, 15.0, wide=False, recording=LOOKING) <= 0.001
    assert due_after_s(NOBODY, 15.0, wide=False, recording={"wide"}) > 0.9


@pytest.mark.parametrize(("recording", "shown"), [(NOBODY, 1), ({"wide"}, 4)])
def test_what_wants_all_frames_has_those_that_waited_too(recording: set[str], shown: int) -> None:
    sink, rig = Pictures(recording=recording), FakeRig(VirtualClock())
    rig.wide.waiting = 3
    views = LiveViews(sink=sink, clock=rig.clock, limits=LiveRates(), overlay=lambda _: None)
    newest = views.show_wide(rig, gaze=PARKED)

    assert (sink.counts, newest.seq) == ({"wide": shown}, shown)


@pytest.mark.parametrize(("recording", "shown"), [(NOBODY, 1), ({"wide"}, 3)])
def test_what_wants_all_frames_has_those_of_looks_too(recording: set[str], shown: int) -> None:
    sink, rig = Pictures(recording=recording), FakeRig(VirtualClock())
    before = rig.wide.read(), rig.wide.read()
    seen = replace(rig.head.look(PARKED), wide_before=before)
    views = LiveViews(sink=sink, clock=rig.clock, limits=LiveRates(), overlay=lambda _: None)
    views.show_sighting(seen, in_session=False)

    assert sink.counts == {"wide": shown, "left": 1, "right": 1}


@pytest.mark.parametrize(("in_session", "due"), [(False, True), (True, False)])
def test_look_of_a_session_puts_the_next_live_wide_frame_off(in_session: bool, due: bool) -> None:
    rig = FakeRig(VirtualClock())
    views = LiveViews(
        sink=Pictures(), clock=rig.clock, limits=LiveRates(wide_hz=15.0), overlay=lambda _: None
    )
    views.show_sighting(rig.head.look(PARKED), in_session=in_session)
    rig.clock.sleep_until_ns(rig.clock.now_ns() + 200_000_000)

    assert views.wide_due() is due


def due_after_s(
    watching: set[str],
    limit_hz: float,
    *,
    wide: bool,
    in_session: bool = False,
    recording: set[str] = NOBODY,
) -> float:
    """Return after how long a view is due again."""
    clock = VirtualClock()
    views = LiveViews(
        sink=Pictures(watching=watching, recording=recording),
        clock=clock,
        limits=LiveRates(wide_hz=limit_hz, fovea_hz=limit_hz),
        overlay=lambda _: None,
    )
    views.start_wide_period(in_session=in_session)
    views.start_look_period()
    while not (views.wide_due() if wide else views.look_due()):
        clock.sleep_until_ns(clock.now_ns() + 1_000_000)
    return 1e-9 * clock.now_ns()


def test_a_click_finds_the_wide_frame_that_it_names_or_the_last_one_kept_before_it() -> None:
    recent, frame = RecentFrames(), FakeRig(VirtualClock()).wide.latest(max_age_ms=1.0)
    for k in range(RECENT_FRAMES + 3):
        recent.add(replace(frame, seq=100 + 2 * k, t_ns=k * RECENT_APART_NS))
        recent.add(replace(frame, seq=101 + 2 * k, t_ns=k * RECENT_APART_NS + 1))  # too soon after it
    found = [recent.find(seq) for seq in (100, 104, 106, 107, 2**32 - 1)]
    assert [None if each is None else each.seq for each in found] == [None, None, 106, 106, 128]


def test_a_click_without_a_number_is_on_the_newest_frame_unless_that_is_old() -> None:
    recent, frame = RecentFrames(), FakeRig(VirtualClock()).wide.latest(max_age_ms=1.0)
    assert recent.chosen(None, now_ns=0) is None
    for seq in (1, 2):
        recent.add(replace(frame, seq=seq, t_ns=seq * RECENT_APART_NS))
    newest = recent.newest()
    assert newest is not None
    assert recent.chosen(None, now_ns=newest.t_ns + NEWEST_NS) is newest
    assert recent.chosen(None, now_ns=newest.t_ns + NEWEST_NS + 1) is None
    assert recent.chosen(1, now_ns=newest.t_ns + NEWEST_NS + 1) is recent.find(1) is not newest
