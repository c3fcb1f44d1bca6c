"""The lens of a fovea on the simulated rig: somebody shows it a small board while its mirror rests."""

from pathlib import Path

import numpy as np
import pytest
from tests.support.scenes.marker_room import changed_room, make_grey

from foveacam_hardware.contract import PARKED, Role
from foveacam_hardware.sim.optics import FOVEA_FOCAL_PX
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.calibrate.watcher import SilentWatcher
from foveacam_pipeline.calibrate.wide.fit_fovea import fit_fovea
from foveacam_pipeline.calibrate.wide.wide_run import WideSettings, calibrate_wide
from foveacam_server.resources.calibrating.sessions.lens_step import BOARD

VIEWS = 6
EVERY_S = 0.5
"""Between looks at a board that is held for 1.6 s and shown elsewhere every 2 s: two looks see it at rest."""


@pytest.mark.timeout(120)
def test_focal_length_is_the_true_one_within_what_the_fit_says_and_a_thousandth(tmp_path: Path) -> None:
    with open_simulated(changed_room(tmp_path, plain=True), inline=True) as rig:
        assert rig.pan_tilt is not None
        make_grey(rig)
        rig.pan_tilt.home()
        there = next(place.pose for place in rig.stations if place.name == "fovea boards")
        for begin in (None, there):
            while rig.pan_tilt.state.moving:
                rig.clock.sleep_until_ns(rig.clock.now_ns() + 50_000_000)
            if begin is not None:
                rig.pan_tilt.move_to(begin)
        while rig.pan_tilt.state.moving:
            rig.clock.sleep_until_ns(rig.clock.now_ns() + 50_000_000)
        samples = calibrate_wide(
            rig.head,
            BOARD,
            clock=rig.clock,
            watch=SilentWatcher(),
            settings=WideSettings(views=VIEWS, every_s=EVERY_S, frames=1, role=Role.RIGHT),
        )
        at_rest = rig.mirrors.state.volts
    fit = fit_fovea(samples)
    found = {each.name: each for each in fit.parameters}
    error_px = found["fx_px"].value - FOVEA_FOCAL_PX
    assert abs(error_px) <= min(3.0 * found["fx_px"].sigma, 1e-3 * FOVEA_FOCAL_PX)
    assert not found["fx_px"].assumed
    assert fit.lens.rms_px < 0.1
    assert np.degrees(fit.lens.field_rad[0]) == pytest.approx(2.868, abs=0.01)
    assert at_rest == PARKED
