"""Checks of the stand-off study: closed forms against Monte Carlo, exact regions against cells."""

import math
import statistics
import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Protocol

import numpy as np

from foveacam_pipeline.study.visibility.maps import RandomMap, random_map
from foveacam_pipeline.study.visibility.obstacles import (
    RandomObstacles,
    SampledProbability,
    clear_probability,
    corridor_m2,
    sample_clear_share,
    sample_corridor_share,
    sample_success,
    success_probability,
    success_slope_per_m,
)
from foveacam_pipeline.study.visibility.raster_regions import raster_areas_m2, raster_regions
from foveacam_pipeline.study.visibility.regions import feasible_regions, region_areas
from foveacam_pipeline.study.visibility.standoff import StandoffRing

DOMAIN_M2 = 3000.0
CLUTTERS = tuple(
    RandomObstacles(occupancy=p, radius_m=radius_m)
    for p, radius_m in product((0.0, 0.01, 0.05, 0.2), (0.15, 0.4))
)
RINGS = (
    StandoffRing(inner_m=5.0, outer_m=10.0),
    StandoffRing(inner_m=2.0, outer_m=20.0),
    StandoffRing(inner_m=0.0, outer_m=12.0),
)
LINES_M = (2.0, 5.0, 15.0)
SLOPE_AT_M = (8.0, 16.0)
HALF_STEP_M = 0.5
"""Half the width of the ring whose sampled share of observers approximates the slope of Eq. 13."""

CELL_M = 0.05
CHECKED_MAP = RandomMap(obstacle_count=40, target_count=5)
CHECKED_RING = StandoffRing(inner_m=2.0, outer_m=8.0)
EXACT_RUNS = 9


class _Draw(Protocol):
    def __call__(self, *, trials: int, rng: np.random.Generator) -> SampledProbability: ...


_Setting = tuple[int, str, float, _Draw]


@dataclass(frozen=True, slots=True, kw_only=True)
class ProbabilityCheck:
    """One setting: the probability by the paper's `equation`, and the same by Monte Carlo."""

    equation: int
    setting: str
    exact: float
    drawn: SampledProbability

    @property
    def z(self) -> float:
        """Distance of the sampled from the exact probability, in standard errors of the exact one."""
        return (self.drawn.value - self.exact) / math.sqrt(
            self.exact * (1.0 - self.exact) / self.drawn.trials
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class RasterCheck:
    """Exact regions against cells on one map: largest relative difference of areas, CPU seconds of both."""

    rel_diff: float
    exact_s: float
    raster_s: float

    @property
    def speedup(self) -> float:
        """Time of the cells over time of the exact regions."""
        return self.raster_s / self.exact_s


def closed_forms(*, trials: int, seed: int) -> tuple[ProbabilityCheck, ...]:
    """Return every closed form of Eqs. 10-13 with its Monte Carlo estimate, each with its own generator."""
    return tuple(
        ProbabilityCheck(
            equation=equation,
            setting=setting,
            exact=exact,
            drawn=draw(trials=trials, rng=np.random.default_rng([seed, n])),
        )
        for n, (equation, setting, exact, draw) in enumerate(_settings())
    )


def raster_check(seed: int) -> RasterCheck:
    """Compare exact regions with cells of 5 cm on a map of 40 obstacles and 5 targets: areas and CPU time.

    The exact time is the median of several runs. The cells are tested by numpy, many at once, and only those
    in the ring and free of obstacles against lines of sight.
    """
    radius_m = CHECKED_MAP.agent_radius_m
    field = random_map(CHECKED_MAP, seed=seed)
    exact_s = []
    for _ in range(EXACT_RUNS):
        start_s = time.process_time()
        regions = feasible_regions(field, CHECKED_RING, agent_radius_m=radius_m)
        exact_s.append(time.process_time() - start_s)
    start_s = time.process_time()
    masks = raster_regions(field, CHECKED_RING, agent_radius_m=radius_m, cell_m=CELL_M)
    raster_s = time.process_time() - start_s
    found = region_areas(regions)
    pairs = zip(
        raster_areas_m2(masks, cell_m=CELL_M),
        (found.multi_m2, found.single_m2, found.weighted_m2),
        strict=True,
    )
    return RasterCheck(
        rel_diff=max(abs(by_cells / exact - 1.0) for by_cells, exact in pairs),
        exact_s=statistics.median(exact_s),
        raster_s=raster_s,
    )


def _settings() -> Iterator[_Setting]:
    for length_m, radius_m in product(LINES_M, (0.15, 0.4)):
        box_m2 = (length_m + 2.0 * radius_m) * 2.0 * radius_m
        share = float(corridor_m2(length_m, radius_m)) / box_m2
        draw = partial(sample_corridor_share, length_m, radius_m)
        yield 10, f"d = {length_m:g} m, r_o = {radius_m:g} m", share, draw
    for length_m, clutter in product(LINES_M, CLUTTERS):
        if clutter.occupancy > 0.0:
            clear = float(clear_probability(length_m, clutter))
            yield (
                11,
                f"d = {length_m:g} m, {_clutter_text(clutter)}",
                clear,
                partial(sample_clear_share, length_m, clutter),
            )
    for around, clutter in product(RINGS, CLUTTERS):
        exact = success_probability(around, clutter, domain_m2=DOMAIN_M2)
        title = f"D from {around.inner_m:g} to {around.outer_m:g} m, {_clutter_text(clutter)}"
        yield 12, title, exact, partial(sample_success, around, clutter, domain_m2=DOMAIN_M2)
    for d_max_m, clutter in product(SLOPE_AT_M, CLUTTERS):
        thin = StandoffRing(inner_m=d_max_m - HALF_STEP_M, outer_m=d_max_m + HALF_STEP_M)
        slope = success_slope_per_m(d_max_m, clutter, domain_m2=DOMAIN_M2)
        draw = partial(sample_success, thin, clutter, domain_m2=DOMAIN_M2)
        yield 13, f"D_max = {d_max_m:g} m, {_clutter_text(clutter)}", slope * 2.0 * HALF_STEP_M, draw


def _clutter_text(clutter: RandomObstacles) -> str:
    return f"p = {clutter.occupancy:g}, r_o = {clutter.radius_m:g} m"
