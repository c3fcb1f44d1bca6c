"""Sec. 4.1 as a study: the law with Table 2's values, for errors of matching that are handed in."""

import math

import pytest

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.study.report.findings import StudyResult
from foveacam_pipeline.study.tradeoff.depth_error import (
    ASSUMED,
    FOVEA_PX_PER_DEG,
    LINES,
    WIDE_PX_PER_DEG,
    MatchingError,
    check_distinct,
    depth_error_study,
    drawing,
    error_m,
    focal_px,
    measured_error,
)


def of(key: str, error_px: float) -> MatchingError:
    return measured_error(key, error_px, whose=f"whose of {key}", source=f"bench of {key}")


def test_the_focal_length_gives_the_fields_of_table_2() -> None:
    for px_per_deg, field_deg in ((FOVEA_PX_PER_DEG, 2.86), (WIDE_PX_PER_DEG, 25.6)):
        half_rad = math.atan(1440.0 / 2.0 / focal_px(px_per_deg))
        assert 2.0 * math.degrees(half_rad) == pytest.approx(field_deg, rel=0.01)


def test_the_error_is_what_a_shift_in_disparity_does_to_the_depth() -> None:
    f_b = focal_px(FOVEA_PX_PER_DEG) * 0.2
    shift_px = 0.01
    moved_m = f_b / (f_b / 15.0 - shift_px) - 15.0
    assert error_m(15.0, FOVEA_PX_PER_DEG, error_px=shift_px) == pytest.approx(moved_m, rel=1e-3)


def test_the_wide_pair_errs_nine_times_more_at_every_distance_of_the_rail() -> None:
    values = depth_error_study().values
    for z_m in (5, 10, 15):
        ratio = values[f"error_ratio_{z_m}m"]
        assert ratio == pytest.approx(9.0, rel=0.02)  # the paper's "~9x"
    assert values["wide_error_1px_15m_m"] == pytest.approx(225.0 / (0.2 * 3151.3), rel=1e-4)
    assert values["fovea_error_finest_10m_m"] == pytest.approx(100.0 / (0.2 * 28762.5) / 256.0, rel=1e-4)


def test_measured_errors_are_told_only_when_they_were_measured() -> None:
    without = depth_error_study()
    assert any("No measured matching error" in said for said in without.deviations)
    assert not any("verge" in key for key in without.values)
    study = depth_error_study((of("verge", 0.25), of("stereo", 0.5)))
    assert study.values["fovea_error_verge_10m_m"] == pytest.approx(
        0.25 * error_m(10.0, FOVEA_PX_PER_DEG, error_px=1.0)
    )
    assert study.values["wide_error_stereo_5m_m"] == pytest.approx(
        0.5 * error_m(5.0, WIDE_PX_PER_DEG, error_px=1.0)
    )
    assert study.values["matching_error_verge_px"] == 0.25
    assert StudyResult.from_document(study.document()) == study


def test_each_error_of_matching_says_where_it_is_from_beside_the_papers() -> None:
    rows = [row for row in depth_error_study((of("verge", 0.25),)).rows if "|dd|" in row.quantity]
    assert [row.note for row in rows] == ["assumed", "assumed", "bench of verge"]
    assert "1/256 px (the paper's refinement)" in rows[1].quantity
    assert "0.25 px (whose of verge)" in rows[2].quantity


def test_the_drawing_names_every_error_and_tells_the_measured_ones_from_assumed_ones() -> None:
    axes = drawing((*ASSUMED, of("verge", 0.25))).axes[0]
    widths = {str(line.get_label()): line.get_linewidth() for line in axes.lines}
    names = [name for name in widths if name.startswith("|dd| = ")]
    assert names == [
        "|dd| = 1 px",
        "|dd| = 1/256 px (the paper's refinement)",
        "|dd| = 0.25 px (whose of verge)",
    ]
    assumed, paper, measured = (widths[name] for name in names)
    assert assumed == paper < measured


def test_errors_of_matching_that_cannot_be_told_apart_are_refused() -> None:
    with pytest.raises(InvalidInput, match="the matching error verge was given twice; give it once"):
        depth_error_study((of("verge", 0.25), of("verge", 0.5)))
    many = [of(f"bench{number}", 0.1) for number in range(len(LINES) - len(ASSUMED) + 1)]
    assert check_distinct(many[:-1]) == tuple(many[:-1])
    with pytest.raises(InvalidInput, match="6 matching errors were given; give 5 at most"):
        depth_error_study(many)


@pytest.mark.parametrize("error_px", [0.0, -1.0, math.nan, math.inf])
def test_no_error_of_matching_is_refused_in_a_sentence(error_px: float) -> None:
    with pytest.raises(InvalidInput, match=r"a matching error of .* px was given"):
        of("verge", error_px)


def test_a_camera_that_resolves_nothing_is_refused() -> None:
    with pytest.raises(InvalidInput, match=r"0\.0 px per degree were given"):
        focal_px(0.0)
