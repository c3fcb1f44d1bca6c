"""Followed targets on the simulated rig, in virtual time."""

import numpy as np
import pytest

from foveacam_bench.track.following import CROSSING, FAST, follow_walkers
from foveacam_pipeline.track.image_tracker import TrackerKind


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
