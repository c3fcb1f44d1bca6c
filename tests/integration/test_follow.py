"""A followed walker on the simulated rig, in virtual time."""

import numpy as np

from foveacam_bench.track.following import FAST, follow_walkers


def test_a_walker_at_two_metres_a_second_stays_in_both_foveae() -> None:
    run = follow_walkers(FAST, seconds=0.8)
    assert run.looks > 5
    assert all(run.in_fovea["walker 0"])
    assert run.lost_looks == 0
    assert float(np.sqrt(np.mean(np.square(run.relative_errors)))) < 0.01
