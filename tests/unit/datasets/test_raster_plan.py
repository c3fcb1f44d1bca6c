"""The plan of a raster as a document, and the sequence of points that follows from it alone."""

import json
import math
from typing import Any

import pytest
from pydantic import ValidationError

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.capture.plan import (
    GridPoints,
    RasterPlan,
    SetPoint,
    SetPoints,
    Verging,
    plan_from,
    points_of_plan,
)

PAPER_RAIL_MM = (-300.0, -100.0, 0.0, 100.0, 300.0)

THREE_BY_TWO: dict[str, Any] = {  # Any: as JSON comes
    "points": {"kind": "grid", "columns": 3, "rows": 2, "half_width_deg": 4.0, "half_height_deg": 1.5},
    "verging": {"mode": "given", "distance_m": 5.0},
}


def test_an_empty_document_is_the_papers_raster() -> None:
    plan = plan_from({})
    assert (plan.points_per_scan, plan.scans, plan.exposures_per_point, plan.stack_frames) == (81, 1, 1, 1)
    assert plan.needs_distance and plan.needs_field


def test_the_document_comes_back_the_same_from_json() -> None:
    plan = RasterPlan(
        points=GridPoints(half_width_deg=8.0, half_height_deg=7.1),
        verging=Verging(mode="given", distance_m="infinity", each_point=True),
        exposures_ms=(2.0, 8.0),
        rail_positions_mm=PAPER_RAIL_MM,
    )
    document = plan.model_dump(mode="json")
    assert document["format"] == "foveacam-raster-plan" and document["version"] == 1
    again = plan_from(json.loads(json.dumps(document)))
    assert again == plan


def test_a_rest_body_is_taken_as_parsed_json() -> None:
    body = {**THREE_BY_TWO, "exposures_ms": [1, 2.5], "rail_positions_mm": [-100, 100]}
    assert RasterPlan.model_validate(body) == plan_from(body)


@pytest.mark.parametrize(
    ("document", "words"),
    [
        ({"version": 2}, "version 2 was found, this program reads 1"),
        ({"format": "foveacam-calibration"}, "format 'foveacam-raster-plan' is needed"),
        ([], "raster plan: document"),
        ({"colums": 9}, "colums"),
        ({"points": {"kind": "grid", "columns": 0}}, "columns: Input should be greater than or equal to 1"),
        ({"points": {"kind": "grid", "half_width_deg": 5.0}}, "give both, or neither"),
        ({"points": {"kind": "grid", "half_width_deg": math.nan, "half_height_deg": 1.0}}, "finite number"),
        ({"points": {"kind": "set_points", "points": []}}, "there is no point"),
        ({"points": {"kind": "set_points", "points": "1, 2\n@spin"}}, "line 2: `@spin` is no command"),
        ({"points": {"kind": "set_points", "points": [{"ax_deg": "1", "ay_deg": 0}]}}, "valid number"),
        ({"verging": {"mode": "given"}}, "lacks distance_m"),
        ({"verging": {"mode": "given", "distance_m": 0.0}}, "distance_m"),
        ({"exposures_ms": [1.0, math.inf]}, "exposures_ms.1"),
        ({"exposures_ms": [5.0, 5.0]}, "given twice"),
        ({"stack_frames": 0}, "stack_frames"),
        ({"points": {"kind": "grid", "columns": 101, "rows": 101}, "rail_positions_mm": [0, 1]}, "20402"),
    ],
)
def test_what_cannot_be_a_plan_is_refused_by_its_place(document: object, words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        plan_from(document, what="raster plan")


def test_a_plan_cannot_be_changed() -> None:
    plan = plan_from({})
    with pytest.raises(ValidationError, match="frozen"):
        plan.stack_frames = 3


def test_points_run_from_the_top_left_and_turn_at_every_row() -> None:
    sequence = points_of_plan(plan_from(THREE_BY_TWO))
    assert [(p.column, p.row) for p in sequence] == [(0, 0), (1, 0), (2, 0), (2, 1), (1, 1), (0, 1)]
    deg = [(round(math.degrees(p.ax_rad), 9), round(math.degrees(p.ay_rad), 9)) for p in sequence]
    assert deg == [(-4.0, -1.5), (0.0, -1.5), (4.0, -1.5), (4.0, 1.5), (0.0, 1.5), (-4.0, 1.5)]
    assert {p.distance_m for p in sequence} == {5.0}


def test_rows_may_all_start_from_the_left() -> None:
    grid = {**THREE_BY_TWO["points"], "order": "rows"}
    assert [p.column for p in points_of_plan(plan_from({**THREE_BY_TWO, "points": grid}))] == [
        0,
        1,
        2,
        0,
        1,
        2,
    ]


def test_every_place_on_the_rail_is_a_full_scan_in_the_order_given() -> None:
    sequence = points_of_plan(plan_from({**THREE_BY_TWO, "rail_positions_mm": [100, -300]}))
    assert [p.index for p in sequence] == list(range(12))
    assert [(p.scan, p.point) for p in sequence] == [(s, k) for s in range(2) for k in range(6)]
    assert [p.rail_m for p in sequence] == [0.1] * 6 + [-0.3] * 6
    assert [p.ax_rad for p in sequence[:6]] == [p.ax_rad for p in sequence[6:]]


def test_the_sequence_stays_the_same_over_versions() -> None:
    """A dataset that waits to be resumed depends on it: change the format's version before these figures."""
    plan = plan_from(
        {
            "points": {"kind": "grid", "half_width_deg": 7.3, "half_height_deg": 7.5},
            "verging": {"mode": "given", "distance_m": 4.0},
            "rail_positions_mm": list(PAPER_RAIL_MM),
        }
    )
    sequence = points_of_plan(plan)
    assert len(sequence) == 405
    point = sequence[2 * 81 + 9 + 3]
    assert (point.index, point.scan, point.column, point.row, point.rail_m) == (174, 2, 5, 1, 0.0)
    assert point.ax_rad == math.radians(7.3 * 2 / 8)
    assert point.ay_rad == math.radians(-7.5 * 6 / 8)


def test_set_points_keep_their_order_distance_and_shift() -> None:
    given = SetPoints(
        kind="set_points",
        points=(
            SetPoint(ax_deg=3.0, ay_deg=-1.0),
            SetPoint(ax_deg=-2.0, ay_deg=0.5, distance_m="infinity", shift_deg=0.25),
        ),
    )
    first, second = points_of_plan(RasterPlan(points=given, verging=Verging(mode="given", distance_m=6.0)))
    assert (first.column, first.row, first.distance_m, first.shift_rad) == (0, 0, 6.0, 0.0)
    assert (second.column, second.row, second.distance_m) == (1, 0, math.inf)
    assert second.shift_rad == math.radians(0.25)


def test_set_points_as_text_are_kept_written_out() -> None:
    plan = plan_from({"points": {"kind": "set_points", "points": "1, 2, 3 # near\n4, 5, inf\n"}})
    assert not plan.needs_distance
    kept = plan.model_dump(mode="json")["points"]["points"]
    assert [(point["ax_deg"], point["distance_m"]) for point in kept] == [(1.0, 3.0), (4.0, "infinity")]
    assert plan_from(plan.model_dump(mode="json")) == plan


@pytest.mark.parametrize(
    ("document", "missing"),
    [
        ({"points": {"kind": "grid", "half_width_deg": 1.0, "half_height_deg": 1.0}}, "not measured yet"),
        ({"verging": {"mode": "given", "distance_m": 5.0}}, "size of the grid is not filled in"),
    ],
)
def test_a_plan_that_is_not_filled_in_has_no_points_yet(document: object, missing: str) -> None:
    with pytest.raises(InvalidInput, match=missing):
        points_of_plan(plan_from(document))
