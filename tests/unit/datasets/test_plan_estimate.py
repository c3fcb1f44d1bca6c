"""Time and size of a plan before it starts."""

import math

import pytest

from foveacam_hardware.contract import InvalidInput, OutOfRange
from foveacam_pipeline.capture.plan import (
    CaptureEstimate,
    CapturePace,
    ImageSize,
    RasterPlan,
    Verging,
    assumed_ratio,
    check_disk,
    estimate_capture,
    point_limit_ms,
)
from foveacam_pipeline.capture.plan.plan_estimate import READOUT_10BIT_MS
from foveacam_pipeline.storage.free_space import RESERVE_BYTES

PAPER_RAIL_MM = (-300.0, -100.0, 0.0, 100.0, 300.0)

GREY = ImageSize(width=1440, height=1080)
FRAME_BYTES = 1440 * 1080
RIG120 = CapturePace(settle_ms=10.0, exposure_ms=5.0)


def of(
    plan: RasterPlan, pace: CapturePace = RIG120, *, done: int = 0, stored_ratio: float | None = None
) -> CaptureEstimate:
    return estimate_capture(plan, pace, fovea=GREY, wide=GREY, done=done, stored_ratio=stored_ratio)


@pytest.mark.parametrize(
    ("settle_ms", "seconds"),
    [(2.0, (0.48, 0.80, 1.21, 2.02)), (10.0, (0.93, 1.26, 1.66, 2.47))],
)
def test_81_points_take_the_physical_limit(settle_ms: float, seconds: tuple[float, ...]) -> None:
    for exposure_ms, limit_s in zip((1.0, 5.0, 10.0, 20.0), seconds, strict=True):
        found = of(RasterPlan(), CapturePace(settle_ms=settle_ms, exposure_ms=exposure_ms))
        assert found.limit_s == pytest.approx(limit_s, abs=0.0051)  # the table has two decimals
        assert found.total_s == found.limit_s


def test_a_readout_that_waits_for_the_mirrors_costs_its_own_time() -> None:
    serial = CapturePace(settle_ms=2.0 + READOUT_10BIT_MS, exposure_ms=5.0)
    assert of(RasterPlan(), serial).limit_s == pytest.approx(0.96, abs=0.0051)


def test_brackets_and_stacks_settle_once_and_are_read_out_each_time() -> None:
    plan = RasterPlan(exposures_ms=(1.0, 4.0), stack_frames=3)
    first, others = (
        10.0 + 1.0 + 0.5,
        [(4.38 + exposure_ms + 0.5) for exposure_ms in (1.0, 1.0, 4.0, 4.0, 4.0)],
    )
    assert point_limit_ms(plan, RIG120) == pytest.approx(first + sum(others))
    assert of(plan).shots == 81 * 6
    slow = CapturePace(settle_ms=10.0, exposure_ms=5.0, exposure_change_ms=20.0)
    assert point_limit_ms(plan, slow) - point_limit_ms(plan, RIG120) == pytest.approx(40.0)


def test_a_wide_frame_for_every_point_holds_a_fast_raster_back() -> None:
    waited = CapturePace(settle_ms=2.0, exposure_ms=5.0, wide_period_ms=1e3 / 30.0)
    assert point_limit_ms(RasterPlan(), waited) == pytest.approx(1e3 / 30.0)
    assert point_limit_ms(RasterPlan(wide="scan"), waited) == pytest.approx(4.38 + 5.5)


def test_verging_anew_is_counted_beside_the_limit() -> None:
    plan = RasterPlan(verging=Verging(each_point=True))
    assert of(plan).reverge_s == pytest.approx(8.1)
    assert of(plan).limit_s == of(RasterPlan()).limit_s


def test_five_places_of_the_rail_are_five_scans_and_their_moves() -> None:
    plan = RasterPlan(rail_positions_mm=PAPER_RAIL_MM)
    found = of(plan, CapturePace(settle_ms=10.0, exposure_ms=5.0, rail_mm_s=50.0, rail_settle_s=1.0))
    assert found.limit_s == pytest.approx(5.0 * of(RasterPlan()).limit_s)
    assert found.rail_s == pytest.approx((300 + 200 + 100 + 100 + 200) / 50.0 + 5.0)
    by_hand = of(plan)
    assert (by_hand.rail_s, by_hand.hand_moves) == (0.0, 5)


def test_one_scan_of_pairs_and_a_wide_frame_is_253_mb() -> None:
    found = of(RasterPlan(wide="scan"), stored_ratio=1.0)
    assert found.raw_bytes == (2 * 81 + 1) * FRAME_BYTES
    assert round(found.raw_bytes / 1e6) == 253
    assert {kind.kind: kind.files for kind in found.kinds} == {"fovea": 162, "wide": 1}
    assert found.raw_bytes < found.stored_bytes < 1.01 * found.raw_bytes  # and what is kept about them


@pytest.mark.parametrize(
    ("plan", "files", "bytes_each"),
    [
        (RasterPlan(wide="none"), 162, FRAME_BYTES),
        (RasterPlan(wide="none", stack_frames=5), 162, 2 * FRAME_BYTES),
        (RasterPlan(wide="none", stack_frames=5, stack_keep="all"), 810, FRAME_BYTES),
        (RasterPlan(wide="none", exposures_ms=(1.0, 2.0, 3.0)), 486, FRAME_BYTES),
    ],
)
def test_a_mean_is_one_picture_in_16_bits(plan: RasterPlan, files: int, bytes_each: int) -> None:
    found = of(plan)
    assert (found.files, found.raw_bytes) == (files, files * bytes_each)


def test_png_is_assumed_smaller_until_it_is_measured() -> None:
    ratio = assumed_ratio(GREY)
    assert 0.4 < ratio < 0.7 < assumed_ratio(ImageSize(width=1, height=1, bits=12)) + 1e-9
    assert of(RasterPlan(), stored_ratio=0.3).stored_bytes < of(RasterPlan()).stored_bytes


def test_a_resumed_plan_counts_what_is_left() -> None:
    plan = RasterPlan(rail_positions_mm=(-100.0, 100.0), wide="scan")
    pace = CapturePace(settle_ms=10.0, exposure_ms=5.0, rail_mm_s=100.0, rail_settle_s=0.0)
    within = of(plan, pace, done=80)
    assert (within.points, within.rail_s) == (82, 2.0)
    assert {kind.kind: kind.files for kind in within.kinds} == {"fovea": 164, "wide": 1}
    between = of(plan, pace, done=81)
    assert (between.points, between.rail_s) == (81, 2.0)
    ended = of(plan, pace, done=162)
    assert (ended.points, ended.total_s, ended.stored_bytes) == (0, 0.0, 0)
    with pytest.raises(InvalidInput, match="163 points are done, the plan has 162"):
        of(plan, done=163)


def test_a_disk_too_small_is_refused_with_both_figures() -> None:
    needed = of(RasterPlan())
    check_disk(needed, free_bytes=needed.stored_bytes + RESERVE_BYTES)
    with pytest.raises(OutOfRange, match=r"243 images need about \S+ \wB, .*; 100\.0 MB are free") as refused:
        check_disk(needed, free_bytes=100_000_000)
    assert refused.value.asked == f"{needed.stored_bytes + RESERVE_BYTES} bytes"
    assert refused.value.found == "100000000 bytes"


@pytest.mark.parametrize(
    ("settle_ms", "exposure_ms"), [(-1.0, 5.0), (1.0, 0.0), (math.nan, 5.0), (1.0, math.inf)]
)
def test_times_that_cannot_be_are_refused(settle_ms: float, exposure_ms: float) -> None:
    with pytest.raises(InvalidInput, match="cannot be"):
        CapturePace(settle_ms=settle_ms, exposure_ms=exposure_ms)
