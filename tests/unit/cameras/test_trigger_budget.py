"""How often both foveae can be triggered."""

import pytest

from foveacam_hardware.contract import InvalidInput, trigger_budget


@pytest.mark.parametrize(
    ("exposures_us", "most_rates_hz", "settle_us", "pulse_us", "interval_ms", "rate_hz"),
    [
        ((5000.0, 4000.0), (226.0, 226.0), 2000.0, 5000.0, 7.5, 133.3),  # the exposure outlasts a frame
        ((1000.0, 1000.0), (226.0, 200.0), 0.0, 1000.0, 5.5, 181.8),  # the slower camera says when
        ((8000.0, 8000.0), (228.0, 228.0), 14_000.0, 8000.0, 22.5, 44.4),  # the filter of 120 Hz
    ],
)
def test_looks_follow_each_other_as_fast_as_mirrors_and_cameras_allow(
    exposures_us: tuple[float, float],
    most_rates_hz: tuple[float, float],
    settle_us: float,
    pulse_us: float,
    interval_ms: float,
    rate_hz: float,
) -> None:
    budget = trigger_budget(exposures_us, most_rates_hz, settle_us=settle_us)
    assert budget.pulse_us == pulse_us
    assert budget.interval_ms == pytest.approx(interval_ms)
    assert budget.rate_hz == pytest.approx(rate_hz, abs=0.05)


@pytest.mark.parametrize(
    ("exposure_us", "rate_hz", "settle_us"), [(0.0, 226.0, 0.0), (1000.0, 0.0, 0.0), (1000.0, 226.0, -1.0)]
)
def test_budget_of_what_cannot_be_is_refused(exposure_us: float, rate_hz: float, settle_us: float) -> None:
    with pytest.raises(InvalidInput, match="trigger budget"):
        trigger_budget((1000.0, exposure_us), (226.0, rate_hz), settle_us=settle_us)
