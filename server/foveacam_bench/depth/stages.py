"""Measure where the processor time of dense depth goes, and its overhead over bare OpenCV SGBM.

One thread, so that the figures of both are those of one core. `match` and `depth_map` are composed of the
same functions in the same order.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from statistics import median

import cv2
import numpy as np

from foveacam_bench.figures import Figures
from foveacam_hardware.contract import Sighting
from foveacam_pipeline.models import Calibration
from foveacam_pipeline.stereo.depth import depth_map
from foveacam_pipeline.stereo.errors import SEMI_GLOBAL, accept_matches
from foveacam_pipeline.stereo.match import acceptance, gray, leave_out, match
from foveacam_pipeline.stereo.occlusion import occluded_pixels
from foveacam_pipeline.stereo.rectify import rectify
from foveacam_pipeline.stereo.refine import refine
from foveacam_pipeline.stereo.search import DEFAULT, matcher, search_window, with_margins
from foveacam_pipeline.stereo.tiles import match_tiles, plan_search
from foveacam_pipeline.stereo.values import DepthMap, DisparityMap, RectifiedPair

STAGES = ("rectify", "coarse_search", "search", "contradict", "refine", "errors", "occlusion", "depth")


@dataclass(frozen=True, slots=True)
class StageTimes:
    """Processor time of each stage, ms, one entry a run."""

    runs_ms: dict[str, list[float]] = field(default_factory=lambda: {stage: [] for stage in STAGES})

    @contextmanager
    def of(self, stage: str) -> Iterator[None]:
        """Add the processor time of the context to a stage."""
        began_s = time.process_time()
        yield
        self.runs_ms[stage].append(1e3 * (time.process_time() - began_s))


@dataclass(frozen=True, slots=True, kw_only=True)
class LookCost:
    """Median processor times of one look, ms: depth as a whole, bare OpenCV, and the stages."""

    ours_ms: float
    bare_ms: float
    stages_ms: dict[str, float]

    @staticmethod
    def overhead_ratio(looks: "list[LookCost]") -> float:
        """Return the time of the depth of looks beyond that of bare OpenCV, over the latter."""
        return sum(one.ours_ms for one in looks) / sum(one.bare_ms for one in looks) - 1.0


def staged_depth(
    sighting: Sighting, calibration: Calibration, times: StageTimes, *, scale: float = 0.5
) -> DepthMap:
    """Return the depth of a look as `depth_map(pair, match(pair))` does, and time each stage."""
    with times.of("rectify"):
        pair = rectify(sighting, calibration, scale=scale)
    with times.of("coarse_search"):
        grays = gray(pair.left), gray(pair.right)
        plan = plan_search(pair, grays, DEFAULT)
    with times.of("search"):
        found = match_tiles(grays, plan.tiles, DEFAULT)
    with times.of("contradict"):
        leave_out(found, pair, plan)
    with times.of("refine"):
        refinement = refine(*grays, np.nan_to_num(found), pair.valid_right)
    with times.of("errors"):
        residual, sigma, wrong = accept_matches(
            found, refinement, model=SEMI_GLOBAL, settings=acceptance(DEFAULT)
        )
    with times.of("occlusion"):
        occluded = occluded_pixels(residual)
    with times.of("depth"):
        disparity = DisparityMap(
            residual_px=residual, sigma_px=sigma, compute_ms=0.0, occluded=occluded, wrong=wrong
        )
        return depth_map(pair, disparity)


def overhead_figures(
    looks: dict[str, list[Sighting]], calibration: Calibration, *, runs: int, scale: float = 0.5
) -> Figures:
    """Return the overhead over bare OpenCV of looks at each binning, all looks of it together.

    `overhead_ratio` is the larger one of the binnings, `overhead_ratio_worst_look` the largest of any look.
    """
    costs = {
        name: [look_cost(each, calibration, runs=runs, scale=scale) for each in looks[name]] for name in looks
    }
    ratios = {name: LookCost.overhead_ratio(each) for name, each in costs.items()}
    figures: Figures = {
        "overhead_ratio": max(ratios.values()),
        "overhead_ratio_worst_look": max(
            LookCost.overhead_ratio([one]) for each in costs.values() for one in each
        ),
        "stages_ms": {name: _mean_stages(each) for name, each in costs.items()},
    }
    for name, each in costs.items():
        figures |= {
            f"overhead_ratio_{name}": ratios[name],
            f"ours_cpu_ms_{name}": _mean([one.ours_ms for one in each]),
            f"opencv_cpu_ms_{name}": _mean([one.bare_ms for one in each]),
        }
    return figures


def look_cost(sighting: Sighting, calibration: Calibration, *, runs: int, scale: float = 0.5) -> LookCost:
    """Time the depth of a look, its stages and OpenCV's matcher alternately, by one thread."""
    bare = _bare_search(rectify(sighting, calibration, scale=scale))

    def ours() -> DepthMap:
        pair = rectify(sighting, calibration, scale=scale)
        return depth_map(pair, match(pair))

    threads, times = cv2.getNumThreads(), StageTimes()
    ours_ms, bare_ms = [], []
    cv2.setNumThreads(1)
    try:
        for _ in range(runs + 1):
            ours_ms.append(_cpu_ms(ours))
            bare_ms.append(_cpu_ms(bare))
            staged_depth(sighting, calibration, times, scale=scale)
    finally:
        cv2.setNumThreads(threads)
    return LookCost(
        ours_ms=median(ours_ms[1:]),
        bare_ms=median(bare_ms[1:]),
        stages_ms={stage: median(each[1:]) for stage, each in times.runs_ms.items()},
    )


def _bare_search(pair: RectifiedPair) -> Callable[[], object]:
    """Return one call of OpenCV's matcher, 128 px about the verged depth, with margins and speckle filter."""
    first, count = search_window(pair)
    images, _ = with_margins((gray(pair.left), gray(pair.right)), first=first, count=count)
    opencv = matcher(first=first, count=count, settings=DEFAULT, speckle_px=DEFAULT.speckle_px)
    return lambda: opencv.compute(*images)


def _mean_stages(costs: list[LookCost]) -> dict[str, float]:
    return {stage: _mean([one.stages_ms[stage] for one in costs]) for stage in STAGES}


def _mean(values: list[float]) -> float:
    return sum(values) / len(values)


def _cpu_ms(work: Callable[[], object]) -> float:
    began_s = time.process_time()
    work()
    return 1e3 * (time.process_time() - began_s)
