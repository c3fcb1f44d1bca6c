"""The fitted weights of the error model, one set for each matcher; `errors` names the data."""

from foveacam_pipeline.stereo.errors import CueWeights, ErrorModel

SEMI_GLOBAL = ErrorModel(
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
    log_sigma=CueWeights(
        constant=-0.306,
        noise_sigma=0.303,
        noise=0.333,
        step=0.192,
        spread=0.355,
        wide_spread=0.057,
        holes=-0.009,
        wide_holes=0.104,
        likeness=-0.116,
    ),
    log_odds_wrong=CueWeights(
        constant=-1.924,
        noise_sigma=0.142,
        noise=0.818,
        step=0.328,
        spread=0.482,
        wide_spread=0.411,
        holes=-3.338,
        wide_holes=0.800,
        likeness=-1.197,
    ),
)
"""Of `live`."""
