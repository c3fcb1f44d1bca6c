"""Sec. 4.4: the stand-off study, and the statistics it rests on."""

import io
import json
import math
import re
from itertools import pairwise

import numpy as np
import pytest
from matplotlib.figure import Figure
from shapely.geometry import Polygon, box

from foveacam_hardware.contract import Cancelled, InvalidInput
from foveacam_pipeline.study.report.findings import StudyResult
from foveacam_pipeline.study.visibility.checks import ProbabilityCheck
from foveacam_pipeline.study.visibility.curves import curve_band, fit_area, grows_at_every_step
from foveacam_pipeline.study.visibility.maps import FieldMap
from foveacam_pipeline.study.visibility.obstacles import (
    RandomObstacles,
    sample_clear_share,
    sample_corridor_share,
)
from foveacam_pipeline.study.visibility.plan_figures import agent_position, patch_of
from foveacam_pipeline.study.visibility.regions import feasible_regions
from foveacam_pipeline.study.visibility.standoff import StandoffRing
from foveacam_pipeline.study.visibility.study import standoff_study

RATIOS = (1.0, 1.5, 2.0, 3.0)


class Watch:
    """Notes the progress; has enough after so many reports."""

    def __init__(self, *, patience: int = 10**9) -> None:
        self.reports: list[tuple[int, int]] = []
        self._patience = patience

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        assert note
        self.reports.append((done, total))

    def cancelled(self) -> bool:
        return len(self.reports) >= self._patience


@pytest.fixture(scope="module")
def watch() -> Watch:
    return Watch()


@pytest.fixture(scope="module")
def study(watch: Watch) -> StudyResult:
    return standoff_study(tight_maps=10, quick=True, watch=watch)


def test_the_figures_of_the_paper_are_reached(study: StudyResult) -> None:
    values = {name: value for name, value in study.values.items() if isinstance(value, int | float)}
    assert values["mc_settings"] >= 20
    assert values["mc_outside_3se"] == 0
    assert values["raster_rel_diff"] <= 0.005
    assert values["region_speedup"] >= 20.0
    assert min(values["fig9_r2_multi"], values["fig9_r2_single"]) >= 0.99
    assert values["fig9_multi_never_below_single"] is True
    assert values["fig9_gap_monotone"] is True
    assert values["fig10_gap_monotone"] is True


def test_a_study_is_json_and_comes_back(study: StudyResult) -> None:
    text = json.dumps(study.document(), allow_nan=False)
    assert StudyResult.from_document(json.loads(text)) == study


def test_every_figure_of_the_section_is_drawn(study: StudyResult) -> None:
    assert {"Fig. 6", "Fig. 7", "Fig. 9", "Fig. 10"} <= {picture.figure for picture in study.pictures}
    assert len({picture.name for picture in study.pictures}) == len(study.pictures) == 8
    for picture in study.pictures:
        assert picture.drawing.svg.startswith("<svg")
        assert not re.search(r"\bnan\b", picture.drawing.svg, re.IGNORECASE)


def test_a_quick_study_says_so(study: StudyResult) -> None:
    assert any(said.startswith("Quick: 10 maps instead of 1000") for said in study.deviations)
    assert study.seeds == {"maps": 44, "lots": 45, "cells": 46}


def test_progress_grows_to_its_end(study: StudyResult, watch: Watch) -> None:
    assert study.name == "standoff"
    assert all(before[0] < after[0] for before, after in pairwise(watch.reports))
    assert watch.reports[-1][0] == watch.reports[-1][1]
    assert len({total for _, total in watch.reports}) == 1


def test_a_study_is_cancelled_among_its_maps() -> None:
    with pytest.raises(Cancelled, match="start it again"):
        standoff_study(watch=Watch(patience=2))


def test_a_deviation_of_one_map_is_refused() -> None:
    with pytest.raises(InvalidInput, match="a deviation needs 2 maps or more"):
        standoff_study(maps=1)


def test_fits_find_what_they_are_given() -> None:
    x = np.array(RATIOS)
    law = fit_area(RATIOS, 5.0 * (x**2 - 1.0))
    assert law.quadratic == pytest.approx((5.0, 0.0, -5.0))
    assert (law.law_m2, law.r2, law.law_r2) == pytest.approx((5.0, 1.0, 1.0))
    assert law.line_r2 < 0.99
    line = fit_area(RATIOS, 3.0 * x)
    assert (line.line_r2, line.r2) == pytest.approx((1.0, 1.0))
    assert line.law_r2 < 0.5


def test_the_interval_of_a_mean_is_students() -> None:
    figures = np.random.default_rng(2).normal(3.0, 2.0, (12, 1))
    from scipy.stats import ttest_1samp  # slow to import

    expected = ttest_1samp(figures[:, 0], 0.0).confidence_interval(0.95)
    found = curve_band(figures)
    assert found.mean[0] + found.half_95[0] == pytest.approx(expected.high)
    assert found.mean[0] - found.half_95[0] == pytest.approx(expected.low)
    assert math.isinf(curve_band(figures[:1]).half_95[0])


@pytest.mark.parametrize(
    ("gap", "so"),
    [((0.0, 1.0, 2.0, 3.0), True), ((0.0, 0.0, 1.0, 2.0), False), ((0.0, 1.0, 3.0, 2.0), False)],
)
def test_a_gap_grows_only_if_it_is_above_0_and_larger_at_each_step(gap: tuple[float, ...], so: bool) -> None:
    assert grows_at_every_step(RATIOS, np.array(gap)) is so


def test_a_wrong_closed_form_is_found_out() -> None:
    clutter = RandomObstacles(occupancy=0.05, radius_m=0.4)
    drawn = sample_clear_share(5.0, clutter, trials=50_000, rng=np.random.default_rng(1))
    right = 0.95 ** (2.0 * 0.4 * 5.0 + math.pi * 0.16)
    assert abs(ProbabilityCheck(equation=11, setting="", exact=right, drawn=drawn).z) <= 3.0
    without_the_ends = 0.95 ** (2.0 * 0.4 * 5.0)
    assert abs(ProbabilityCheck(equation=11, setting="", exact=without_the_ends, drawn=drawn).z) > 3.0


def test_the_corridor_by_lot_is_a_stadium_in_its_box() -> None:
    drawn = sample_corridor_share(3.0, 0.5, trials=50_000, rng=np.random.default_rng(1))
    assert abs(drawn.value - (3.0 + math.pi * 0.25) / 4.0) <= 3.0 * drawn.sigma


def test_the_agent_stands_where_two_are_seen_and_none_notices_it() -> None:
    field = FieldMap(bounds_m=(0.0, 0.0, 20.0, 20.0), targets_m=((7.0, 10.0), (13.0, 10.0), (10.0, 10.5)))
    regions = feasible_regions(field, StandoffRing(inner_m=2.0, outer_m=5.0), agent_radius_m=0.3)
    found = agent_position(field, regions, inner_m=2.0)
    assert found is not None
    place_m, seen = found
    assert len(seen) >= 2
    assert all(2.0 < math.dist(place_m, field.targets_m[n]) < 5.0 for n in seen)
    assert all(math.dist(place_m, target_m) > 2.0 for target_m in field.targets_m)
    apart = FieldMap(bounds_m=(0.0, 0.0, 40.0, 20.0), targets_m=((10.0, 10.0), (30.0, 10.0)))
    alone = feasible_regions(apart, StandoffRing(inner_m=2.0, outer_m=5.0), agent_radius_m=0.3)
    assert agent_position(apart, alone, inner_m=2.0) is None


def test_holes_of_a_region_stay_holes_when_drawn() -> None:
    house = box(0, 0, 4, 4).difference(box(1, 1, 3, 3))
    for outline in (house, house.reverse()):
        figure = Figure(figsize=(1.0, 1.0), dpi=80)
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set(xlim=(0, 4), ylim=(0, 4))
        axes.axis("off")
        axes.add_patch(patch_of(outline, color="black"))
        out = io.BytesIO()
        figure.savefig(out, format="rgba")
        red = np.frombuffer(out.getvalue(), dtype=np.uint8).reshape(80, 80, 4)[..., 0]
        assert red[40, 40] == 255
        assert red[40, 10] == red[10, 40] == red[70, 70] == 0


def test_nothing_to_stand_on_draws_nothing() -> None:
    assert len(patch_of(Polygon()).get_path()) == 0
