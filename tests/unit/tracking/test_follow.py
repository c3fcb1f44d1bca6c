"""Followed targets on a painted rig: what moves, hides, leaves the field, and what a tracker mistakes."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest
from tests.support.scenes.plane_head import PlaneHead, noise_texture

from foveacam_hardware.contract import LookOptions, OutOfRange, Sighting, StereoVolts
from foveacam_pipeline.geometry.binning import picture_px
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.track import trackers
from foveacam_pipeline.track.follow import MOST_TARGETS, Follower, FollowStep
from foveacam_pipeline.track.image_tracker import GreyImage, ImageTracker, TrackBox, TrackerKind, TrackMatch
from foveacam_pipeline.track.target import FollowedTarget, FollowState
from foveacam_pipeline.track.template_tracker import TemplateTracker
from foveacam_pipeline.verge.aim import aim_at, volts_for

pytestmark = pytest.mark.slow

Z_M = 6.0
Shift = Callable[[int], tuple[float, float]]


def walking(t_ns: int) -> tuple[float, float]:
    """Return where something that sways by 0.3 m at up to 0.6 m/s is, m."""
    return 0.3 * math.sin(2.0 * t_ns / 1e9), 0.0


def head_with(shift_m: Shift = walking, **options: object) -> PlaneHead:
    return PlaneHead(z_m=Z_M, texture=noise_texture(), shift_m=shift_m, **{"binning": 2, **options})  # type: ignore[arg-type]  # its options


def begin(
    head: PlaneHead, name: str = "one", *, at_m: tuple[float, float] = (0.0, 0.0), **options: object
) -> FollowedTarget:
    """Return a target that is followed from a look at it, at a place of the plane, m."""
    calibration = head.calibration
    shift_x_m, shift_y_m = head.shift_m(head.clock.now_ns() + head.look_ns)
    point = (at_m[0] + shift_x_m, at_m[1] + shift_y_m, Z_M)
    gazes = aim_at(calibration, np.array(point[:2]) / Z_M, 1.0 / Z_M)
    sighting = head.look(volts_for(calibration, gazes))
    wide = gray(to_uint8(sighting.wide))
    return FollowedTarget(name, sighting, point, calibration=calibration, wide=wide, **options)  # type: ignore[arg-type]  # options of the target


def errors_m(head: PlaneHead, follower: Follower, steps: int) -> list[float]:
    """Return the distance of the first target's estimate from the truth after every step."""
    found = []
    for _ in range(steps):
        step = follower.step(head)
        target = next(iter(follower.targets.values()))
        x_m, y_m = head.shift_m(step.t_ns)
        found.append(float(np.linalg.norm(target.at(step.t_ns).position_rig_m - np.array([x_m, y_m, Z_M]))))
    return found


@pytest.mark.parametrize("tracker", TrackerKind)
def test_what_moves_is_followed_in_every_look(tracker: TrackerKind) -> None:
    head = head_with()
    follower = Follower(head.calibration, clock=head.clock)
    follower.add(begin(head, tracker=tracker))
    found_m = errors_m(head, follower, 25)
    report = follower.reports()[0]
    assert (report.state, report.hits, report.looks) == (FollowState.FOLLOWED, 25, 25)
    assert max(found_m[5:]) < 0.02
    speed_m_s = float(np.linalg.norm(report.estimate.velocity_rig_m_s))
    truth_m_s = abs(0.6 * math.cos(2.0 * report.estimate.t_ns / 1e9))
    assert speed_m_s == pytest.approx(truth_m_s, abs=0.15)
    assert report.estimate.distance_sigma_m > 0.0


@pytest.mark.parametrize(("pause_ms", "fetched"), [(80, 0), (120, 1)])
def test_a_wide_frame_is_fetched_before_a_look_once_the_last_one_is_old(pause_ms: int, fetched: int) -> None:
    head, steps = head_with(), 3
    follower = Follower(head.calibration, clock=head.clock)
    follower.add(begin(head))
    follower.step(head)
    with patch.object(head, "wide", wraps=head.wide) as wide:
        for _ in range(steps):
            head.clock.sleep_until_ns(head.clock.now_ns() + pause_ms * 1_000_000)
            follower.step(head)
    assert wide.call_count == steps * (1 + fetched)  # each look has one


def test_its_tracker_is_changed_while_it_is_followed() -> None:
    head = head_with()
    follower, target = Follower(head.calibration, clock=head.clock), begin(head)
    follower.add(target)
    errors_m(head, follower, 5)
    frame = head.wide()
    target.use_tracker(TrackerKind.FILTER, gray(to_uint8(frame)), frame.t_ns)
    assert max(errors_m(head, follower, 10)) < 0.03
    assert target.tracker is TrackerKind.FILTER


def test_what_is_hidden_is_told_as_lost_and_found_again_where_it_went_on() -> None:
    hidden_ns = (400_000_000, 1_200_000_000)
    column_px = 700.0

    def passer(t_ns: int) -> float | None:
        return column_px if hidden_ns[0] <= t_ns <= hidden_ns[1] else None

    head = head_with(lambda t_ns: (0.05 * t_ns / 1e9, 0.0), passer_px=passer)
    follower = Follower(head.calibration, clock=head.clock)
    follower.add(begin(head))
    states = []
    for _ in range(50):
        follower.step(head)
        states.append((head.clock.now_ns(), follower.reports()[0].state))
    during = {state for t_ns, state in states if hidden_ns[0] + 200_000_000 < t_ns < hidden_ns[1]}
    after = {state for t_ns, state in states if t_ns > hidden_ns[1] + 200_000_000}
    assert (during, after) == ({FollowState.LOST}, {FollowState.FOLLOWED})


def test_what_comes_nearer_is_followed_as_it_grows() -> None:
    head = head_with(lambda t_ns: (0.0, 0.0))
    follower = Follower(head.calibration, clock=head.clock)
    follower.add(begin(head))
    readings = []
    while head.z_m > 3.3:
        head.z_m -= 0.08  # 2.4 m/s
        readings.append(follower.step(head).reading)
    assert all(reading is not None for reading in readings)
    assert follower.reports()[0].estimate.distance_m == pytest.approx(head.z_m, rel=0.01)


def test_what_no_target_can_have_reached_since_the_last_look_is_another_thing() -> None:
    head = head_with(lambda t_ns: (0.0, 0.0))
    follower = Follower(head.calibration, clock=head.clock)
    follower.add(begin(head))
    errors_m(head, follower, 5)
    head.z_m = 5.5  # 15 m/s
    assert follower.step(head).reading is None
    head.z_m = Z_M
    assert follower.step(head).reading is not None


@pytest.mark.parametrize("z_m", [5.0, 7.2])
def test_what_was_hidden_is_found_again_at_another_distance(z_m: float) -> None:
    head = head_with(lambda t_ns: (0.0, 0.0))
    follower = Follower(head.calibration, clock=head.clock)
    follower.add(begin(head))
    errors_m(head, follower, 5)
    head.passer_px = lambda t_ns: 700.0
    while head.clock.now_ns() < 1_000_000_000:
        follower.step(head)
    assert follower.reports()[0].state is FollowState.LOST
    head.z_m, head.passer_px = z_m, lambda t_ns: None
    for _ in range(10):
        follower.step(head)
    report = follower.reports()[0]
    assert report.state is FollowState.FOLLOWED
    assert report.estimate.distance_m == pytest.approx(z_m, rel=0.01)


def test_what_leaves_the_field_is_told_and_taken_up_again_when_it_is_back() -> None:
    def there_and_back(t_ns: int) -> tuple[float, float]:
        return 0.6 + 0.65 * math.sin(
            1.5 * t_ns / 1e9
        ), 0.0  # the mirrors reach 1.0 m there, the wide view 1.4

    head = head_with(there_and_back)
    follower = Follower(head.calibration, clock=head.clock)
    follower.add(begin(head))
    states = []
    while head.clock.now_ns() < 3_200_000_000:
        if follower.step(head).sighting is None:
            head.clock.sleep_until_ns(head.clock.now_ns() + head.look_ns)
        states.append(follower.reports()[0].state)
    left = states.index(FollowState.OUT_OF_FIELD)
    assert states[left - 1] is FollowState.FOLLOWED
    assert states[-1] is FollowState.FOLLOWED
    assert max(errors_m(head, follower, 3)) < 0.02  # the same part of a texture that repeats


class RunawayTracker:
    """Follows for some frames, then slides off to something else, until it is refused."""

    def __init__(self, tracker: ImageTracker, *, good_frames: int) -> None:
        self.tracker = tracker
        self.left = good_frames
        self.refusals = 0
        self._place: tuple[float, float] | None = None

    def start(self, image: GreyImage, box: TrackBox) -> None:
        self.tracker.start(image, box)

    def update(self, image: GreyImage, near: tuple[float, float] | None) -> TrackMatch | None:
        self.left -= 1
        found = self.tracker.update(image, near)
        if found is None or self.left > 0 or self.refusals:
            return found
        x_px, y_px = self._place or (found.x_px, found.y_px)
        self._place = x_px + 12.0, y_px - 4.0
        return TrackMatch(x_px=self._place[0], y_px=self._place[1], score=0.9)

    def avoid(self, places_px: Sequence[tuple[float, float]]) -> None:
        self.tracker.avoid(places_px)

    def refuse(self) -> None:
        self.refusals += 1
        self.tracker.refuse()


def test_a_tracker_that_runs_away_is_caught_by_the_foveae(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[RunawayTracker] = []

    def runaway() -> RunawayTracker:
        made.append(RunawayTracker(TemplateTracker(), good_frames=10))
        return made[-1]

    monkeypatch.setattr(trackers, "TemplateTracker", runaway)
    head = head_with(lambda t_ns: (0.05 * t_ns / 1e9, 0.0))
    follower = Follower(head.calibration, clock=head.clock)
    follower.add(begin(head))
    found_m = errors_m(head, follower, 40)
    assert made[0].refusals >= 1
    assert max(found_m[-5:]) < 0.03
    assert follower.reports()[0].state is FollowState.FOLLOWED


def test_several_targets_take_turns_and_each_has_its_place() -> None:
    head = head_with(lambda t_ns: (0.0, 0.0))
    follower = Follower(head.calibration, clock=head.clock)
    places = {"a": (-0.3, 0.1), "b": (0.2, -0.2), "c": (0.35, 0.25)}
    for name, place in places.items():
        follower.add(begin(head, name, at_m=place))
    looked_at = [follower.step(head).target_id for _ in range(12)]
    assert set(looked_at[:3]) == {"a", "b", "c"}
    assert {name: looked_at.count(name) for name in places} == dict.fromkeys(places, 4)
    for report in follower.reports():
        np.testing.assert_allclose(report.estimate.position_rig_m[:2], places[report.target_id], atol=0.02)
    follower.remove("b")
    assert "b" not in {follower.step(head).target_id for _ in range(4)}


class HiddenHead:
    """A painted head whose left eye sees something blank wherever it looks left of an angle."""

    def __init__(self, head: PlaneHead, *, left_of_rad: float) -> None:
        self._head, self._left_of_rad = head, left_of_rad
        self.wide = head.wide

    def look(self, volts: StereoVolts, *, options: LookOptions = LookOptions()) -> Sighting:
        sighting = self._head.look(volts, options=options)
        if self._head.calibration.gaze_rad(volts)[0][0] > self._left_of_rad:
            return sighting
        blank = replace(sighting.left, image=np.full_like(sighting.left.image, 90))
        return replace(sighting, left=blank)

    def expose_foveae(self, *, exposure_ns: int, gain_db: float) -> None:
        raise NotImplementedError

    def set_low_pass(self, cutoff_hz: int) -> int:
        raise NotImplementedError


def test_of_eight_targets_one_is_lost_and_the_others_are_followed_as_before() -> None:
    head = head_with(lambda t_ns: (0.0, 0.0))
    follower = Follower(head.calibration, clock=head.clock)
    places = [
        (-0.5, 0.0),
        *[(0.1 * column, row) for column in (0, 2, 4) for row in (-0.25, 0.25)],
        (0.3, 0.0),
    ]
    for number, place in enumerate(places):
        follower.add(begin(head, f"{number}", at_m=place))
    hidden = HiddenHead(head, left_of_rad=-0.04)
    looked_at = [follower.step(hidden).target_id for _ in range(8 * 6)]
    states = {report.target_id: report.state for report in follower.reports()}
    assert states.pop("0") is FollowState.LOST
    assert set(states.values()) == {FollowState.FOLLOWED}
    counts = [looked_at.count(f"{number}") for number in range(8)]
    assert min(counts) >= 5  # the lost one is searched for, and takes no more than its share
    assert max(counts) <= 7


class PlacedTracker:
    """Finds the target where it is told to."""

    def __init__(self) -> None:
        self.place_px: tuple[float, float] | None = None

    def start(self, image: GreyImage, box: TrackBox) -> None:
        self.place_px = box.x_px, box.y_px

    def update(self, image: GreyImage, near: tuple[float, float] | None) -> TrackMatch | None:
        if self.place_px is None:
            return None
        return TrackMatch(x_px=self.place_px[0], y_px=self.place_px[1], score=0.9)

    def avoid(self, places_px: Sequence[tuple[float, float]]) -> None:
        pass

    def refuse(self) -> None:
        self.place_px = None


def missed_target(monkeypatch: pytest.MonkeyPatch, *, misses: int) -> tuple[PlaneHead, FollowedTarget]:
    """Return a target that so many looks did not show, and whose tracker says that it is where it was."""
    monkeypatch.setattr(trackers, "TemplateTracker", PlacedTracker)
    head = head_with(lambda t_ns: (0.0, 0.0))
    target = begin(head)
    hidden = HiddenHead(head, left_of_rad=math.inf)
    for _ in range(misses):
        sighting = hidden.look(volts_for(head.calibration, aim_at(head.calibration, np.zeros(2), 1.0 / Z_M)))
        target.see_wide(sighting.wide, gray(to_uint8(sighting.wide)))
        assert target.see_foveae(sighting) is None
    return head, target


@pytest.mark.parametrize(
    ("misses", "beside_px", "refused"), [(1, 20.0, True), (1, 70.0, False), (0, 20.0, False)]
)
def test_the_place_of_another_target_is_that_of_one_that_hides_this_one(
    monkeypatch: pytest.MonkeyPatch, misses: int, beside_px: float, refused: bool
) -> None:
    head, target = missed_target(monkeypatch, misses=misses)
    wide = head.wide()
    x_px, y_px = head.calibration.wide.pixels([(0.0, 0.0)])[0].tolist()
    target.see_wide(wide, gray(to_uint8(wide)), [(x_px + beside_px, y_px)])
    report = target.report(head.clock.now_ns())
    assert (report.wide_score is None) == refused
    assert (report.state is FollowState.LOST) == refused


def test_a_lost_target_is_looked_at_where_the_wide_view_has_found_it_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    head, target = missed_target(monkeypatch, misses=2)
    assert target.lost
    [tracker] = [target._tracker._tracker]  # type: ignore[attr-defined]  # that of binned pictures holds it
    tracker.place_px = picture_px(head.calibration.wide.pixels([(0.06, 0.0)])[0], head.binning).tolist()
    wide = head.wide()
    target.see_wide(wide, gray(to_uint8(wide)))
    assert target.aim(wide.t_ns).tangents[0] == pytest.approx(math.tan(0.06), abs=1e-3)


def test_a_target_of_twice_the_priority_is_looked_at_twice_as_often() -> None:
    head = head_with(lambda t_ns: (0.0, 0.0))
    follower = Follower(head.calibration, clock=head.clock)
    follower.add(begin(head, "a", at_m=(-0.3, 0.0), priority=2.0))
    follower.add(begin(head, "b", at_m=(0.3, 0.0)))
    looked_at = [follower.step(head).target_id for _ in range(18)]
    assert looked_at.count("a") == pytest.approx(12, abs=1)


def test_the_wide_frames_of_other_looks_are_seen_as_well() -> None:
    head = head_with(lambda t_ns: (0.3 * t_ns / 1e9, 0.0))
    follower, target = Follower(head.calibration, clock=head.clock), begin(head)
    follower.add(target)
    errors_m(head, follower, 5)
    other = follower.watching(head)
    for _ in range(12):
        other.look(volts_for(head.calibration, aim_at(head.calibration, np.array([-0.08, 0.0]), 0.1)))
    x_m = head.shift_m(head.clock.now_ns())[0]
    assert target.at(head.clock.now_ns()).tangents[0] == pytest.approx(x_m / Z_M, abs=1e-3)
    assert max(errors_m(head, follower, 3)) < 0.05


def test_looks_of_another_procedure_are_shared_with_the_followed_targets() -> None:
    head = head_with(lambda t_ns: (0.8 * t_ns / 1e9, 0.0))
    follower, target = Follower(head.calibration, clock=head.clock), begin(head)
    follower.add(target)
    errors_m(head, follower, 5)
    shared: list[FollowStep] = []
    other = follower.watching(head, before_look=lambda: shared.append(follower.step(head)))
    before = head.looks
    for _ in range(12):
        other.look(volts_for(head.calibration, aim_at(head.calibration, np.array([-0.08, 0.0]), 0.1)))
    assert head.looks - before == 24
    assert [step.target_id for step in shared] == 12 * [target.target_id]
    assert all(step.reading is not None for step in shared)


def test_no_more_targets_than_eight_and_none_without_texture() -> None:
    head = head_with(lambda t_ns: (0.0, 0.0))
    follower, target = Follower(head.calibration, clock=head.clock), begin(head)
    for number in range(MOST_TARGETS):
        target.target_id = f"{number}"
        follower.add(target)
    target.target_id = "another"
    with pytest.raises(ValueError, match="at most 8"):
        follower.add(target)
    with pytest.raises(OutOfRange, match="nothing that could be followed"):
        target.use_tracker(TrackerKind.TEMPLATE, np.full((1080, 1440), 90, dtype=np.uint8), 0)
