"""Followed targets on the simulated rig, in virtual time."""

import numpy as np
import pytest

from foveacam_bench.track.following import CROSSING, FAST, follow_walkers
from foveacam_bench.track.square import Walker
from foveacam_pipeline.track import target
from foveacam_pipeline.track.image_tracker import GreyImage, ImageTracker, TrackBox, TrackerKind, TrackMatch
from foveacam_pipeline.track.target import FollowState
from foveacam_pipeline.track.template_tracker import TemplateTracker


@pytest.mark.parametrize("tracker", TrackerKind)
def test_a_walker_at_two_metres_a_second_stays_in_both_foveae(tracker: TrackerKind) -> None:
    run = follow_walkers(FAST, seconds=1.5, tracker=tracker)
    assert run.looks > 10
    assert all(run.in_fovea["walker 0"])
    assert run.lost_looks == 0
    assert float(np.sqrt(np.mean(np.square(run.relative_errors)))) < 0.01


def test_two_targets_share_the_foveae_evenly_while_one_passes_in_front_of_the_other() -> None:
    run = follow_walkers(CROSSING, seconds=2.5)
    counts = [len(times) for times in run.times_s.values()]
    assert len(counts) == 2
    assert max(counts) - min(counts) <= 0.35 * max(counts)
    assert max(run.ages_s) < 4.0 * 2 * run.look_s


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

    def refuse(self) -> None:
        self.refusals += 1
        self.tracker.refuse()


def test_a_tracker_that_runs_away_is_caught_by_the_foveae(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[RunawayTracker] = []

    def runaway() -> RunawayTracker:
        made.append(RunawayTracker(TemplateTracker(), good_frames=20))
        return made[-1]

    monkeypatch.setattr(target, "TemplateTracker", runaway)
    run = follow_walkers([Walker(x_m=0.0, z_m=10.0, radius_m=0.3, speed_m_per_s=0.3)], seconds=4.5)
    assert made[0].left < 0
    assert made[0].refusals >= 1
    assert all(run.in_fovea["walker 0"])
    assert run.states[-1] is FollowState.FOLLOWED


def test_a_target_that_leaves_the_field_is_told_and_taken_up_again_when_it_comes_back() -> None:
    walker = Walker(x_m=1.7, z_m=10.0, radius_m=1.2, speed_m_per_s=1.6, start_s=2.5)
    run = follow_walkers([walker], seconds=7.0)
    assert FollowState.OUT_OF_FIELD in run.states
    assert run.states[-1] is FollowState.FOLLOWED
    assert run.in_fovea["walker 0"][-1]
