"""The mirror model: forward law, inverse by Newton, domain."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from foveacam_hardware.contract import MirrorVolts, OutOfRange
from foveacam_pipeline.calibrate.fit.mirror_models import fit_mirror_models
from foveacam_pipeline.geometry import fit_polynomial
from foveacam_pipeline.models import MirrorModel
from foveacam_pipeline.models.mirror import DAC_STEP_V


def law(volts_v: NDArray[np.float64]) -> NDArray[np.float64]:
    """A mirror bent like the published one (saturation 11 %, cross terms 0.4 deg), by no polynomial."""
    x, y = np.deg2rad(0.060) * volts_v[:, 0], np.deg2rad(0.052) * volts_v[:, 1]
    ax = np.arctan(1.9 * x) / 1.9 + 0.3 * np.deg2rad(0.4) * np.sinh(y * 8) ** 2 + 0.002
    return np.column_stack([ax, np.arctan(2.0 * y) / 2.0 - 0.25 * x * y - 0.001])


def sweep_v(side: int = 13) -> NDArray[np.float64]:
    line = np.linspace(-169.0, 169.0, side)
    return np.array([(x, y) for y in line for x in line])


@pytest.fixture(scope="module")
def mirror() -> MirrorModel:
    return fit_mirror_models(sweep_v(), law(sweep_v())).model


VOLT = st.floats(-165.0, 165.0)


@settings(deadline=None)
@given(x_v=VOLT, y_v=VOLT)
def test_volts_survive_angles_below_half_a_dac_step(mirror: MirrorModel, x_v: float, y_v: float) -> None:
    back = mirror.volts(*mirror.angles_rad(MirrorVolts(x_v=x_v, y_v=y_v)))
    assert abs(back.x_v - x_v) < DAC_STEP_V / 2
    assert abs(back.y_v - y_v) < DAC_STEP_V / 2


@settings(deadline=None)
@given(ax=st.floats(-0.11, 0.11), ay=st.floats(-0.1, 0.1))
def test_angles_survive_volts(mirror: MirrorModel, ax: float, ay: float) -> None:
    # A millionth of a DAC step of 1 mrad/V.
    np.testing.assert_allclose(mirror.angles_rad(mirror.volts(ax, ay)), (ax, ay), atol=1e-11)


def test_a_poor_starting_polynomial_does_not_spoil_the_round_trip(mirror: MirrorModel) -> None:
    volts = sweep_v(9) * 0.95
    poor = fit_polynomial(mirror.angles_of(sweep_v()), sweep_v(), 1).polynomial
    started = replace(mirror, inverse=poor)
    assert np.abs(poor(mirror.angles_of(volts)) - volts).max() > 1000 * DAC_STEP_V
    assert np.abs(started.volts_for(mirror.angles_of(volts)) - volts).max() < DAC_STEP_V / 2


def test_many_directions_at_once_equal_one_by_one(mirror: MirrorModel) -> None:
    angles = np.array([[0.05, -0.02], [-0.1, 0.08]])
    together = mirror.volts_for(angles)
    for row, (ax, ay) in zip(together, angles.tolist(), strict=True):
        one = mirror.volts(ax, ay)
        np.testing.assert_allclose(row, [one.x_v, one.y_v], atol=1e-9)


def test_a_direction_beyond_the_calibrated_field_is_refused_with_the_range(mirror: MirrorModel) -> None:
    assert not mirror.contains(math.radians(11.0), 0.0)
    with pytest.raises(OutOfRange, match=r"ax 11\.00°, ay 0\.00° is beyond the calibrated field .*\(ax -"):
        mirror.volts(math.radians(11.0), 0.0)


def test_a_direction_that_is_no_number_is_refused(mirror: MirrorModel) -> None:
    with pytest.raises(OutOfRange):
        mirror.volts(math.nan, 0.0)


def test_no_direction_inside_asks_for_more_volts_than_were_calibrated(mirror: MirrorModel) -> None:
    line = np.deg2rad(np.linspace(-11.0, 11.0, 60))
    angles = np.array([(x, y) for x in line for y in line])
    inside = mirror.inside(angles)
    assert 0.2 < inside.mean() < 0.9
    assert np.abs(mirror.volts_for(angles[inside])).max() <= 169.0


def test_a_direction_just_beyond_the_calibrated_volts_is_refused_and_not_clipped(mirror: MirrorModel) -> None:
    for axis in (0, 1):
        beyond_v = np.zeros((1, 2))
        beyond_v[0, axis] = mirror.max_v[axis] + 0.3  # a fiftieth of a degree, within the margin of the field
        angles = mirror.angles_of(beyond_v)
        assert not mirror.inside(angles).any()
        with pytest.raises(OutOfRange):
            mirror.volts_for(angles)
        assert mirror.inside(mirror.angles_of(beyond_v - np.sign(beyond_v) * 0.6)).all()


def test_every_calibrated_direction_but_the_rim_is_inside(mirror: MirrorModel) -> None:
    assert mirror.inside(law(sweep_v() * 0.99)).all()


def test_stated_error_is_that_of_unseen_volts() -> None:
    noise_rad = math.radians(0.005)
    rng = np.random.default_rng(7)
    fitted = fit_mirror_models(sweep_v(), law(sweep_v()) + noise_rad * rng.standard_normal((169, 2))).model
    unseen = rng.uniform(-165.0, 165.0, (400, 2))
    rms = np.sqrt(np.mean((fitted.angles_of(unseen) - law(unseen)) ** 2, axis=0))
    # One draw of some 20 coefficients: their mean square scatters by sqrt(2/20), a third; 1.6 is two such.
    assert (rms < 1.6 * np.array(fitted.sigma_rad)).all()
    assert (np.array(fitted.sigma_rad) < noise_rad).all()
    assert (np.array(fitted.loo_rad) > noise_rad * 0.9).all()  # it contains the noise of one sample


def test_what_a_low_order_cannot_follow_is_in_the_stated_error() -> None:
    coarse = fit_mirror_models(sweep_v(), law(sweep_v()), orders=(2,)).model
    unseen = np.random.default_rng(8).uniform(-165.0, 165.0, (400, 2))
    rms = np.sqrt(np.mean((coarse.angles_of(unseen) - law(unseen)) ** 2, axis=0))
    np.testing.assert_allclose(coarse.sigma_rad, rms, rtol=0.35)  # a smooth misfit, judged on other points
