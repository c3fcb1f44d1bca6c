"""Measure whether answers are true: wrong ones, probabilities, standard errors, and answers side by side.

Uniform clicks over the steering field of both scenes, as in `field_clicks`, each at a random time within ten
minutes after the rig's calibration, whose mounts drift another way for each click. At some of the places four
further clicks follow, up to one wide px aside on the same surface: their answers must agree. Then it is
counted how often an intact rig is told to recalibrate.
"""

import math
from collections.abc import Iterator
from itertools import combinations, pairwise
from statistics import fmean

import numpy as np
from numpy.typing import NDArray

from foveacam_bench.figures import Figures, Report
from foveacam_bench.verge.false_alarms import false_alarm_figures
from foveacam_bench.verge.field_clicks import (
    JudgedClick,
    answered_of_surfaces,
    click_record,
    judge,
    uniform_pixel,
)
from foveacam_bench.verge.fixations import CERTIFICATE, SCENES
from foveacam_bench.verge.reliability import reliability, right
from foveacam_hardware.contract import Binning
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.faults import ThermalMountDrift
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.models import Calibration, load_calibration
from foveacam_pipeline.verge.values import Basis
from foveacam_server.resources.studying.studies.click_truth import truth_of
from foveacam_server.resources.studying.studies.simulated_rigs import bin_cameras

PLACES, QUICK_PLACES = 250, 4
"""Places that are clicked in each scene."""
COMPARED, QUICK_COMPARED = 34, 1
"""How many of them are clicked again beside."""
BESIDE, BESIDE_PX, TRIES = 4, 1.0, 40
"""Further clicks, within how many wide px, and how many draws it may take to hit the same surface."""
SAME_SHARE = 0.01
"""Largest difference of distances on one surface, as a share."""
LONGEST_S = 600.0
"""Longest time since the calibration."""
SIGMAS = 3.0
QUANTILE = 0.68
ERROR_SHARES = (0.5, 0.68, 0.9, 0.95)
LIMITS_M = (1.0, 3.0, 6.0, 12.0, 22.0, 60.0)
"""Distances between which standard errors are judged together, about 2, 4, 8, 16 and 30 m."""
NAMES = {Basis.BOTH_FOVEAE: "both", Basis.FOVEA_AND_WIDE: "one", Basis.SURROUNDINGS: "surroundings"}


def run(
    *,
    quick: bool = False,
    binning: Binning = 2,
    seed: int | None = None,
    report: Report = lambda progress: None,
) -> Figures:
    """Click, judge, and return the figures; without a seed one is drawn and stated."""
    used = int(np.random.default_rng().integers(2**31)) if seed is None else seed
    count, compared = (QUICK_PLACES, QUICK_COMPARED) if quick else (PLACES, COMPARED)
    found: list[list[JudgedClick]] = []
    for scene in SCENES:
        for clicks in places(scene, count, compared=compared, seed=used, binning=binning):
            found.append(clicks)
            report(f"place {len(found)} of {count * len(SCENES)}")
    calibration = load_calibration(CERTIFICATE)
    alarms = false_alarm_figures(calibration, SCENES, seed=used, binning=binning, quick=quick, report=report)
    return {"seed": used, **figures(found), **alarms}


def places(
    scene: str, count: int, *, compared: int, seed: int, binning: Binning
) -> Iterator[list[JudgedClick]]:
    """Yield the answers at each of `count` places: one, or those side by side at the first `compared`."""
    calibration = load_calibration(CERTIFICATE)
    rng = np.random.default_rng([seed, *scene.encode()])
    left = compared
    with open_simulated(scene=scene, inline=True) as rig:
        bin_cameras(rig, binning)
        for _ in range(count):
            pixel = uniform_pixel(rng, calibration)
            _drift_anew(rig, rng)
            first = judge(rig, calibration, scene, pixel)
            further = _beside(rig, calibration, first, rng) if left else []
            left -= bool(further)
            yield [first, *further]


def _drift_anew(rig: Rig, rng: np.random.Generator) -> None:
    """Let the mounts drift since a random time, another way than before."""
    world = truth_of(rig).world
    now_s = world.scene_s(rig.clock.now_ns())
    world.drift = ThermalMountDrift(
        seed=int(rng.integers(2**31)), zero_s=now_s - float(rng.uniform(0.0, LONGEST_S))
    )


def _beside(
    rig: Rig, calibration: Calibration, first: JudgedClick, rng: np.random.Generator
) -> list[JudgedClick]:
    """Return the answers to further clicks on the same surface; none where it is not hit often enough."""
    found: list[JudgedClick] = []
    for _ in range(TRIES):
        pixel = np.array(first.pixel) + rng.uniform(-BESIDE_PX, BESIDE_PX, size=2)
        if len(found) < BESIDE and _hits(rig, first, pixel):
            found.append(judge(rig, calibration, first.scene, pixel))
    return found if len(found) == BESIDE else []


def _hits(rig: Rig, first: JudgedClick, pixel: NDArray[np.float64]) -> bool:
    x_px, y_px = pixel.tolist()
    seen = truth_of(rig).depth_at(x_px, y_px, rig.clock.now_ns())
    if seen is None or seen.name != first.name:
        return False
    return abs(seen.range_m - first.range_m) <= SAME_SHARE * first.range_m


def figures(found: list[list[JudgedClick]]) -> Figures:
    """Return the figures of the answers at each place."""
    clicks = [answers[0] for answers in found]
    known = [one for one in clicks if math.isfinite(one.sigmas)]
    compared = [consistent(answers) for answers in found if len(answers) > 1]
    stated = [
        (each.probability, right(each, one.range_m)) for one in clicks for each in one.fixation.alternatives
    ]
    wrong = [one for one in clicks if one.unsaid]
    inside = [one for one in clicks if one.inside]
    return {
        "clicks": len(clicks),
        "answered_of_surfaces_fraction": answered_of_surfaces(clicks),
        "wrong_fraction": len(wrong) / len(clicks),
        "clicks_inside": len(inside),
        "wrong_inside_fraction": sum(one.unsaid for one in inside) / max(1, len(inside)),
        "wrong_said": sum(one.wrong and not one.unsaid for one in clicks),
        **reliability(stated),
        "compared_places": len(compared),
        "consistent_fraction": fmean(compared) if compared else math.nan,
        **{f"sigma_q68_{NAMES[basis]}": quantile(known, basis) for basis in NAMES},
        "surroundings_rel_error_quantiles": _rel_errors(known, Basis.SURROUNDINGS),
        "sigma_within_3": fmean(abs(one.sigmas) <= SIGMAS for one in known) if known else math.nan,
        "sigma_by_range": list(_by_range(known)),
        "wrong_clicks": [click_record(one) for one in wrong],
        "inconsistent": [
            [click_record(one) for one in answers]
            for answers in found
            if len(answers) > 1 and not consistent(answers)
        ],
    }


def consistent(answers: list[JudgedClick]) -> bool:
    """Return whether the errors of all answers are within 3 standard errors of each other.

    Limits of a distance agree with the others where they hold; no answer contradicts nothing.
    """
    if any(one.fixation.basis is Basis.BOUND and not one.bound_holds for one in answers):
        return False
    known = [one for one in answers if one.fixation.distance_m is not None]
    return all(
        abs(one.error_m - other.error_m)
        <= SIGMAS * math.hypot(one.fixation.distance_sigma_m or 0.0, other.fixation.distance_sigma_m or 0.0)
        for one, other in combinations(known, 2)
    )


def quantile(known: list[JudgedClick], basis: Basis) -> float:
    """Return the error, in stated standard errors, below which 68 % of the answers of a basis lie."""
    sigmas = [abs(one.sigmas) for one in known if one.fixation.basis is basis]
    return float(np.quantile(sigmas, QUANTILE)) if sigmas else math.nan


def _rel_errors(known: list[JudgedClick], basis: Basis) -> dict[str, float]:
    """Return quantiles of the errors of a basis, as shares of the distance."""
    errors = [abs(one.error_m) / one.range_m for one in known if one.fixation.basis is basis]
    return {f"{share:.2f}": float(np.quantile(errors, share)) for share in ERROR_SHARES} if errors else {}


def _by_range(known: list[JudgedClick]) -> Iterator[Figures]:
    for basis, name in NAMES.items():
        for nearest_m, farthest_m in pairwise(LIMITS_M):
            here = [one for one in known if nearest_m <= one.range_m < farthest_m]
            yield {
                "basis": name,
                "from_m": nearest_m,
                "to_m": farthest_m,
                "count": sum(one.fixation.basis is basis for one in here),
                "q68": quantile(here, basis),
            }
