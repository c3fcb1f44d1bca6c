"""Lag of the foveae behind a walker whom the loop tracks, with prediction and without."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from foveacam_bench.judging import rms
from foveacam_bench.loop.charged_loop import ChargedLoop
from foveacam_bench.track.following import click_chest
from foveacam_bench.track.square import Walker, write_square
from foveacam_hardware.contract import Binning
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.continuous_loop.settings import Axis, LoopSettings
from foveacam_server.resources.studying.studies.click_truth import beside_centres, clicked_point_at, truth_of

WALKER = Walker(x_m=0.0, z_m=10.0, radius_m=1.0, speed_m_per_s=0.5)
BEGIN_LOOKS = 15
"""Looks in which the loop finds the depth and the tracker the speed; they do not count."""


def lag_mrad(*, predict: bool, pan_held: bool, seconds: float, binning: Binning) -> float:
    """Return the RMS of the angle between the foveae's mean direction and the clicked point at the exposure.

    `pan_held`: whether only aiming moves the eyes; else corrections of pan compensate part of the lag.
    """
    angles = []
    with TemporaryDirectory() as folder:
        scene = write_square(Path(folder) / "square.toml", [WALKER])
        with open_simulated(scene=str(scene), inline=True) as rig:
            truth = truth_of(rig)
            charged = ChargedLoop(rig, settings=LoopSettings(predict=predict), binning=binning)
            click = click_chest(truth, charged.calibration, 0, rig.head.wide().t_ns)
            if click is None:
                raise RuntimeError("the walker is hidden; let nothing stand in front of him")
            charged.choose((click.x_px, click.y_px), inverse_z_per_m=1.0 / click.point_rig_m[2])
            if pan_held:
                charged.loop.held = {Axis.PAN_X, Axis.PAN_Y}
            end_ns = rig.clock.now_ns() + round(1e9 * seconds)
            while rig.clock.now_ns() < end_ns:
                done = charged.step()
                if done.sighting is None:
                    raise RuntimeError(f"a look failed: {charged.loop.gate.reason}")
                point = clicked_point_at(truth, click, done.t_ns)
                angles.append(beside_centres(truth, done.sighting, point).mean(axis=0))
    return 1e3 * rms(np.hypot(*np.array(angles[BEGIN_LOOKS:]).T))
