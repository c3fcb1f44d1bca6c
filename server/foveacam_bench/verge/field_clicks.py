"""Measure whether every click is answered: uniform clicks over the steering field, none left out.

Each click of both scenes is fixated on the simulated rig in virtual time, with the shipped calibration, and
judged by the simulation's truth at the moment of the last look. A distance with an error above both 3 % and
5 standard errors is wrong; unsaid if the truth is not among its alternatives either.
"""

import math
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import chain
from statistics import median

import numpy as np
from numpy.typing import NDArray

from foveacam_bench.figures import Figures, Report
from foveacam_bench.verge.fixations import CERTIFICATE, SCENES
from foveacam_bench.verge.reliability import reliability, right, said
from foveacam_hardware.contract import Binning
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.rig import open_simulated
from foveacam_hardware.sim.truth import TrueSurfacePoint, Truth
from foveacam_pipeline.models import Calibration, load_calibration
from foveacam_pipeline.verge.estimate import DistanceEstimate
from foveacam_pipeline.verge.fixate import PriorKnowledge, fixate
from foveacam_pipeline.verge.values import Basis, Fixation, PixelTarget
from foveacam_pipeline.wide_depth.looks import fuse_fixation
from foveacam_pipeline.wide_depth.wide_context import WideContext
from foveacam_server.resources.studying.studies.click_truth import (
    EYES,
    Click,
    classify_click,
    clicked_point_at,
    truth_of,
    visible_from,
)
from foveacam_server.resources.studying.studies.judged_clicks import WRONG_SHARE, WRONG_SIGMA
from foveacam_server.resources.studying.studies.simulated_rigs import bin_cameras

CLICKS, QUICK_CLICKS = 400, 6
"""Clicks on each scene."""
FIELD_DEG = (8.0, 7.5)
"""Half sides of the field of clicks, axis-wise."""
LOOKED_AT_PX = 5.0
"""Largest distance of a point from the image centre of a fovea that looks at it, fovea px."""
INSIDE_PX = (1.0, 2.0)
"""Wide px about a click, in eight directions, that must show the same surface for it to be inside of that."""
SAME_SHARE = 0.03
"""Largest difference of their distances, as a share."""
SEED = 14


@dataclass(frozen=True, slots=True, kw_only=True)
class JudgedClick:
    """One click, its fixation, the truth at the moment of the last look; `range_m` inf: the background."""

    scene: str
    pixel: tuple[float, float]
    name: str
    seen_by: str
    """Which eyes see the point when it is clicked: both, left, right, none."""
    range_m: float
    fixation: Fixation
    off_centre_px: float
    """Distance of the point from the centre of the nearer fovea image, fovea px."""
    inside: bool = True
    """Whether all about the clicked place is one surface; else the click may mean another one."""
    estimates: tuple[DistanceEstimate, ...] = ()
    """Estimates reported after the looks before the last one."""

    @property
    def error_m(self) -> float:
        """Error of the distance, m; NaN without a distance."""
        distance_m = self.fixation.distance_m
        return math.nan if distance_m is None else distance_m - self.range_m

    @property
    def sigmas(self) -> float:
        """Error over the stated standard error."""
        return self.error_m / (self.fixation.distance_sigma_m or math.nan)

    @property
    def estimate_sigmas(self) -> list[float]:
        """Errors of the estimates over their stated standard errors; infinite where it is the background."""
        points = [estimate.point for estimate in self.estimates]
        return [(point.distance_m - self.range_m) / point.distance_sigma_m for point in points]

    @property
    def wrong(self) -> bool:
        """Whether the distance is wrong; of the background any is that does not reach to infinity."""
        distance_m, sigma_m = self.fixation.distance_m, self.fixation.distance_sigma_m
        if math.isinf(self.range_m) and distance_m is not None and sigma_m is not None:
            return distance_m > WRONG_SIGMA * sigma_m
        return abs(self.error_m) > WRONG_SHARE * self.range_m and abs(self.sigmas) > WRONG_SIGMA

    @property
    def unsaid(self) -> bool:
        """Whether the distance is wrong, and the true one not among the alternatives."""
        return self.wrong and not said(self.fixation.alternatives, self.range_m)

    @property
    def visible(self) -> bool:
        """Whether a point of a surface was clicked that at least one eye sees."""
        return math.isfinite(self.range_m) and self.seen_by != "none"

    @property
    def bound_holds(self) -> bool:
        """Whether the true distance is within the bound."""
        bound = self.fixation.bound
        return bound is not None and bound.nearest_m <= self.range_m <= bound.farthest_m

    @property
    def answer_s(self) -> float:
        """Time to the answer: the rig's clock plus the computing time."""
        own_ms = sum(step.compute_ms for step in self.fixation.steps)
        return (self.fixation.duration_ms + own_ms) / 1e3


def run(
    *,
    quick: bool = False,
    binning: Binning = 1,
    seed: int = SEED,
    report: Report = lambda progress: None,
) -> Figures:
    """Click, judge, and return the figures; `doubtful` lists the clicks to be examined."""
    count = QUICK_CLICKS if quick else CLICKS
    found: list[JudgedClick] = []
    for answer in chain.from_iterable(answers(scene, count, seed=seed, binning=binning) for scene in SCENES):
        found.append(answer)
        report(f"click {len(found)} of {count * len(SCENES)}")
    return {"seed": seed, **figures(found)}


def answers(scene: str, count: int, *, seed: int = SEED, binning: Binning = 1) -> Iterator[JudgedClick]:
    """Yield the answer to each of `count` clicks on one scene."""
    calibration = load_calibration(CERTIFICATE)
    rng = np.random.default_rng([seed, *scene.encode()])
    with open_simulated(scene=scene, inline=True) as rig:
        bin_cameras(rig, binning)
        for _ in range(count):
            yield judge(rig, calibration, scene, uniform_pixel(rng, calibration))


def uniform_pixel(rng: np.random.Generator, calibration: Calibration) -> NDArray[np.float64]:
    """Draw a wide pixel (2,), uniform over the steering field."""
    limit_deg = np.array(FIELD_DEG)
    angles_rad = np.radians(rng.uniform(-limit_deg, limit_deg))
    pixel: NDArray[np.float64] = calibration.wide.pixels(angles_rad[None])[0]
    return pixel


def judge(
    rig: Rig,
    calibration: Calibration,
    scene: str,
    pixel: NDArray[np.float64],
    *,
    context: WideContext | None = None,
) -> JudgedClick:
    """Fixate one click and compare with the truth; `context` is used and updated."""
    truth = truth_of(rig)
    x_px, y_px = pixel.tolist()
    shown = rig.head.wide()  # a click refers to the shown picture, which is a moment old
    click = classify_click(truth, calibration, scene=scene, pixel=(x_px, y_px), t_ns=shown.t_ns)
    target, known = PixelTarget(x_px=x_px, y_px=y_px), PriorKnowledge(context=context)
    estimates: list[DistanceEstimate] = []
    fixation = fixate(
        rig.head,
        calibration,
        target,
        clock=rig.clock,
        known=known,
        clicked=shown,
        on_estimate=estimates.append,
    )
    if context is not None:
        fuse_fixation(context, fixation, calibration)
    t_ns = rig.clock.now_ns() if fixation.sighting is None else fixation.sighting.left.t_ns
    point = None if click is None else clicked_point_at(truth, click, t_ns)
    return JudgedClick(
        scene=scene,
        pixel=(x_px, y_px),
        name="background" if click is None else click.name,
        seen_by="both" if click is None else _seen_by(truth, click),
        range_m=math.inf if point is None else float(np.linalg.norm(point)),
        fixation=replace(fixation, sighting=None),  # frees the frames
        off_centre_px=_off_centre_px(truth, fixation, truth.wide_rays(pixel[None])[0], point),
        inside=_inside(truth, (x_px, y_px), shown.t_ns),
        estimates=tuple(estimates),
    )


def _inside(truth: Truth, pixel: tuple[float, float], t_ns: int) -> bool:
    clicked = truth.depth_at(*pixel, t_ns)
    turns = np.arange(8) * (math.pi / 4.0)
    about = [(radius * math.cos(turn), radius * math.sin(turn)) for radius in INSIDE_PX for turn in turns]
    return all(_same(clicked, truth.depth_at(pixel[0] + x, pixel[1] + y, t_ns)) for x, y in about)


def _same(one: TrueSurfacePoint | None, other: TrueSurfacePoint | None) -> bool:
    """Return whether two places show one surface; None: the background."""
    if one is None or other is None:
        return one is other
    return one.name == other.name and abs(one.range_m - other.range_m) <= SAME_SHARE * one.range_m


def _seen_by(truth: Truth, click: Click) -> str:
    seen = [role.value for role in EYES if visible_from(truth, role, click)]
    return "both" if len(seen) == 2 else "".join(seen) or "none"


def _off_centre_px(
    truth: Truth, fixation: Fixation, ray: NDArray[np.float64], point_rig_m: NDArray[np.float64] | None
) -> float:
    """Return the distance of the point, or of the background's direction, from the nearer image centre."""
    sighting = fixation.sighting
    if sighting is None:
        return math.inf
    off_px = []
    for role, frame in zip(EYES, (sighting.left, sighting.right), strict=True):
        view = truth.projection(role, frame.t_ns)
        far_point = view.C + 1e6 * ray if point_rig_m is None else point_rig_m
        middle = np.array([(view.width - 1) / 2, (view.height - 1) / 2])
        off_px.append(float(np.linalg.norm(view.project(far_point)[0] - middle)))
    return min((off for off in off_px if math.isfinite(off)), default=math.inf)


def figures(results: list[JudgedClick]) -> Figures:
    """Return the figures of a list of answers."""
    answered = [r for r in results if r.fixation.distance_m is not None]
    bounds = [r for r in results if r.fixation.basis is Basis.BOUND]
    found: Figures = {
        "clicks": len(results),
        "answered_fraction": len(answered) / len(results),
        "answered_of_surfaces_fraction": answered_of_surfaces(results),
        "both_foveae_fraction": _share(results, Basis.BOTH_FOVEAE),
        "looked_at_fraction": _looked_at(results),
        "looked_at_of_visible_fraction": _looked_at([r for r in results if r.visible]),
        "wrong": sum(r.wrong for r in results),
        "wrong_unsaid": sum(r.unsaid for r in results),
        "within_3_sigma_fraction": _within_3_sigma(answered),
        "bound_holds_fraction": sum(r.bound_holds for r in bounds) / len(bounds) if bounds else math.nan,
        "no_answer": sum(r.fixation.basis is None for r in results),
        "states": dict(Counter(r.fixation.state.value for r in results)),
    }
    found |= _estimate_figures([r for r in results if math.isfinite(r.range_m)])
    found |= reliability(
        [(one.probability, right(one, r.range_m)) for r in results for one in r.fixation.alternatives]
    )
    for basis in Basis:
        of_basis = [r for r in results if r.fixation.basis is basis]
        found |= _figures_of(basis, of_basis)
    return found | {"doubtful": [click_record(r) for r in results if _is_doubtful(r)]}


def _estimate_figures(results: list[JudgedClick]) -> Figures:
    """Return the figures of the estimates reported for surfaces before the answers."""
    sigmas = [abs(value) for result in results for value in result.estimate_sigmas]
    return {
        "estimates": len(sigmas),
        "estimates_within_3_sigma_fraction": float(np.mean(np.array(sigmas) <= 3.0)) if sigmas else math.nan,
        "estimates_sigmas_median": _median(sigmas),
    }


def _figures_of(basis: Basis, results: list[JudgedClick]) -> Figures:
    answer_s = [r.answer_s for r in results]
    found: Figures = {
        f"{basis}_count": len(results),
        f"{basis}_answer_s_median": _median(answer_s),
        f"{basis}_answer_s_p95": float(np.quantile(answer_s, 0.95)) if answer_s else math.nan,
    }
    if basis is not Basis.BOUND:
        found[f"{basis}_within_3_sigma_fraction"] = _within_3_sigma(results)
        found[f"{basis}_rel_error_median"] = _median(abs(r.error_m) / r.range_m for r in results)
        found[f"{basis}_rel_sigma_median"] = _median(
            (r.fixation.distance_sigma_m or math.nan) / (r.fixation.distance_m or math.nan) for r in results
        )
    return found


def _median(values: Iterable[float]) -> float:
    """Return the median; NaN without values."""
    ordered = list(values)
    return median(ordered) if ordered else math.nan


def answered_of_surfaces(results: list[JudgedClick]) -> float:
    """Return the share of clicks on surfaces that have a distance; the background has none."""
    surfaces = [r for r in results if math.isfinite(r.range_m)]
    return sum(r.fixation.distance_m is not None for r in surfaces) / len(surfaces) if surfaces else math.nan


def _looked_at(results: list[JudgedClick]) -> float:
    """Return the share of clicks whose point is near the centre of a fovea image at the last look."""
    near = sum(r.off_centre_px <= LOOKED_AT_PX for r in results)
    return near / len(results) if results else math.nan


def _share(results: list[JudgedClick], basis: Basis) -> float:
    return sum(r.fixation.basis is basis for r in results) / len(results)


def _within_3_sigma(results: list[JudgedClick]) -> float:
    return sum(abs(r.sigmas) <= 3.0 for r in results) / len(results) if results else math.nan


def _is_doubtful(result: JudgedClick) -> bool:
    answered = result.fixation.distance_m is not None
    off_target = result.off_centre_px > LOOKED_AT_PX
    return not answered or result.wrong or abs(result.sigmas) > 3.0 or off_target


def click_record(result: JudgedClick) -> Figures:
    """Return the details of one click, for diagnosis."""
    fixation = result.fixation
    return {
        "scene": result.scene,
        "name": result.name,
        "seen_by": result.seen_by,
        "pixel": [round(value, 1) for value in result.pixel],
        "range_m": round(result.range_m, 4),
        "basis": fixation.basis,
        "state": fixation.state,
        "reason": fixation.reason,
        "distance_m": fixation.distance_m,
        "distance_sigma_m": fixation.distance_sigma_m,
        "sigmas": round(result.sigmas, 2),
        "wrong": result.wrong,
        "bound": None if fixation.bound is None else [fixation.bound.nearest_m, fixation.bound.farthest_m],
        "off_centre_px": round(result.off_centre_px, 1),
        "looks": len(fixation.steps),
        "answer_s": round(result.answer_s, 3),
    }
