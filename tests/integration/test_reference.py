"""A wide-baseline reference of the simulated rig, from three places on its rail, judged by its truth."""

from typing import Any

import pytest

from foveacam_bench.capture.reference import reference_figures


@pytest.mark.timeout(600)
def test_the_reference_of_the_simulated_rig_is_nearer_to_the_truth_than_its_own_baseline() -> None:
    found: dict[str, Any] = reference_figures(quick=True)
    assert found["judged"] > 30
    assert found["farthest_m"] > 7.0
    assert found["ratio"] > 1.2
    assert found["reference_over_stated"] < 1.5
    left_m, right_m, middle_m = (stop[0] for stop in found["stops_m"])
    assert (left_m, right_m, middle_m) == pytest.approx((-0.3, 0.3, 0.0), abs=3e-4)
