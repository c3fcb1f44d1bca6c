"""Tuning that must be refused and leave everything as before: a stuck axis, somebody who walks past."""

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from foveacam_bench.loop.charged_loop import ChargedLoop
from foveacam_bench.loop.tuned_steps import POSTER_PER_M, POSTER_PX
from foveacam_bench.track.following import click_chest
from foveacam_bench.track.square import Walker, write_square
from foveacam_hardware.contract import Binning
from foveacam_hardware.sim.rig import open_simulated
from foveacam_hardware.simulated_faults import MirrorAxis
from foveacam_pipeline.continuous_loop.autotune import autotune
from foveacam_pipeline.continuous_loop.relay import TuneRefused
from foveacam_pipeline.continuous_loop.settings import Axis, LoopSettings
from foveacam_pipeline.continuous_loop.step_experiment import settle
from foveacam_server.resources.studying.studies.click_truth import truth_of

STANDING = Walker(x_m=0.0, z_m=11.0, radius_m=0.1, speed_m_per_s=0.1, start_s=1e6)
PASSING = Walker(x_m=0.0, z_m=9.0, radius_m=1.1, speed_m_per_s=1.4)
"""Walks past between the rig and the one who stands, every 2.5 s."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TuneRefusal:
    """`reason`: of the refusal, None where tuning succeeded; `restored`: whether everything is as before."""

    reason: str | None
    restored: bool


def tune_with_dead_axis(axis: MirrorAxis, *, binning: Binning = 1) -> TuneRefusal:
    """Let a mirror's axis get stuck where it is, then tune."""
    with open_simulated(scene="bench", inline=True) as rig:
        charged = ChargedLoop(rig, settings=LoopSettings(tracker=None), binning=binning)
        charged.choose(POSTER_PX, inverse_z_per_m=POSTER_PER_M)
        settle(charged.loop, charged.step)
        truth_of(rig).world.faults.dead_axes.add(axis)
        return _tuned(charged)


def tune_with_passer_by(*, binning: Binning) -> TuneRefusal:
    """Tune on somebody who stands, while another walks past."""
    with TemporaryDirectory() as folder:
        scene = write_square(Path(folder) / "square.toml", [STANDING, PASSING])
        with open_simulated(scene=str(scene), inline=True) as rig:
            truth = truth_of(rig)
            charged = ChargedLoop(rig, settings=LoopSettings(tracker=None), binning=binning)
            click = click_chest(truth, charged.calibration, 0, rig.head.wide().t_ns)
            if click is None:
                raise RuntimeError(
                    "the one who stands is hidden at the beginning; let the other start elsewhere"
                )
            charged.choose((click.x_px, click.y_px), inverse_z_per_m=1.0 / click.point_rig_m[2])
            return _tuned(charged)


def _tuned(charged: ChargedLoop) -> TuneRefusal:
    loop = charged.loop
    loop.held = {Axis.SHIFT_Y}
    settings, command_rad, reason = loop.settings, loop.command_rad, None
    try:
        autotune(loop, charged.step)
    except TuneRefused as refusal:
        reason = str(refusal)
    same_commands = np.array_equal(loop.command_rad, command_rad) and not loop.reference_rad.any()
    same = loop.settings == settings and loop.held == {Axis.SHIFT_Y} and not loop.forced
    return TuneRefusal(reason=reason, restored=same and same_commands)
