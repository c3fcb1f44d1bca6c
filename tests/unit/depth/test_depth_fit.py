"""The fit of dense depth's error model on data made by known weights."""

import numpy as np

from foveacam_bench.depth.error_fit import CUES, FitData, fit_cues

COUNT = 20_000
LOG_SIGMA, STEP_WEIGHT = -1.5, 0.6
LOG_ODDS, SPREAD_WEIGHT = -2.0, 0.9
WRONG_ERROR_PX = 20.0


def made_by_known_weights() -> FitData:
    """Return errors whose sigma follows the cue `step`, and some gross ones whose odds follow `spread`."""
    rng = np.random.default_rng(8)
    cues = rng.normal(0.0, 0.6, (COUNT, len(CUES)))
    cues[:, 0] = 1.0
    sigma_px = np.exp(LOG_SIGMA + STEP_WEIGHT * cues[:, CUES.index("step")]) / 2.0
    odds = np.exp(LOG_ODDS + SPREAD_WEIGHT * cues[:, CUES.index("spread")])
    wrong = rng.random(COUNT) < odds / (1.0 + odds)
    error_px = np.where(wrong, WRONG_ERROR_PX, np.clip(rng.normal(0.0, sigma_px), -1.0, 1.0))
    return FitData(
        cues=cues, error_px=error_px, weight=np.full(COUNT, 1.0 / COUNT), alike=np.ones(COUNT, dtype=np.bool_)
    )


def test_the_odds_of_a_gross_error_are_found() -> None:
    _, odds = fit_cues(made_by_known_weights())

    assert abs(odds.constant - LOG_ODDS) < 0.1  # three standard errors at 20 000 samples, 2 400 of them wrong
    assert abs(odds.spread - SPREAD_WEIGHT) < 0.15
    assert abs(odds.step) < 0.15


def test_the_fitted_sigma_holds_68_percent_of_the_errors_and_follows_its_cue() -> None:
    data = made_by_known_weights()
    sigma, _ = fit_cues(data)
    stated_px = np.exp(data.cues @ np.array([getattr(sigma, name) for name in CUES]))

    assert abs((np.abs(data.error_px) <= stated_px).mean() - 0.683) < 0.01
    assert abs(sigma.step - STEP_WEIGHT) < 0.1
