"""Stage 1 on the simulated rig: somebody shows a board, and the lens comes out as it is."""

from pathlib import Path

import numpy as np
import pytest
from tests.support.scenes.marker_room import changed_room, make_grey

from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.calibrate.watcher import SilentWatcher
from foveacam_pipeline.calibrate.wide.boards import Checkerboard
from foveacam_pipeline.calibrate.wide.fit_wide import choose_model
from foveacam_pipeline.calibrate.wide.lens_accuracy import grid_px
from foveacam_pipeline.calibrate.wide.wide_run import WideSettings, calibrate_wide

EVERY_S = 0.5
"""Between looks at a board that is held for 1.6 s and shown elsewhere every 2 s: two looks see it at rest."""


@pytest.mark.timeout(300)  # some 120 looks, those at a moving board in steps
def test_pixels_and_angles_agree_with_the_lens_as_well_as_stated(tmp_path: Path) -> None:
    with open_simulated(changed_room(tmp_path, plain=True), inline=True) as rig:
        assert rig.pan_tilt is not None
        assert rig.truth is not None
        make_grey(rig)
        rig.pan_tilt.home()
        pose = next(place.pose for place in rig.stations if place.name == "checkerboard")
        for begin in (None, pose):
            while rig.pan_tilt.state.moving:
                rig.clock.sleep_until_ns(rig.clock.now_ns() + 50_000_000)
            if begin is not None:
                rig.pan_tilt.move_to(begin)
        while rig.pan_tilt.state.moving:
            rig.clock.sleep_until_ns(rig.clock.now_ns() + 50_000_000)
        samples = calibrate_wide(
            rig.head,
            Checkerboard(),
            clock=rig.clock,
            watch=SilentWatcher(),
            settings=WideSettings(views=38, every_s=EVERY_S, frames=1),
        )
        choice = choose_model(samples)
        pixels = grid_px(1440, 1080)
        rays = rig.truth.wide_rays(pixels)
    fit = choice.recommended
    errors = fit.intrinsics.pixels(np.arctan(rays[:, :2] / rays[:, 2:])) - pixels
    true_px = float(np.sqrt(np.mean(np.sum(errors**2, axis=1))))
    assert fit.model == "five"
    assert true_px <= 2.0 * fit.accuracy.sigma_px <= 0.25
    straightened = errors - errors.mean(axis=0)  # a shift of all pixels is a turn of the rig frame
    assert float(np.sqrt(np.mean(np.sum(straightened**2, axis=1)))) <= 0.03
