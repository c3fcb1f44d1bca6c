"""The fitted weights of the error model, one set for each matcher; `errors` names the data."""

from foveacam_pipeline.stereo.errors import FULL_SIZE, HALF_SIZE, CueWeights, ErrorModel

SEMI_GLOBAL = ErrorModel(
    windows=FULL_SIZE,
    log_sigma=CueWeights(
        constant=-0.858,
        noise_sigma=0.257,
        noise=0.223,
        step=0.028,
        spread=0.646,
        wide_spread=0.017,
        holes=1.884,
        wide_holes=-0.185,
        likeness=0.050,
    ),
    log_odds_wrong=CueWeights(
        constant=-3.041,
        noise_sigma=0.039,
        noise=0.742,
        step=0.149,
        spread=0.780,
        wide_spread=0.272,
        holes=0.393,
        wide_holes=1.259,
        likeness=-0.665,
    ),
)
"""Of `match`."""
LIVE = ErrorModel(
    windows=HALF_SIZE,
    log_sigma=CueWeights(
        constant=-0.014,
        noise_sigma=0.362,
        noise=0.294,
        step=-0.158,
        spread=0.36,
        wide_spread=0.17,
        holes=0.937,
        wide_holes=0.444,
        likeness=-1.146,
    ),
    log_odds_wrong=CueWeights(
        constant=-1.206,
        noise_sigma=0.227,
        noise=0.614,
        step=0.01,
        spread=0.384,
        wide_spread=0.449,
        holes=-0.216,
        wide_holes=3.817,
        likeness=-2.455,
    ),
)
"""Of `live`."""
