"""The figures of `foveacam bench scatter`, from judged clicks of known errors."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import pytest

from foveacam_bench.verge.scattering_mirrors import judged, with_scatter
from foveacam_pipeline.models import load_calibration
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.resources.studying.studies.judged_clicks import ClickResult


def result(*, error_m: float, verged: bool = True) -> ClickResult:
    """Return a click at 10 m with a stated error of 0.1 m; only what the figures read."""
    found = SimpleNamespace(
        verged=verged, sigmas=error_m / 0.1, error_m=error_m, click=SimpleNamespace(range_m=10.0)
    )
    return cast(ClickResult, found)


def test_shares_and_errors_are_of_the_answers_and_verged_of_all_clicks() -> None:
    errors_m = [0.05, -0.1, 0.4, math.nan]
    figures = judged([result(error_m=error_m, verged=error_m > 0.0) for error_m in errors_m])
    assert figures["verged_fraction"] == 0.5
    assert figures["answered_fraction"] == 0.75
    assert figures["within_3_sigma_fraction"] == pytest.approx(2.0 / 3.0)
    assert figures["sigmas_max"] == pytest.approx(4.0)
    assert figures["distance_rel_error_median"] == pytest.approx(0.01)


def test_without_an_answer_there_is_no_error() -> None:
    figures = judged([result(error_m=math.nan, verged=False)])
    assert figures["answered_fraction"] == 0.0
    assert figures["within_3_sigma_fraction"] is None


def test_a_scatter_of_the_mirrors_is_part_of_the_stated_error() -> None:
    shipped = load_calibration(SHIPPED / "sim-rig120.json")
    without = replace(
        shipped,
        left=replace(shipped.left, mirror=replace(shipped.left.mirror, sigma_rad=(0.0, 0.0))),
        right=replace(shipped.right, mirror=replace(shipped.right.mirror, sigma_rad=(0.0, 0.0))),
    )
    added_px = math.sqrt(2.0) * math.radians(0.006) * shipped.fovea_f_px  # both eyes'
    reference_m = shipped.left.reference_depth_m or math.inf  # where the pivot's error is none
    assert with_scatter(without, 0.006).pose_sigma_px(reference_m) == pytest.approx(added_px, rel=0.01)
    assert with_scatter(shipped, 0.0).pose_sigma_px() == shipped.pose_sigma_px()
