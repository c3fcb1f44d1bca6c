"""The fit on the published 9 x 9 sweep of the real rig, where that file is at hand."""

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_pipeline.calibrate.fit.mirror_models import fit_mirror_models
from foveacam_pipeline.geometry import fit_polynomial
from foveacam_pipeline.models.mirror import DAC_STEP_V

SWEEP = Path(__file__).resolve().parents[4] / "shared" / "data" / "rig" / "sweep-9x9.json"
pytestmark = pytest.mark.skipif(not SWEEP.exists(), reason="the real rig's sweep is not on this machine")


def eye(name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    data = json.loads(SWEEP.read_text(encoding="utf-8"))[name]
    return np.array(data["volts"], dtype=np.float64), np.deg2rad(np.array(data["angles_deg"]))


@pytest.mark.parametrize(
    ("name", "rms_deg", "loo_deg"),
    [("left", (0.030, 0.037), (0.034, 0.041)), ("right", (0.035, 0.046), (0.038, 0.052))],
)
def test_a_cubic_leaves_the_known_residuals(
    name: str, rms_deg: tuple[float, float], loo_deg: tuple[float, float]
) -> None:
    fit = fit_polynomial(*eye(name), 3, "square")
    np.testing.assert_allclose(np.rad2deg(fit.rms), rms_deg, atol=6e-4)  # known to 0.001 deg
    np.testing.assert_allclose(np.rad2deg(fit.loo_rms), loo_deg, atol=6e-4)


@pytest.mark.parametrize("name", ["left", "right"])
def test_a_plane_is_not_enough(name: str) -> None:
    assert np.rad2deg(fit_polynomial(*eye(name), 1, "square").rms).max() > 0.2


@pytest.mark.parametrize("name", ["left", "right"])
def test_the_order_chosen_predicts_left_out_poses_as_well_as_the_cubic(name: str) -> None:
    volts, angles = eye(name)
    mirror = fit_mirror_models(volts, angles).model
    assert mirror.forward.order in (3, 4)
    cubic = fit_polynomial(volts, angles, 3).loo_rms
    assert (np.array(mirror.loo_rad) < 1.1 * cubic).all()
    assert np.abs(mirror.volts_for(mirror.angles_of(0.97 * volts)) - 0.97 * volts).max() < DAC_STEP_V / 2


@pytest.mark.parametrize(("name", "bar_deg"), [("left", 0.042), ("right", 0.053)])
def test_the_elected_model_predicts_a_left_out_pose_within_the_bars(name: str, bar_deg: float) -> None:
    fit = fit_mirror_models(*eye(name))
    assert max(np.rad2deg(fit.chosen.loo_rad)) <= bar_deg
    cubic = next(score for score in fit.scores if score.paper)
    assert max(np.rad2deg(cubic.loo_rad)) <= bar_deg
    assert fit.chosen.judged_rad <= cubic.judged_rad


@pytest.mark.parametrize("name", ["left", "right"])
def test_springs_spare_the_real_mirrors_a_third_of_the_coefficients(name: str) -> None:
    scores = {score.name: score for score in fit_mirror_models(*eye(name)).scores}
    springs, cubic = scores["springs + order 2"], scores["order 3"]
    assert springs.terms == 7 < cubic.terms == 10
    assert springs.judged_rad < 1.2 * cubic.judged_rad
    assert springs.judged_rad < 0.4 * scores["order 2"].judged_rad
