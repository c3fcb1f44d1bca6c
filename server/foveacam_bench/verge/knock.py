"""Measure after how many clicks a move of the mounts is reported: both eyes' mounts are knocked.

Clicks are on texture that both eyes can see, with the calibration from before the knock. A knock is seen in a
failed fixation (`Fixation.astray`) or in residuals (`HealthMonitor`), and reported when the calibration's
health asks to recalibrate.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from foveacam_bench.figures import Figures
from foveacam_hardware.contract import DeviceFault
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.rig import open_simulated
from foveacam_hardware.simulated_faults import MountKnock, SimulatedFaults
from foveacam_pipeline.calibrate.drift.health import HealthMonitor, HealthVerdict
from foveacam_pipeline.models import Calibration
from foveacam_pipeline.verge.fixate import fixate
from foveacam_pipeline.verge.values import FixationState, PixelTarget
from foveacam_server.resources.studying.studies.click_truth import Click, ClickKind, classify_click, truth_of
from foveacam_server.resources.studying.studies.judged_clicks import FARTHEST_M, NEAREST_M

KNOCKS, QUICK_KNOCKS = 3, 1
"""Knocks in each scene."""
CLICKS, QUICK_CLICKS = 12, 3
SHIFT_DEG, ROLL_DEG = 0.3, 0.1
BORDER_PX = 200.0
SEED = 7


@dataclass(frozen=True, slots=True, kw_only=True)
class KnockResult:
    """Result of the clicks after one knock; `reported_after`: clicks until it is reported, None if never."""

    failed: int
    explained: int
    reported_after: int | None


def knock_figures(calibration: Calibration, scenes: tuple[str, ...], *, quick: bool) -> Figures:
    """Return how many clicks it takes until a knock is reported, and the share of failures that name it."""
    count, clicks = (QUICK_KNOCKS, QUICK_CLICKS) if quick else (KNOCKS, CLICKS)
    every = [
        found for scene in scenes for found in _knock_and_click(scene, calibration, count=count, each=clicks)
    ]
    reported_after = [found.reported_after for found in every if found.reported_after is not None]
    return {
        "knocks": len(every),
        "knocks_told_fraction": len(reported_after) / len(every),
        "knock_told_after_clicks_max": max(reported_after, default=None),
        "knock_failures_explained_fraction": sum(found.explained for found in every)
        / max(1, sum(found.failed for found in every)),
    }


def _knock_and_click(scene: str, calibration: Calibration, *, count: int, each: int) -> Iterator[KnockResult]:
    rng = np.random.default_rng([SEED, *scene.encode()])
    with open_simulated(scene=scene, inline=True) as rig:
        if rig.breakable is None:
            raise DeviceFault("bench verge: the simulated rig has no faults; use open_simulated")
        for _ in range(count):
            rig.breakable.set_faults(SimulatedFaults(knocked_left=_knock(rng), knocked_right=_knock(rng)))
            clicks = [textured_click(rig, calibration, scene, rng) for _ in range(each)]
            yield _make_clicks(rig, calibration, clicks)


def _make_clicks(rig: Rig, calibration: Calibration, clicks: list[Click]) -> KnockResult:
    monitor, failed, explained, reported_after = HealthMonitor(calibration), 0, 0, None
    for number, click in enumerate(clicks, start=1):
        target = PixelTarget(x_px=click.x_px, y_px=click.y_px)
        fixation = fixate(rig.head, calibration, target, clock=rig.clock)
        failed += fixation.state is not FixationState.VERGED
        explained += fixation.target_offset is not None
        monitor.add(fixation)
        if reported_after is None and monitor.health.verdict is HealthVerdict.RECALIBRATE:
            reported_after = number
    return KnockResult(failed=failed, explained=explained, reported_after=reported_after)


def _knock(rng: np.random.Generator) -> MountKnock:
    heading = rng.uniform(0.0, 2.0 * math.pi)
    return MountKnock(
        shift_x_deg=SHIFT_DEG * math.cos(heading),
        shift_y_deg=SHIFT_DEG * math.sin(heading),
        rotation_deg=math.copysign(ROLL_DEG, rng.uniform(-1.0, 1.0)),
    )


def textured_click(rig: Rig, calibration: Calibration, scene: str, rng: np.random.Generator) -> Click:
    """Return a click on texture that both eyes would see without the knock."""
    truth = truth_of(rig)
    size = np.array([calibration.wide.width, calibration.wide.height])
    while True:
        x, y = rng.uniform(BORDER_PX, size - BORDER_PX).tolist()
        click = classify_click(truth, calibration, scene=scene, pixel=(x, y), t_ns=rig.clock.now_ns())
        if (
            click is not None
            and click.kind is ClickKind.TEXTURED
            and NEAREST_M <= click.range_m <= FARTHEST_M
        ):
            return click
