"""A followed walker on the simulated rig, in virtual time."""

from dataclasses import replace

import numpy as np
from tests.support.scenes.marker_room import expose_briefly, make_grey

from foveacam_bench.track.following import FAST, follow_walkers
from foveacam_hardware.rig import Rig
from foveacam_server.resources.studying.studies.simulated_rigs import bin_cameras

CLICKED_STANDING = (replace(FAST[0], start_s=0.7),)
"""It walks from before the first look on; a place that rests while it is verged on is drawn once a look."""


def plainly(rig: Rig) -> None:
    """Take grey, binned pictures of short exposures, in which a walker is drawn fewer times."""
    make_grey(rig)
    bin_cameras(rig, 2)
    expose_briefly(rig)


def test_a_walker_at_two_metres_a_second_stays_in_both_foveae() -> None:
    run = follow_walkers(CLICKED_STANDING, seconds=0.5, adjust=plainly)
    assert run.looks > 5
    assert all(run.in_fovea["walker 0"])
    assert float(np.median(run.offsets_px[4:])) < 150.0, "eyes that lag behind by a look are 300 px off"
    assert run.lost_looks == 0
    assert float(np.sqrt(np.mean(np.square(run.relative_errors)))) < 0.01
