"""Measure fixations on simulated mirrors that scatter from move to move (`foveacam bench scatter`).

Textured clicks of both scenes with the shipped calibration, whose stated error includes the scatter as a
calibration of such mirrors states it; the simulation's truth judges them.
"""

import math
from dataclasses import replace

import numpy as np

from foveacam_bench.figures import Figures, Report
from foveacam_bench.verge.fixations import CERTIFICATE, SCENES
from foveacam_hardware.contract import Binning
from foveacam_hardware.sim.rig import open_simulated
from foveacam_hardware.simulated_faults import MirrorDisturbance
from foveacam_pipeline.models import Calibration, load_calibration
from foveacam_pipeline.models.calibration import EyeCalibration
from foveacam_server.resources.studying.studies.click_truth import ClickKind
from foveacam_server.resources.studying.studies.judged_clicks import SEED, ClickResult, judged_clicks
from foveacam_server.resources.studying.studies.simulated_rigs import bin_cameras

SCATTERS_DEG = (0.0, 0.001, 0.002, 0.006)
"""Of the line of sight, rms; the last one is what the published sweep of the real rig leaves."""
CLICKS, QUICK_CLICKS = 15, 2
"""Clicks on each scene."""


def run(
    *,
    quick: bool = False,
    binning: Binning = 2,
    seed: int = SEED,
    report: Report = lambda progress: None,
) -> Figures:
    """Click with each scatter and return the figures, by scatter in thousandths of a degree."""
    count = QUICK_CLICKS if quick else CLICKS
    figures: Figures = {"clicks": count * len(SCENES)}
    for scatter_deg in SCATTERS_DEG:
        report(f"scatter of {scatter_deg:g} degrees")
        found = [
            each
            for scene in SCENES
            for each in clicks(scene, scatter_deg, count=count, binning=binning, seed=seed)
        ]
        figures |= {f"{name}_at_{1e3 * scatter_deg:g}_mdeg": value for name, value in judged(found).items()}
    return figures


def clicks(scene: str, scatter_deg: float, *, count: int, binning: Binning, seed: int) -> list[ClickResult]:
    """Return judged clicks on a scene with mirrors of a scatter, degrees rms."""
    calibration = with_scatter(load_calibration(CERTIFICATE), scatter_deg)
    disturbance = MirrorDisturbance(scatter_rms_deg=scatter_deg)
    with open_simulated(scene=scene, inline=True, mirror_disturbance=disturbance) as rig:
        bin_cameras(rig, binning)
        quota = {ClickKind.TEXTURED: count}
        return list(judged_clicks(rig, calibration, scene=scene, quota=quota, seed=seed))


def with_scatter(calibration: Calibration, scatter_deg: float) -> Calibration:
    """Return a calibration whose stated error of both mirrors includes a scatter, degrees rms."""
    scatter_rad = math.radians(scatter_deg)

    def stating(eye: EyeCalibration) -> EyeCalibration:
        across_rad, down_rad = eye.mirror.sigma_rad
        sigma_rad = math.hypot(across_rad, scatter_rad), math.hypot(down_rad, scatter_rad)
        return replace(eye, mirror=replace(eye.mirror, sigma_rad=sigma_rad))

    return replace(calibration, left=stating(calibration.left), right=stating(calibration.right))


def judged(results: list[ClickResult]) -> dict[str, float | None]:
    """Return the shares of clicks that verged and of answers that hold, and quantiles of their errors."""
    answers = [result for result in results if not math.isnan(result.sigmas)]
    if not answers:
        return {
            "verged_fraction": 0.0,
            "answered_fraction": 0.0,
            "within_3_sigma_fraction": None,
            "sigmas_68_quantile": None,
            "sigmas_max": None,
            "distance_rel_error_median": None,
        }
    sigmas = np.abs([result.sigmas for result in answers])
    relative = [abs(result.error_m) / result.click.range_m for result in answers]
    return {
        "verged_fraction": sum(result.verged for result in results) / len(results),
        "answered_fraction": len(answers) / len(results),
        "within_3_sigma_fraction": float(np.mean(sigmas <= 3.0)),
        "sigmas_68_quantile": float(np.quantile(sigmas, 0.68)),
        "sigmas_max": float(sigmas.max()),
        "distance_rel_error_median": float(np.median(relative)),
    }
