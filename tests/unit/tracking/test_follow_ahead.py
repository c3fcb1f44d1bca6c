"""Followed targets on a head that looks while the look before is measured."""

from collections.abc import Iterator
from contextlib import contextmanager
from unittest.mock import patch

import numpy as np
import pytest
from tests.support.scenes.plane_head import PlaneHead
from tests.unit.tracking.test_follow import begin, head_with, walking

from foveacam_hardware.contract import (
    AheadHead,
    Frame,
    LookOptions,
    PendingLook,
    Role,
    Sighting,
    StereoVolts,
    Timeout,
)
from foveacam_pipeline.track.follow import Follower
from foveacam_pipeline.track.target import FollowedTarget

pytestmark = pytest.mark.slow

PLACES = {"a": (-0.3, 0.1), "b": (0.2, -0.2), "c": (0.35, 0.25)}


class BegunLook:
    """A look that was made when it was requested."""

    def __init__(self, sighting: Sighting) -> None:
        self.sighting = sighting
        self.results = 0

    def result(self) -> Sighting:
        self.results += 1
        return self.sighting


class LookingAheadHead:
    """A painted head that can look ahead; it notes what happens in which order."""

    def __init__(self, head: PlaneHead) -> None:
        self.head = head
        self.begun: list[BegunLook] = []
        self.wides = 0

    def begin_look(self, volts: StereoVolts, *, options: LookOptions = LookOptions()) -> PendingLook:
        self.begun.append(BegunLook(self.head.look(volts, options=options)))
        return self.begun[-1]

    def look(self, volts: StereoVolts, *, options: LookOptions = LookOptions()) -> Sighting:
        return self.head.look(volts, options=options)

    def wide(self, *, max_age_ms: float = 200.0) -> Frame:
        self.wides += 1
        return self.head.wide(max_age_ms=max_age_ms)

    def expose_foveae(self, *, exposure_ns: int, gain_db: float) -> None:
        raise NotImplementedError

    def set_low_pass(self, cutoff_hz: int) -> int:
        raise NotImplementedError


@contextmanager
def measured_looks(head: LookingAheadHead) -> Iterator[list[int]]:
    """Give a list of how many looks had begun whenever one was measured."""
    found: list[int] = []
    measure = FollowedTarget.see_foveae

    def see(self: FollowedTarget, sighting: Sighting) -> object:
        found.append(len(head.begun))
        return measure(self, sighting)

    with patch.object(FollowedTarget, "see_foveae", see):
        yield found


def following(head: PlaneHead, **priorities: float) -> Follower:
    follower = Follower(head.calibration, clock=head.clock)
    for name, priority in priorities.items():
        follower.add(begin(head, name, at_m=PLACES[name], priority=priority))
    return follower


def test_the_next_look_begins_before_the_last_one_is_measured() -> None:
    head = LookingAheadHead(head_with(lambda t_ns: (0.0, 0.0)))
    assert isinstance(head, AheadHead)
    follower = following(head.head, a=1.0, b=1.0, c=1.0)
    with measured_looks(head) as found:
        looked_at = [follower.step(head).target_id for _ in range(12)]
    assert found == [number + 2 for number in range(12)]
    assert {name: looked_at.count(name) for name in PLACES} == dict.fromkeys(PLACES, 4)
    for report in follower.reports():
        np.testing.assert_allclose(report.estimate.position_rig_m[:2], PLACES[report.target_id], atol=0.02)


def test_what_moves_is_followed_in_every_look() -> None:
    head = LookingAheadHead(head_with(walking))
    follower = following(head.head, a=1.0, b=1.0)
    for _ in range(30):
        follower.step(head)
    for report in follower.reports():
        assert (report.looks, report.hits) == (15, 15)
        x_m, y_m = head.head.shift_m(report.estimate.t_ns)
        truth_m = np.array(PLACES[report.target_id]) + np.array([x_m, y_m])
        np.testing.assert_allclose(report.estimate.position_rig_m[:2], truth_m, atol=0.03)


def test_the_next_look_at_one_target_alone_begins_early_until_a_look_misses_it() -> None:
    head = LookingAheadHead(head_with(lambda t_ns: (0.0, 0.0)))
    follower = following(head.head, a=1.0)
    with measured_looks(head) as found:
        hits = [follower.step(head).reading is not None for _ in range(5)]
        head.head.blind = frozenset({Role.LEFT})  # the sixth look is made by now
        hits += [follower.step(head).reading is not None for _ in range(4)]
    assert hits == [True] * 6 + [False] * 3
    assert found == [2, 3, 4, 5, 6, 7, 8, 8, 9]


def test_one_target_that_moves_stays_in_the_foveae_although_each_look_begins_early() -> None:
    head = LookingAheadHead(head_with(walking))
    follower = following(head.head, a=1.0)
    for _ in range(30):
        follower.step(head)
    assert [(report.looks, report.hits) for report in follower.reports()] == [(30, 30)]


def test_targets_keep_their_shares_when_the_next_look_is_at_the_same_one() -> None:
    head = LookingAheadHead(head_with(lambda t_ns: (0.0, 0.0)))
    follower = following(head.head, a=2.0, b=1.0)
    with measured_looks(head) as found:
        looked_at = [follower.step(head).target_id for _ in range(18)]
    assert looked_at.count("a") == pytest.approx(12, abs=1)
    assert found == [number + 2 for number in range(18)]


def test_a_look_that_has_begun_is_measured_once_before_targets_are_changed() -> None:
    head = LookingAheadHead(head_with(lambda t_ns: (0.0, 0.0)))
    follower = following(head.head, a=1.0, b=1.0)
    first = follower.step(head)
    last = follower.finish()
    assert last is not None
    assert {first.target_id, last.target_id} == {"a", "b"}
    assert follower.finish() is None
    assert [look.results for look in head.begun] == [1, 1]
    assert {report.looks for report in follower.reports()} == {1}
    follower.remove("b")
    assert {follower.step(head).target_id for _ in range(3)} == {"a"}


def test_no_wide_frame_is_fetched_between_looks_that_each_have_one() -> None:
    head = LookingAheadHead(head_with(lambda t_ns: (0.0, 0.0)))
    follower = following(head.head, a=1.0, b=1.0, c=1.0)
    follower.step(head)
    head.wides = 0
    for _ in range(6):
        head.head.clock.sleep_until_ns(head.head.clock.now_ns() + 150_000_000)  # a slow machine
        follower.step(head)
    assert head.wides == 0


def test_a_look_that_fails_is_told_once_and_following_goes_on() -> None:
    head = LookingAheadHead(head_with(lambda t_ns: (0.0, 0.0)))
    follower = following(head.head, a=1.0, b=1.0)
    follower.step(head)
    with (
        patch.object(head.begun[-1], "result", side_effect=Timeout("no frame came")),
        pytest.raises(Timeout, match="no frame came"),
    ):
        follower.step(head)
    assert follower.finish() is None
    assert follower.step(head).sighting is not None
