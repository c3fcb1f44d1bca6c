"""Orders executed between two looks of a running loop: new target, split eyes, sliders, settings."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Busy, Clock, FoveaError, Frame, Head, Role
from foveacam_pipeline.continuous_loop.settings import Axis, LoopSettings
from foveacam_pipeline.continuous_loop.split_eyes import SplitEyes
from foveacam_pipeline.continuous_loop.vergence_loop import VergenceLoop
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.track.watching_head import WatchingHead
from foveacam_pipeline.verge.fixate import PriorKnowledge, fixate
from foveacam_pipeline.verge.surroundings.depth_samples import DepthContext
from foveacam_pipeline.verge.values import Basis, Target
from foveacam_server.resources.looking.loop.loop_run import LoopRun
from foveacam_server.resources.looking.loop.schema import LoopPatch
from foveacam_server.rig.hardware import HardwareThread

FIRST_INVERSE_Z_PER_M = 0.2
"""Inverse depth at which the loop begins when the target's distance is unknown."""
TRACKER_SETTINGS = ("tracker", "box_width_px", "box_height_px")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FirstTarget:
    """A requested target; `place`: (2,) tangents in `clicked`, a wide frame, or in the newest one.

    `distance_m`: distance to begin at; None: both foveae look for the target first.
    """

    target: Target
    place: NDArray[np.float64]
    clicked: Frame | None
    distance_m: float | None


def choose_target(
    run: LoopRun,
    head: Head,
    wanted: FirstTarget,
    *,
    calibration: Calibration,
    clock: Clock,
    context: DepthContext,
) -> None:
    """Start the loop at a target; raise `OutOfRange` where the tracker finds nothing to follow."""
    frame = head.wide() if wanted.clicked is None else wanted.clicked
    known = wanted.distance_m
    way = float(np.hypot(1.0, np.hypot(*wanted.place)))
    run.loop.choose(
        frame, wanted.place, inverse_z_per_m=FIRST_INVERSE_Z_PER_M if known is None else way / known
    )
    unite(run)
    if known is not None or Axis.VERGE in run.loop.held:
        return
    found = fixate(
        WatchingHead(head, run.loop.see_wide),
        calibration,
        wanted.target,
        known=PriorKnowledge(context=context),
        clicked=wanted.clicked,
        clock=clock,
    )
    if found.basis is Basis.BOTH_FOVEAE and found.point_rig_m is not None:
        run.loop.set_command(Axis.VERGE, calibration.baseline_m / found.point_rig_m[2])


def part_eyes(
    run: LoopRun,
    head: Head,
    role: Role,
    pixel: tuple[float, float],
    *,
    hardware: HardwareThread,
    new_split: Callable[[], SplitEyes],
) -> None:
    """Keep a pixel of one eye's last frame centred; raise `OutOfRange` where nothing can be followed."""
    step = run.split_step or run.last
    sighting = None if step is None else step.sighting
    if sighting is None:
        if (pose := hardware.pose) is None:
            raise Busy("the mirrors' pose is not known; look at something first", found="no pose")
        sighting = head.look(pose)
    split = run.split or new_split()
    frame = sighting.left if role is Role.LEFT else sighting.right
    split.choose(role, frame, pixel, sighting.volts)
    run.split = split


def unite(run: LoopRun) -> None:
    """End the split of the eyes: both look at the common target again."""
    run.split = run.split_step = None


def apply_patch(loop: VergenceLoop, patch: LoopPatch) -> None:
    """Set commands, hold axes and pause as requested; setting an axis holds it."""
    for name, command_deg in (patch.command_deg or {}).items():
        loop.held.add(Axis(name))
        loop.set_command(Axis(name), float(np.radians(command_deg)))
    for name, held in (patch.held or {}).items():
        (loop.held.add if held else loop.held.discard)(Axis(name))
    if patch.paused is not None:
        loop.paused = patch.paused


def configure(loop: VergenceLoop, settings: LoopSettings, head: Head) -> None:
    """Apply other settings; where the tracker cannot learn the target, restore the earlier ones and raise."""
    before = loop.settings
    loop.settings = settings
    if all(getattr(before, name) == getattr(settings, name) for name in TRACKER_SETTINGS):
        return
    try:
        loop.learn_again(head.wide())
    except FoveaError:
        loop.settings = before
        raise
