"""Measure how often an intact rig is told to recalibrate, while its mounts drift with the temperature.

Each run begins at a calibration, whose shipped errors state that drift, and clicks for half an hour on
texture that both eyes can see: as slowly as on a busy machine, so that the mounts move between the clicks.
"""

from collections.abc import Iterator

import numpy as np

from foveacam_bench.figures import Figures, Report
from foveacam_bench.verge.knock import textured_click
from foveacam_hardware.contract import Binning
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.faults import ThermalMountDrift
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.calibrate.drift.health import HealthMonitor, HealthReport, HealthVerdict
from foveacam_pipeline.models import Calibration
from foveacam_pipeline.verge.fixate import fixate
from foveacam_pipeline.verge.values import PixelTarget
from foveacam_server.resources.studying.studies.click_truth import truth_of
from foveacam_server.resources.studying.studies.simulated_rigs import bin_cameras

RUNS, QUICK_RUNS = 25, 1
"""Runs on each scene."""
CLICKS, QUICK_CLICKS = 12, 6
APART_S = 150.0
"""Time between two clicks."""


def false_alarm_figures(
    calibration: Calibration,
    scenes: tuple[str, ...],
    *,
    seed: int,
    binning: Binning,
    quick: bool,
    report: Report,
) -> Figures:
    """Return the number of runs, and of those in which the health ever asked to recalibrate."""
    runs, clicks = (QUICK_RUNS, QUICK_CLICKS) if quick else (RUNS, CLICKS)
    found: list[list[HealthReport]] = []
    for scene in scenes:
        rng = np.random.default_rng([seed, *scene.encode()])
        with open_simulated(scene=scene, inline=True) as rig:
            bin_cameras(rig, binning)
            for _ in range(runs):
                found.append(list(_reports(rig, calibration, scene, rng, clicks=clicks)))
                report(f"run {len(found)} of {runs * len(scenes)} of the health")
    scores = [report.score for reports in found for report in reports if report.score is not None]
    return {
        "health_runs": len(found),
        "health_false_alarms": sum(
            any(report.verdict is HealthVerdict.RECALIBRATE for report in reports) for reports in found
        ),
        "health_score_max": max(scores, default=None),
    }


def _reports(
    rig: Rig, calibration: Calibration, scene: str, rng: np.random.Generator, *, clicks: int
) -> Iterator[HealthReport]:
    """Yield the health after each click of one run, whose mounts begin to drift another way than before."""
    world = truth_of(rig).world
    zero_s = world.scene_s(rig.clock.now_ns())
    world.drift = ThermalMountDrift(seed=int(rng.integers(2**31)), zero_s=zero_s)
    monitor = HealthMonitor(calibration)
    for _ in range(clicks):
        rig.clock.sleep_until_ns(rig.clock.now_ns() + round(1e9 * APART_S))
        click = textured_click(rig, calibration, scene, rng)
        target = PixelTarget(x_px=click.x_px, y_px=click.y_px)
        monitor.add(fixate(rig.head, calibration, target, clock=rig.clock))
        yield monitor.health
