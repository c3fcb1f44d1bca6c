"""Which part of its field a plan covers, and its picture."""

import numpy as np
import pytest

from foveacam_hardware.contract import OutOfRange, Role
from foveacam_pipeline.capture.plan import PlanCoverage, RasterPlan, coverage_of, plan_from
from foveacam_pipeline.models import eye_volts, fovea_footprint_px, load_calibration
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED

RIG120 = load_calibration(SHIPPED / "sim-rig120.json")


def grid(columns: int, rows: int, *, half_width_deg: float = 4.0, half_height_deg: float = 3.0) -> RasterPlan:
    source = {
        "kind": "grid",
        "columns": columns,
        "rows": rows,
        "half_width_deg": half_width_deg,
        "half_height_deg": half_height_deg,
    }
    return plan_from({"points": source, "verging": {"mode": "given", "distance_m": 5.0}})


@pytest.fixture(scope="module")
def dense() -> PlanCoverage:
    return coverage_of(grid(5, 5), RIG120)


@pytest.fixture(scope="module")
def loose() -> PlanCoverage:
    return coverage_of(grid(3, 3), RIG120)


def test_a_dense_raster_leaves_nothing_unseen(dense: PlanCoverage) -> None:
    assert dense.seen_either == 1.0 and dense.seen_both == pytest.approx(1.0, abs=1e-3)
    assert dense.outside_wide == 0
    assert dense.warnings == ()


def test_overlap_is_what_the_steps_leave_of_a_view(dense: PlanCoverage) -> None:
    # steps of 2.0° and 1.5° in views of 2.87° x 2.15°, which the mirrors turn by up to 4° here
    assert dense.overlap_across == pytest.approx(1.0 - 2.0 / 2.87, abs=0.05)
    assert dense.overlap_down == pytest.approx(1.0 - 1.5 / 2.15, abs=0.05)


def test_views_of_which_no_two_overlap_are_told_before_the_start(loose: PlanCoverage) -> None:
    assert loose.apart and (loose.overlap_across, loose.overlap_down) == (0.0, 0.0)
    told = " ".join(loose.warnings)
    assert "no two views overlap: no mosaic can be made of them" in told and told.count("overlap") == 1
    assert f"{100 * (1 - loose.seen_either):.1f} % of the field is seen by neither eye" in told


@pytest.mark.parametrize(
    ("half_width_deg", "half_height_deg", "neighbours"), [(4.0, 1.5, "beside"), (1.5, 3.0, "below")]
)
def test_gaps_between_some_neighbours_are_told_before_the_start(
    half_width_deg: float, half_height_deg: float, neighbours: str
) -> None:
    rows = coverage_of(grid(3, 3, half_width_deg=half_width_deg, half_height_deg=half_height_deg), RIG120)
    assert not rows.apart
    gaps = [words for words in rows.warnings if "gaps" in words]
    assert len(gaps) == 1 and f"do not overlap those {neighbours} them" in gaps[0]


def test_the_share_seen_is_the_views_area_over_the_fields(loose: PlanCoverage) -> None:
    # of 9 views of 2.87° x 2.15°, 4 quarters, 4 halves and one whole lie in the field of 8° x 6°
    for eye in range(2):
        share = float((loose.field & (loose.counts[eye] > 0)).sum() / loose.field.sum())
        assert share == pytest.approx(4 * 2.87 * 2.15 / 48.0, abs=0.03)
        assert loose.seen_both < share < loose.seen_either


def test_footprints_are_the_calibrations_own(loose: PlanCoverage) -> None:
    volts = RIG120.steer(0.0, 0.0, distance_m=5.0)
    for eye, role in enumerate((Role.LEFT, Role.RIGHT)):
        expected = fovea_footprint_px(RIG120, role, eye_volts(volts, role), 5.0)
        np.testing.assert_allclose(loose.footprints_px[4, eye], expected, atol=1e-6)


def test_set_points_overlap_with_their_nearest() -> None:
    near = coverage_of(
        plan_from({"points": {"kind": "set_points", "points": "0,0,5\n1,0,5\n9,0,30"}}), RIG120
    )
    assert near.overlap_across == near.overlap_down == 0.0
    assert not near.apart  # the first two overlap
    pair = coverage_of(plan_from({"points": {"kind": "set_points", "points": "0,0,5\n1,0,5"}}), RIG120)
    assert pair.overlap_across == pytest.approx(1.0 - 1.0 / 2.87, abs=0.05)
    assert pair.seen_either == 1.0


def test_a_single_point_has_no_neighbour() -> None:
    single = coverage_of(plan_from({"points": {"kind": "set_points", "points": "2,1,5"}}), RIG120)
    assert single.overlap_across is None and single.overlap_down is None
    assert not single.apart
    assert single.warnings == ()


def test_a_point_beyond_reach_has_no_footprint() -> None:
    with pytest.raises(OutOfRange, match="point 0"):
        coverage_of(grid(3, 3, half_width_deg=12.0), RIG120)
